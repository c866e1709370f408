"""The oracle's flight, rules and expectations, on what is known in closed form."""

import numpy as np
from numpy.testing import assert_allclose

from navfilters.oracles import xiong_orbit as oracle


def test_the_true_flight_ends_at_the_perigee_of_the_paper():
    x = oracle.flight()[121]  # after the last burn
    mu = oracle.MU
    r, v2 = np.linalg.norm(x[:3]), x[3:] @ x[3:]
    a = 1 / (2 / r - v2 / mu)
    h = np.linalg.norm(np.cross(x[:3], x[3:]))
    perigee = a * (1 - np.sqrt(1 - h**2 / (mu * a)))
    assert_allclose(perigee - oracle.RADIUS, 2000e3, atol=3e3)  # J2 moves it within the interval


def test_a_gate_brings_the_square_to_its_expectation_and_is_closed_below():
    H, P, R = np.eye(2)[None], 3 * np.eye(2)[None], np.eye(2)
    rule = oracle.gate(0.99)
    near, far = np.array([[1.0, 1.0]]), np.array([[9.0, 2.0]])
    assert_allclose(rule(None, near, H, P, R, None)[0], P)
    S = H[0] @ rule(None, far, H, P, R, None)[0][0] @ H[0].T + R
    assert_allclose(far[0] @ np.linalg.solve(S, far[0]), 2.0, rtol=1e-9)


def test_fading_makes_the_traces_equal():
    H, P, R, W = np.eye(2)[None], 3 * np.eye(2)[None], np.eye(2), 0.5 * np.eye(2)[None]
    y = np.array([[9.0, 2.0]])
    grown, V = oracle.fading(0.95, 1.0)(None, y, H, P, R, W)
    assert_allclose(np.trace(grown[0] + R), np.trace(V[0]))
    calm, _ = oracle.fading(0.95, 1.0)(None, 0 * y, H, P, R, W)
    assert_allclose(calm, P)


def test_a_robust_rule_is_skipped_where_P_is_too_large():
    P = np.diag([1.0, 4.0])[None]
    weights = np.array([0.1, 0.1])
    grown, _ = oracle.robust(weights)(None, None, None, P, None, None)
    assert_allclose(np.diag(grown[0]), [1 / (1 - 0.1), 1 / (0.25 - 0.1)])
    same, _ = oracle.robust(weights)(None, None, None, 100 * P, None, None)
    assert_allclose(same, 100 * P)
