"""What is not analytic is refused, and what is hard to see but is analytic is not."""

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import Gaussian
from navfilters.numerics.complex_step import complex_step
from navfilters.numerics.jacobians import around, examine, jacobian


def drag(x):
    return np.stack([x[1], -9.8 - 1e-3 * abs(x[1]) * x[1]])


def oblate(x):
    return -4e14 * x / np.sqrt(x @ x) ** 3 * (1 + 1e-3 * 6.4e6**2 / np.vecdot(x, x))


def through_a_float_array(x):
    out = np.zeros(x.shape)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", np.exceptions.ComplexWarning)
        out[...] = x
    return x + out


NOT_ANALYTIC = {
    "abs of one component": (lambda x: x[:1] + abs(x[1]), [1.0, 2.0]),
    "a small part of one component": (
        lambda x: np.stack([1e3 * x[0], x[0] + 1e-4 * abs(x[1] - 2)]),
        [1.0, 2.1],
    ),
    "a norm among sums": (lambda x: np.stack([x[0], x[0] * np.linalg.norm(x)]), [3.0, 4.0]),
    "a unit vector by vecdot": (lambda x: x / np.sqrt(np.vecdot(x, x)), [1.0, 2.0, 3.0]),
    "a gravity by vecdot, in J2 only": (oblate, [7e6, 1e5, 1e6]),
    "vdot": (lambda x: x + np.vdot(x, x), [3.0, 4.0]),
    "conj": (lambda x: x.conj() * x[0], [1.0, 2.0]),
    "real": (lambda x: x * x.real, [1.0, 2.0]),
    "drag": (drag, [100.0, -3.0]),
    "where": (lambda x: np.where(x.real > 0, x, abs(x) + x), [-1.0, 2.0]),
    "a largest element": (lambda x: x / np.max(np.abs(x)), [1.0, 2.0, 3.0]),
    "eigenvalues": (lambda x: x + np.linalg.eigvalsh(np.diag(x)), [1.0, 2.0]),
    "an array of real numbers": (through_a_float_array, [1.0, 2.0]),
    "fast": (lambda x: x * abs(np.sin(1000 * x)), [1.0, 2.0]),
    "tiny": (lambda x: x * abs(x), [1e-9, -1e-9]),
    "huge": (lambda x: x * abs(x), [1e9, -1e9]),
    "beside a large constant": (lambda x: 1e6 + x + 0.5 * abs(x), [3.0, 4.0]),
    "beside a larger constant and a larger component": (
        lambda x: 3e7 + x[:1] ** 2 + x[1:] ** 2 + 0.02 * abs(x[:1]),
        [1.0, 50.0],
    ),
    "its own rounding": (lambda x: (1 - np.cos(x)) / x**2, [1e-6]),
}


@pytest.mark.parametrize("case", NOT_ANALYTIC)
def test_what_is_not_analytic_is_refused(case):
    f, x = NOT_ANALYTIC[case]
    message = r"^it must be analytic .* component \d in column \d.*differences.*Give its Jacobian"
    with pytest.raises(TypeError, match=message):
        complex_step(f, np.array(x), name="it")


def test_the_element_is_named():
    message = (
        r"drag must be analytic .* component 1 in column 1.* is -0\.003 .* and -0\.006 by diff"
    )
    with pytest.raises(TypeError, match=message):
        complex_step(drag, np.array([100.0, -3.0]))


def test_the_member_is_named():
    x = np.ones((3, 4, 2))
    x[2, 1, 0] = -1.0

    def f(x):
        return np.where(x.real > 0, x, x * abs(x))

    complex_step(f, np.ones((3, 4, 2)))
    with pytest.raises(TypeError, match=r"component 0 in column 0.* member at index \(2, 1\)"):
        complex_step(f, x)


HARD_TO_SEE = {
    "fast": (lambda x: np.sin(1000 * x), [1.0, 0.0, 3e-5]),
    "a unit of 1e-9": (lambda x: np.sin(x / 1e-9), [0.0, 1e-9, 1e-8]),
    "drowned": (lambda x: 1e16 + np.sin(x), [1.0]),
    "nearly drowned": (lambda x: 1e9 + 1e-3 * np.sin(x), [1.0, 0.0]),
    "single precision": (
        lambda x: np.exp(x.astype(np.complex64 if np.iscomplexobj(x) else np.float32)),
        [1.0, 0.3, 10.0],
    ),
    "near a kink": (lambda x: np.where(x.real > 0, x, 2 * x), [1e-7, 1e-12, -1e-5, 1.0]),
    "at a kink": (lambda x: np.where(x.real > 0, x, 2 * x), [0.0]),
    "saturation": (lambda x: np.where(x.real > 1, 1 + 0 * x, x), [1.0, 1 - 1e-10, 1.0001]),
    "sawtooth": (lambda x: x - np.floor(x.real), [1.0, 0.5, 3 - 1e-7]),
    "wrapped": (lambda x: np.where(x.real > np.pi, x - 2 * np.pi, x), [np.pi, np.pi - 1e-8]),
    "near a pole": (lambda x: np.tan(x), [np.pi / 2 - 1e-9, 1.5707, 0.0]),
    "reciprocals": (lambda x: 1 / x, [1e-12, 1e-3, 1e12]),
    "logarithms": (lambda x: np.log(x), [1e-12, 1e-3, 1e12]),
    "roots": (lambda x: np.sqrt(x), [1e-20, 1e-3, 1e12]),
    "a step": (lambda x: np.arctan(1e8 * x), [0.0, 1e-8, 1e-7, 1.0]),
    "a steep slope": (lambda x: 1 / (1 + np.exp((1 - x) / 1e-6)), [1.0, 1 + 1e-6, 0.9999]),
    "flat": (lambda x: np.exp(-1 / x**2), [0.05, 0.1]),
    "a ninth root": (lambda x: (x - 1) ** 9, [1.0, 1.001]),
    "a height": (lambda x: np.stack([np.sqrt(x @ x) - 6.4e6, x[0] / x[2]]), [6.5e6, 10.0, 1e3]),
    "an offset taken away": (lambda x: (x + 1e12) - 1e12, [1.0, 2.0]),
    "a constant by cancellation": (lambda x: np.sin(x) ** 2 + np.cos(x) ** 2, [0.3, 7.0, 1e3]),
    "unequal sizes": (lambda x: np.stack([x[0] * np.exp(x[1] / 1e3), x[1] ** 2]), [1e-5, 1e4]),
    "zero beside seven million": (lambda x: np.stack([np.sin(x[1] / x[0]), x @ x]), [7e6, 0.0]),
}


@pytest.mark.parametrize("case", HARD_TO_SEE)
def test_what_is_analytic_is_not_refused(case):
    f, x = HARD_TO_SEE[case]
    with np.errstate(all="ignore"):
        assert np.isfinite(complex_step(f, np.array(x))).all()


def test_outside_of_the_domain_nothing_is_compared():
    def f(x):
        if np.any(x.real < 1):
            raise ValueError("too low")
        return np.log(x)

    assert_allclose(complex_step(f, np.array([1.0])), [[1.0]])


def test_values_with_two_axes():
    """A matrix of a vector, alone and for a batch."""
    x = np.random.default_rng(1).normal(size=(5, 3))

    def outer(x, unit=1.0):
        return x[..., :, None] * x[..., None, :] * unit

    got = complex_step(outer, x)
    assert got.shape == (5, 3, 3, 3)
    assert_array_equal(got[2], complex_step(outer, x[2]))
    with pytest.raises(TypeError, match=r"component \d, \d in column"):
        complex_step(lambda x: outer(x, np.linalg.norm(x)), x)


def test_only_the_first_call_looks():
    calls = []

    def f(x, k):
        calls.append(k)
        return x * x

    J = jacobian(f, 0, None, name="f")
    J(np.ones(3), 0)
    looked = len(calls)
    assert looked > 2 * 3 + 3
    J(np.ones(3), 1)
    assert len(calls) == looked + 3
    examine(J, [(np.ones(3), 2)])
    assert len(calls) == 2 * looked + 3


def test_a_given_jacobian_is_not_examined():
    examine(lambda *arguments: 1 / 0, [(1, 2)])


def test_where_to_look():
    around_it = around(Gaussian(np.zeros(2), np.diag([4.0, 0.0])))
    assert_array_equal(around_it, [[0, 0], [2, 0], [-2, 0]])
