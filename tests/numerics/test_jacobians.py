"""Derivatives by complex step, and what a model must have."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.numerics.complex_step import complex_step
from navfilters.numerics.jacobians import check_model, jacobian


def two_body(x, xp=np):
    """Four components of very different size, from a state in metres and metres per second."""
    r = xp.sqrt(x[0] * x[0] + x[1] * x[1])
    a = -3.986e14 / (r * r * r)
    return xp.stack([x[2] + 0 * r, a * x[0], a * x[1], xp.exp(x[3] / 1e3) * xp.sin(x[0] / 1e6)])


X = np.array([4e6, -6e6, 7.5e3, 0.3])


def test_agrees_with_forward_mode_to_rounding():
    wanted = jax.jit(jax.jacfwd(lambda x: two_body(x, jnp)))(X)
    assert_allclose(complex_step(two_body, X), wanted, rtol=4e-15, atol=0)


def test_agrees_with_the_derivative_by_hand():
    x = np.array([0.3, -2.0])
    got = complex_step(lambda x: np.stack([x[0] ** 3 * x[1], np.exp(x[0]), x[1]]), x)
    wanted = [[3 * 0.3**2 * -2, 0.3**3], [np.exp(0.3), 0], [0, 1]]
    assert_allclose(got, wanted, rtol=1e-15)


@pytest.mark.parametrize("step", [1e-100, 1e-30, 1e-10])
def test_no_step_is_too_small(step):
    assert_allclose(complex_step(two_body, X, step=step), complex_step(two_body, X), rtol=1e-14)


def test_a_difference_quotient_is_ten_million_times_worse():
    wanted = complex_step(two_body, X)[1, 0]
    h = 1e-8 * X[0] * np.eye(4)[0]
    quotient = (two_body(X + h) - two_body(X - h))[1] / (2 * h[0])
    assert 1e-9 < abs(quotient / wanted - 1) < 1e-6


def test_leading_axes_are_batch_axes():
    x = np.random.default_rng(0).normal(size=(4, 3, 2))

    def f(x):
        return np.stack([x[..., 0] * x[..., 1], np.sin(x[..., 0]), x[..., 1] ** 2], axis=-1)

    got = complex_step(f, x)
    assert got.shape == (4, 3, 3, 2)
    assert_array_equal(got[2, 1], complex_step(f, x[2, 1]))


def test_integers_are_real_numbers():
    assert_array_equal(complex_step(lambda x: x**2, [1, 2]), np.diag([2.0, 4.0]))


def test_what_is_ignored_has_a_zero_derivative():
    """A constant returns real numbers, and rightly so."""
    assert_array_equal(complex_step(lambda x: np.array([1.0, 2.0]), np.ones(3)), np.zeros((2, 3)))
    assert_array_equal(complex_step(lambda x: x[:1], np.ones(2)), [[1.0, 0.0]])


def test_an_even_function_at_its_minimum():
    assert_array_equal(complex_step(lambda x: x**2 * np.cos(x), np.zeros(1)), [[0.0]])


def bearing(x):
    return np.stack([np.arctan2(x[1], x[0])])


def distance(x):
    return np.stack([np.linalg.norm(x)])


def into_a_float_array(x):
    out = np.zeros(1)
    out[0] = x[0]
    return out


@pytest.mark.parametrize("f", [bearing, distance, into_a_float_array, lambda x: x.real])
def test_what_drops_the_imaginary_part_is_named(f):
    with pytest.raises(TypeError, match=rf"{f.__name__}.* must .*complex.*Give its Jacobian"):
        complex_step(f, np.array([3.0, 4.0]))


def test_a_name_of_the_callers_choice():
    with pytest.raises(TypeError, match=r"^system\.h must accept complex numbers"):
        complex_step(bearing, np.ones(2), name="system.h")


@pytest.mark.parametrize("x", [1.0, np.ones(2, complex), np.array(["a"])])
def test_x_is_a_real_array(x):
    with pytest.raises(ValueError, match=r"^x must be a real array \(\.\.\., n\)"):
        complex_step(np.sin, x)


def test_nan_passes():
    assert np.isnan(complex_step(lambda x: 2 * x * x, np.array([np.nan]))).all()
    assert_array_equal(complex_step(lambda x: np.array([np.nan]), np.ones(1)), [[0.0]])


@pytest.mark.parametrize("position", [0, 1, 2])
def test_in_any_argument(position):
    def f(x, w, u):
        return x * w[0] + np.sin(u) * x[0]

    at = np.array([0.5, 2.0]), np.array([3.0]), np.array([0.2, -0.7])
    got = jacobian(f, position, None, name="f")(*at)
    g = jax.jacfwd(lambda x, w, u: x * w[0] + jnp.sin(u) * x[0], position)
    wanted = jax.jit(g)(*at)
    assert_allclose(got, wanted, rtol=1e-15)


def test_a_given_jacobian_is_used():
    given = object()
    assert jacobian(np.sin, 0, given, name="f") is given


class Model:
    def __init__(self, **fields):
        self.__dict__.update({"f": np.sin, "J": None, "Q": [[1]], "R": [[1]]} | fields)


def test_check_model_makes_arrays():
    model = Model()
    check_model(model, ("f",), ("J",))
    assert model.Q.dtype == model.R.dtype == np.float64


@pytest.mark.parametrize(
    ("fields", "error", "message"),
    [
        ({"f": None}, TypeError, "f must be callable; found None"),
        ({"J": 3}, TypeError, "J must be callable; found 3"),
        ({"Q": [[1, 2], [0, 1]]}, ValueError, "Q must be symmetric"),
        ({"R": [[-1]]}, ValueError, "R must be symmetric positive semidefinite"),
        ({"R": np.ones((3, 1, 1))}, ValueError, r"R must have shape \(n, n\); found \(3, 1, 1\)"),
    ],
)
def test_check_model_refuses(fields, error, message):
    with pytest.raises(error, match=message):
        check_model(Model(**fields), ("f",), ("J",))
