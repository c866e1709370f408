"""The bound of Cramer and Rao, by inverses and by a plain loop over the seconds."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from navfilters.papers.xiong2009 import Setup, cramer_rao_bound, root_mean_square, truth

SHORT = Setup(duration=2000, window=500, burns=((700, 900),), thrust=0.45)


def test_information_limit():
    """650 m without process noise and 682 m with it at the measurement times (REPLICATION, C)."""
    rms = {}
    for noisy in (False, True):
        bound = cramer_rao_bound("A", process_noise=noisy)
        assert bound.shape == (20001, 3)
        at_updates = bound[18000::100]
        rms[noisy] = np.sqrt(np.mean(np.sum(at_updates**2, axis=1)))
        assert root_mean_square(bound[-2001:])[3] > rms[noisy]
    assert_allclose([rms[False], rms[True]], [650, 682], atol=1)


def test_information_limit_of_an_unknown_thrust():
    known = cramer_rao_bound("A", process_noise=False)
    unknown = cramer_rao_bound("A", thrust="unknown", process_noise=False)
    assert_allclose(unknown[:7201], known[:7201], rtol=1e-9)  # up to the first burn's interval
    limit = root_mean_square(unknown[-2001:])[3]
    assert_allclose(limit, 2006, atol=2)
    freer = cramer_rao_bound("A", thrust="unknown", process_noise=False, acceleration=45.0)
    assert limit < root_mean_square(freer[-2001:])[3] < 1.03 * limit


def test_information_recursion_is_that_of_inverses():
    """The same bound from J = (F J^-1 F^T + Q)^-1 + H^T R^-1 H, literally."""
    flight, sensor = truth(SHORT), SHORT.sensor
    orbit = SHORT.orbit(flight.thrust)
    J = np.linalg.inv(SHORT.prior.cov)
    for t in range(0, 2000, 100):
        _, F, Q = orbit.at(t // 100).propagate(flight.states[t], orbit.Q)
        H = sensor.jacobian(flight.states[t + 100])
        J = np.linalg.inv(F @ np.linalg.inv(J) @ F.T + Q)
        J = J + H.T @ np.linalg.inv(sensor.R) @ H
    wanted = np.sqrt(np.diag(np.linalg.inv(J))[:3])
    assert_allclose(cramer_rao_bound(SHORT)[-1], wanted, rtol=1e-5)


@pytest.mark.parametrize("thrust", ["known", "unknown"])
def test_the_bound_is_that_of_a_plain_loop_over_the_seconds(thrust):
    """At every second, not only at updates; the loop does not look at whole intervals."""
    flight, sensor = truth(SHORT), SHORT.sensor
    known = thrust == "known"
    orbit = SHORT.orbit(flight.thrust) if known else SHORT.orbit()
    step, a = replace(orbit, substeps=1), flight.thrust.magnitude
    P = np.zeros((9, 9))
    P[:6, :6] = SHORT.prior.cov
    wanted = [P]
    for t in range(2000):
        P = P.copy()
        if t % 100 == 0:
            P[6:], P[:, 6:] = 0, 0
            P[6:, 6:] = a**2 * np.eye(3)
        F = np.eye(9)
        F[:6, :6] = step.transitions(flight.states[t : t + 2], float(t))[0]
        if not known and 700 <= t < 900:
            F[:6, 6:] = np.concatenate([np.eye(3) / 2, np.eye(3)])
        P = F @ P @ F.T
        P[:6, :6] += orbit.Q
        if (t + 1) % 100 == 0:
            H = np.zeros((2, 9))
            H[:, :6] = sensor.jacobian(flight.states[t + 1])
            K = P @ H.T @ np.linalg.inv(H @ P @ H.T + sensor.R)
            P = P - K @ H @ P
        wanted.append(P)
    deviation = np.sqrt(np.diagonal(wanted, axis1=1, axis2=2)[:, :3])
    assert_allclose(cramer_rao_bound(SHORT, thrust=thrust), deviation, rtol=1e-7)


def test_information_limit_of_one_unknown_strength():
    """843.2 m at 18 000 s, by central differences of whole flights in the chapter on limits."""
    known = cramer_rao_bound("A", process_noise=False)
    strength = cramer_rao_bound("A", thrust="strength", process_noise=False)
    assert_allclose(strength[:7293], known[:7293], rtol=1e-9)
    assert_allclose(np.linalg.norm(strength[18000]), 843.2, rtol=1e-3)
    told = cramer_rao_bound("A", thrust="strength", process_noise=False, acceleration=1e-9)
    assert_allclose(told, known, rtol=1e-6)
