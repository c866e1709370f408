"""Kalman-Bucy filters: references that are none, and what is refused by name."""

from dataclasses import replace

import numpy as np
import pytest
from continuous_systems import (
    LINEAR,
    NONLINEAR,
    PRIOR,
    SPAN,
    START,
    TIMES,
    A,
    C,
    M,
    ekf,
    f,
    lkf,
    nonlinear_y,
    some_reference,
    u,
    y,
)
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from navfilters import Gaussian
from navfilters.estimators.continuous import (
    ContinuousSystem,
    Reference,
    extended_kalman_bucy,
    linearized_kalman_bucy,
    reference_residual,
)

# The reference's own dynamics.


def fall(t):
    """Ten units per time squared, where f says nine."""
    return np.array([5 * t**2, 10 * t])


FALLING = ContinuousSystem(
    lambda x, u, w, t: np.stack([x[1] + 0 * w[0], 9.0 + w[0]]),
    lambda x, v, t: x[:1] + v,
    [[1]],
    [[1]],
)


def falling(reference, **options):
    prior = Gaussian(np.zeros(2), np.eye(2))
    times = np.linspace(0, 2, 3)
    return linearized_kalman_bucy(
        FALLING, reference, prior, lambda t: np.zeros(1), times, **options
    )


def test_the_residual_is_what_is_missing():
    times, residual = reference_residual(FALLING, Reference(fall), np.linspace(0, 2, 3))
    assert times.shape == (200,)
    assert_allclose(residual, np.tile([0.0, 1.0], (200, 1)), atol=1e-11)


@pytest.mark.parametrize("t", [np.arange(0, 2.05, 0.1), [0, 1, 1 + 1e-12, 2], [0, 0.1, 2]])
def test_output_times_do_not_decide_the_residual(t):
    times, residual = reference_residual(FALLING, Reference(fall), np.array(t))
    assert len(times) >= 200
    assert_allclose(residual, np.tile([0.0, 1.0], (len(times), 1)), atol=1e-9)


def test_no_piece_is_longer_than_a_200th_of_the_whole():
    """Intervals of which 100.6 and 99.4 would fit: 101 and 100 pieces, of one length in each."""
    times, _ = reference_residual(FALLING, Reference(fall), np.array([1.0, 2.006, 3.0]))
    first, second = times[:101], times[101:]
    assert len(second) == 100
    assert_allclose(first, 1 + 1.006 * (np.arange(101) + 0.5) / 101, rtol=1e-13)
    assert_allclose(second, 2.006 + 0.994 * (np.arange(100) + 0.5) / 100, rtol=1e-13)


def test_the_residual_is_each_pieces_average():
    """x = t^3 under a rate of 10 t^9, averaged by hand over pieces of a 200th of the whole."""
    system = ContinuousSystem(
        lambda x, u, w, t: np.array([10 * t**9]) + w, lambda x, v, t: x + v, np.eye(1), np.eye(1)
    )
    times, residual = reference_residual(
        system, Reference(lambda t: np.array([t**3])), np.array([0.0, 0.5, 0.5 + 1e-7, 2.0])
    )
    ends = np.linspace(0, 0.5, 51), np.linspace(0.5 + 1e-7, 2, 151)
    a, b = (np.concatenate([piece[i : len(piece) - 1 + i] for piece in ends]) for i in (0, 1))
    assert_allclose(times, (a + b) / 2, rtol=1e-13)
    wanted = a**2 + a * b + b**2 - (b**10 - a**10) / (b - a)
    assert_allclose(residual[:, 0], wanted, rtol=1e-9, atol=1e-9)


def test_a_false_reference_is_rejected_with_the_residual_found():
    message = (
        r"reference must satisfy dx/dt = f\(x, u, w, t\) to 1e-06 of its rates; found a residual "
        r"of 1 in component 1 at t = .*, where at most 9e-06 is allowed"
    )
    with pytest.raises(ValueError, match=message):
        falling(Reference(fall))


def test_the_worst_time_is_named():
    def kicked(t):
        late = max(t - 1.5, 0)
        return np.array([4.5 * t**2 + late**3, 9 * t + 3 * late**2])

    with pytest.raises(ValueError, match=r"residual of 2\.9\d in component 1 at t = 1\.99"):
        falling(Reference(kicked))


def test_the_tolerance_is_an_argument():
    assert falling(Reference(fall), residual_tol=0.2).mean.shape == (3, 2)


def test_the_reference_noise_may_be_what_was_missing():
    assert falling(Reference(fall, w=lambda t: np.ones(1))).mean.shape == (3, 2)


@pytest.mark.parametrize("angle", [0.0, np.pi, 3 * np.pi])
def test_an_equilibrium_is_a_reference(angle):
    """f is 1e-16 there, not 0: the lecture's own example of a nominal trajectory."""
    pendulum = ContinuousSystem(
        lambda x, u, w, t: np.stack([x[1], -10 * np.sin(x[0]) + w[0]]),
        lambda x, v, t: x[:1] + v,
        [[0.1]],
        [[0.1]],
    )
    still = np.array([angle, 0.0])
    got = linearized_kalman_bucy(
        pendulum,
        Reference(lambda t: still),
        Gaussian(still, 0.01 * np.eye(2)),
        lambda t: still[:1],
        [0.0, 1.0],
    )
    assert_allclose(got.mean, [still, still], atol=1e-12)


def test_a_reference_integrated_carelessly_is_caught():
    careless = solve_ivp(
        lambda t, x: f(x, None, np.zeros(2), t), (0, 3), [0.5, 0.1], dense_output=True
    )
    with pytest.raises(ValueError, match="reference must satisfy"):
        linearized_kalman_bucy(NONLINEAR, Reference(careless.sol), START, nonlinear_y, SPAN)


# Bad input.

GOOD = {"system": LINEAR, "prior": PRIOR, "y": y, "t": TIMES, "u": u}
BAD = [
    ({"system": "s"}, TypeError, "system must be a ContinuousSystem; found str"),
    ({"prior": (1, 2)}, ValueError, r"prior must be a Gaussian\(mean, cov\); found tuple"),
    ({"prior": Gaussian(np.ones(2), np.eye(2))}, ValueError, r"must return shape .* \(2,\)"),
    (
        {"prior": Gaussian(np.ones((4, 3)), np.eye(3))},
        ValueError,
        r"prior must have shapes \(n,\) and \(n, n\), no batch axes; found \(4, 3\)",
    ),
    ({"prior": Gaussian(np.ones(3), -np.eye(3))}, ValueError, "prior.cov must be symmetric pos"),
    ({"prior": Gaussian(np.array([0, np.nan, 0]), np.eye(3))}, ValueError, "prior.mean must be"),
    ({"y": np.ones(2)}, TypeError, "y must be a function of time; found ndarray"),
    ({"y": None}, TypeError, "y must be a function of time; found NoneType"),
    ({"y": lambda t: 1.0}, ValueError, r"y must return shape \(m,\), finite; found shape \(\)"),
    ({"y": lambda t: np.ones(3)}, ValueError, r"system.h must return shape \(\.\.\., 3\)"),
    (
        {"y": lambda t: np.array([1, np.nan])},
        ValueError,
        r"y must return .* found .*nan.* t = 0\.5",
    ),
    ({"y": lambda t: np.ones(2) * (t < 3) / (t < 3)}, ValueError, "y must return .* at t = [3-6]"),
    ({"y": lambda t: np.ones(2 + (t > 3))}, ValueError, r"y must return shape \(2,\).*\(3,\) at t"),
    ({"t": 1.0}, ValueError, r"t must be an array \(\.\.\., k\)"),
    ({"t": [1.0]}, ValueError, "t must be at least two increasing times"),
    ({"t": [1.0, 1.0]}, ValueError, "t must be at least two increasing times"),
    ({"t": [0.0, np.inf]}, ValueError, "t must be .* finite"),
    ({"t": np.ones((2, 2))}, ValueError, "t must be at least two increasing times"),
    ({"u": np.ones(2)}, TypeError, "u must be a function of time; found ndarray"),
    ({"u": lambda t: np.ones(2, complex)}, ValueError, "u must return shape"),
    ({"rtol": 0.0}, ValueError, "rtol must be in"),
    ({"rtol": np.nan}, ValueError, "rtol must be in"),
    ({"atol": -1.0}, ValueError, "atol must be a finite positive"),
    ({"method": "Euler"}, ValueError, "method"),
    ({"system": replace(LINEAR, R=np.zeros((3, 3)))}, ValueError, "M R M.*system.M and system.R"),
    ({"system": replace(LINEAR, R=np.eye(2))}, ValueError, "system.h must return"),
    ({"system": replace(LINEAR, Q=np.eye(3))}, ValueError, "system.f must return"),
    ({"system": replace(LINEAR, A=lambda *a: np.eye(2))}, ValueError, r"system.A .*found \(2, 2\)"),
    ({"system": replace(LINEAR, L=lambda *a: A)}, ValueError, r"system.L must .*found \(3, 3\)"),
    ({"system": replace(LINEAR, C=lambda *a: C.T)}, ValueError, r"system.C must .*\(3, 2\)"),
    ({"system": replace(LINEAR, M=lambda *a: C[0])}, ValueError, r"system.M must .*found \(3,\)"),
    ({"system": replace(LINEAR, h=lambda x, v, t: abs(x[:2] + v[:2]))}, TypeError, "system.h must"),
]


@pytest.mark.parametrize("filter_", [linearized_kalman_bucy, extended_kalman_bucy])
@pytest.mark.parametrize(("change", "error", "message"), BAD)
def test_bad_input(filter_, change, error, message):
    arguments = GOOD | change
    if filter_ is linearized_kalman_bucy:
        arguments["reference"] = some_reference()
        if "prior" in change and "return" in message:
            message = r"reference.x must return shape \(2,\), finite; found shape \(3,\)"
    with np.errstate(all="ignore"), pytest.raises(error, match=message):
        filter_(**arguments)


@pytest.mark.parametrize(
    ("reference", "error", "message"),
    [
        (None, TypeError, "reference must be a Reference; found NoneType"),
        (Reference(None), TypeError, "reference.x must be a function of time"),
        (Reference(lambda t: np.ones(2)), ValueError, r"reference.x must return shape \(3,\)"),
        (replace(some_reference(), u=3.0), TypeError, "reference.u must be a function of time"),
        (replace(some_reference(), u=None), ValueError, r"u must return shape \(0,\)"),
        (replace(some_reference(), w=lambda t: np.ones(3)), ValueError, r"reference.w .*\(2,\)"),
        (replace(some_reference(), v=lambda t: np.ones(2)), ValueError, r"reference.v .*\(3,\)"),
    ],
)
def test_bad_reference(reference, error, message):
    with pytest.raises(error, match=message):
        linearized_kalman_bucy(LINEAR, reference, PRIOR, y, TIMES, u)


def test_only_the_lkf_needs_the_inputs_jacobian():
    wrong = replace(LINEAR, B=lambda *a: A)
    with pytest.raises(
        ValueError, match=r"system.B must return .*\(\.\.\., 3, 2\).*found \(3, 3\)"
    ):
        lkf(system=wrong)
    assert_array_equal(ekf(wrong).mean, ekf().mean)


def test_a_gain_that_vanishes_on_the_way_is_reported_with_its_time():
    system = replace(LINEAR, M=lambda x, v, t: M * (t < 2))
    with pytest.raises(
        ValueError, match=r"M R M\^T, .* must be positive definite; found .* t = [2-6]"
    ):
        ekf(system)


def test_an_integration_that_stops_says_where():
    """dx/dt = x^2 from 1 escapes at t = 1; the measurement says nothing."""
    escape = ContinuousSystem(lambda x, u, w, t: x**2 + w, lambda x, v, t: 0 * x + v, [[0]], [[1]])
    prior = Gaussian(np.ones(1), np.zeros((1, 1)))
    with pytest.raises(RuntimeError, match=r"integration stopped at t = (1|0\.99)"):
        extended_kalman_bucy(escape, prior, lambda t: np.zeros(1), [0.0, 2.0])


# Functions that no complex step goes through.

PLAIN = ContinuousSystem(lambda x, u, w, t: -x + w, lambda x, v, t: x + v, [[0.1]], [[0.1]])
HIDDEN = {
    "A": {"f": lambda x, u, w, t: -x - 0.1 * x * abs(x) + w},
    "L": {"f": lambda x, u, w, t: -x + w + 0.1 * np.linalg.norm(w + 1)},
    "C": {"h": lambda x, v, t: x + 0.1 * np.sqrt(np.vecdot(x + 2, x + 2)) + v},
    "M": {"h": lambda x, v, t: x + v + 0.1 * (v + 1).real},
    "A, where it ends": {
        "f": lambda x, u, w, t: np.where(x.real < 5, 3 + 0 * x, 3 + abs(x - 5)) + w
    },
}


@pytest.mark.parametrize("case", HIDDEN)
def test_a_function_that_is_not_analytic_is_refused(case):
    system = replace(PLAIN, **HIDDEN[case])
    prior = Gaussian(np.zeros(1), np.eye(1))
    with pytest.raises(TypeError, match=r"system\.[fh] must be analytic"):
        extended_kalman_bucy(system, prior, lambda t: 8 * np.ones(1), [0.0, 3.0])


@pytest.mark.parametrize("case", ["A", "L", "C", "M"])
def test_it_is_refused_about_a_reference(case):
    system = replace(PLAIN, **HIDDEN[case])
    x = solve_ivp(
        lambda t, x: system.f(x, np.zeros(0), np.zeros(1), t),
        (0, 3),
        [2.0],
        rtol=1e-10,
        atol=1e-10,
        dense_output=True,
    ).sol
    prior = Gaussian(np.zeros(1), np.eye(1))
    with pytest.raises(TypeError, match=r"system\.[fh] must be analytic"):
        linearized_kalman_bucy(system, Reference(x), prior, lambda t: np.ones(1), [0.0, 3.0])


def test_the_inputs_jacobian_too():
    system = replace(PLAIN, f=lambda x, u, w, t: -x + w + 0.1 * abs(u) + u)
    u = lambda t: np.ones(1)  # noqa: E731
    x = solve_ivp(lambda t, x: -x + 1.1, (0, 3), [2.0], "DOP853", dense_output=True, rtol=1e-11).sol
    prior = Gaussian(np.zeros(1), np.eye(1))
    with pytest.raises(TypeError, match=r"system\.f must be analytic"):
        linearized_kalman_bucy(system, Reference(x, u), prior, lambda t: np.ones(1), [0.0, 3.0])
