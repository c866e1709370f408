"""The DT-EKF: what it refuses, by name, and where its Jacobians are looked at."""

from dataclasses import replace

import numpy as np
import pytest
from discrete_systems import LINEAR, PRIOR, STEPS, F, L, M, Q, ekf, predict, signals, update

from navfilters import FILTERS, Gaussian, run, sweep
from navfilters.estimators.continuous import ContinuousSystem, extended_kalman_bucy
from navfilters.estimators.discrete import DiscreteSystem

GOOD = dict(zip(("y", "u"), signals(), strict=True)) | {"system": LINEAR, "prior": PRIOR}
BAD = [
    ({"prior": PRIOR.mean}, ValueError, r"prior must be a Gaussian\(mean, cov\); found ndarray"),
    ({"prior": Gaussian(np.ones(2), np.eye(2))}, ValueError, "system.h must return"),
    ({"prior": Gaussian(np.ones(3), -np.eye(3))}, ValueError, "prior.cov must be symmetric pos"),
    (
        {"prior": Gaussian(np.ones((4, 3)), np.eye(3)), "y": np.ones((STEPS, 5, 2))},
        ValueError,
        "bro",
    ),
    ({"y": 1.0}, ValueError, r"z must have shape \(steps, \.\.\., m\); found \(\)"),
    ({"y": np.ones(STEPS)}, ValueError, r"z must have shape .* with 30 steps; found \(30,\)"),
    ({"y": np.ones((0, 2))}, ValueError, "u must have one input per step, 0; found 30"),
    ({"y": np.ones((STEPS, 3))}, ValueError, r"z must .* with m = 2 .*; found \(30, 3\)"),
    ({"y": np.full((STEPS, 2), np.inf)}, ValueError, "z must be finite, or NaN where it was not"),
    ({"u": np.ones((STEPS - 1, 2))}, ValueError, "u must have one input per step, 30; found 29"),
    ({"u": np.ones((STEPS + 1, 2))}, ValueError, "u must have one input per step, 30; found 31"),
    ({"u": np.ones(STEPS)}, ValueError, r"u must have shape \(K, \.\.\., m\); found \(30,\)"),
    ({"u": np.ones((STEPS, 3))}, ValueError, "system.f must return"),
    ({"u": None}, ValueError, r"system.f must return .* shapes (\(3,\)|\(1, 3\)), \(0,\)"),
    ({"u": [["a"]]}, ValueError, "u must be an array .* of finite real numbers"),
    ({"system": replace(LINEAR, Q=np.eye(3))}, ValueError, "system.f must return"),
    ({"system": replace(LINEAR, R=np.eye(2))}, ValueError, "system.h must return"),
    ({"system": replace(LINEAR, F=lambda *a: L)}, ValueError, r"system.F must .*found \(3, 2\)"),
    ({"system": replace(LINEAR, L=lambda *a: F)}, ValueError, r"system.L must .*found \(3, 3\)"),
    ({"system": replace(LINEAR, H=lambda *a: M.T)}, ValueError, r"system.H must .*found \(3, 2\)"),
    ({"system": replace(LINEAR, M=lambda *a: Q[0])}, ValueError, r"system.M must .*found \(2,\)"),
    ({"system": replace(LINEAR, h=lambda x, v, k: x[:2].real + v[:2].real)}, TypeError, "system.h"),
]


def swept(system, prior, y, u=None):
    return sweep(
        FILTERS["EKF"],
        prior,
        y,
        system.sensor,
        dynamics=system.dynamics(u),
        z_per_step=True,
        progress=False,
    )


@pytest.mark.parametrize("loop", [ekf, swept])
@pytest.mark.parametrize(("change", "error", "message"), BAD)
def test_bad_input(loop, change, error, message):
    with pytest.raises(error, match=message.replace("prior", "priors?")):
        loop(**GOOD | change)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"f": 1}, TypeError, "f must be callable; found 1"),
        ({"h": None}, TypeError, "h must be callable; found None"),
        ({"M": np.eye(2)}, TypeError, "M must be callable"),
        ({"Q": -Q}, ValueError, "Q must be symmetric positive semidefinite"),
        ({"R": [1.0]}, ValueError, r"R must be an array \(\.\.\., n, n\)"),
    ],
)
def test_bad_system(change, error, message):
    with pytest.raises(error, match=message):
        replace(LINEAR, **change)


# Functions that no complex step goes through: refused before the first step, or in it.


def slowed(x, u, w, k):
    """Drag, which has the derivative 0 at rest, by any method."""
    return np.stack([x[..., 0] - 0.1 * x[..., 0] * abs(x[..., 0]) + w[..., 0]], -1)


def pushed(x, u, w, k):
    """The noise enters by its size, twice."""
    return np.stack([x[..., 0] + w[..., 0] + 0.3 * np.sqrt(np.vecdot(w + 1, w + 1))], -1)


def far(x, v, k):
    return np.stack([x[..., 0] + 0.01 * np.linalg.norm(x + 3, axis=-1) + v[..., 0]], -1)


def coloured(x, v, k):
    return np.stack([x[..., 0] + v[..., 0] + 0.5 * (v[..., 0] + 1).real], -1)


def bent_later(x, v, k):
    """Analytic at the prior, not where the filter ends."""
    x = x[..., :1]
    return np.where(x.real < 5, x, x + 0.1 * np.abs(x)) + v


SCALAR = DiscreteSystem(lambda x, u, w, k: x + w, lambda x, v, k: x + v, [[0.1]], [[0.1]])
AT_REST = Gaussian(np.zeros(1), np.eye(1))
HIDDEN = {
    "F": ({"f": slowed}, "system.f must be analytic .* component 0 in column 0"),
    "L": ({"f": pushed}, "system.f must be analytic"),
    "H": ({"h": far}, "system.h must be analytic"),
    "M": ({"h": coloured}, "system.h must be analytic"),
    "the last": ({"h": bent_later}, "system.h must be analytic"),
}


@pytest.mark.parametrize("case", HIDDEN)
@pytest.mark.parametrize("members", [(), (3,)])
def test_a_function_that_is_not_analytic_is_refused(case, members):
    change, message = HIDDEN[case]
    y = np.full((4, *members, 1), 8.0)
    with pytest.raises(TypeError, match=message):
        ekf(replace(SCALAR, **change), AT_REST, y)


def test_a_single_prediction_or_update_looks_too():
    state = Gaussian(np.ones(1), np.eye(1))
    with pytest.raises(TypeError, match=r"system\.f must be analytic"):
        predict(replace(SCALAR, f=slowed), state, np.zeros(0), 0)
    with pytest.raises(TypeError, match=r"system\.h must be analytic"):
        update(replace(SCALAR, h=far), state, np.ones(1), 1)


def test_with_its_jacobians_any_function_is_taken():
    system = replace(
        SCALAR,
        f=slowed,
        h=far,
        F=lambda x, u, w, k: 1 - 0.2 * np.abs(x[..., None]),
        H=lambda x, v, k: 1 + 0.01 * np.sign(x[..., None] + 3),
    )
    assert np.isfinite(ekf(system, AT_REST, np.ones((4, 1))).cov).all()


def test_the_steps_do_not_look_again():
    """Each further step costs the same few calls, for one member as for many."""
    calls = []

    def count(steps, members=()):
        def f(x, u, w, k):
            calls.append(k)
            return x + w

        calls.clear()
        ekf(replace(SCALAR, f=f), AT_REST, np.ones((steps, *members, 1)))
        return len(calls)

    for members in ((), (50,)):  # f itself, and a column of each of F and L
        assert count(30, members) - count(20, members) == 10 * 3


# A system is no model, and a model no system.

COLUMN = np.ones((3, 1))
WRONG = {
    "the system as the model": ({"model": SCALAR}, "model must be .*model=system.sensor"),
    "the system as the dynamics": (
        {"dynamics": SCALAR},
        r"dynamics must be .*system.dynamics\(u\)",
    ),
    "a continuous system": (
        {"model": ContinuousSystem(lambda x, u, w, t: w, lambda x, v, t: x + v, [[1]], [[1]])},
        "model must be a model in discrete time; found a ContinuousSystem: extended_kalman_bucy",
    ),
    "a continuous filter": (
        {"estimator": extended_kalman_bucy},
        "estimator must be callable as .*; found extended_kalman_bucy: missing .* 't'",
    ),
}


@pytest.mark.parametrize("loop", [run, sweep])
@pytest.mark.parametrize("case", WRONG)
def test_what_does_not_go_together(case, loop):
    change, message = WRONG[case]
    right = {
        "estimator": FILTERS["EKF"],
        "model": SCALAR.sensor,
        "dynamics": SCALAR.dynamics(),
    } | change
    prior = {"prior" if loop is run else "priors": AT_REST}
    with pytest.raises(TypeError, match=message):
        loop(**right, **prior, z=COLUMN, z_per_step=True)


def test_a_kalman_bucy_filter_takes_no_discrete_system():
    with pytest.raises(TypeError, match="system must be a ContinuousSystem; found DiscreteSystem"):
        extended_kalman_bucy(SCALAR, AT_REST, lambda t: np.ones(1), [0.0, 1.0])
