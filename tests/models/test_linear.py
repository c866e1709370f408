"""z = H x + v: values, derivatives, batches, and what the constructor refuses."""

import numpy as np
import pytest
from naive import covariances
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.models import Linear

SHAPES = [((), ()), ((4,), ()), ((), (5,)), ((4,), (4,)), ((3, 1), (4,))]


def random(m, n, batch=()):
    rng = np.random.default_rng(m + 10 * n)
    return Linear(rng.normal(size=(*batch, m, n)), covariances(rng, (), m))


@pytest.mark.parametrize(("of_H", "of_x"), SHAPES)
@pytest.mark.parametrize(("m", "n"), [(1, 1), (2, 3), (3, 2)])
def test_h_is_the_product(of_H, of_x, m, n):
    model, x = random(m, n, of_H), np.random.default_rng(0).normal(size=(*of_x, n))
    wanted = np.einsum("...ij,...j->...i", model.H, x)
    assert_allclose(model.h(x), wanted, rtol=1e-13, atol=1e-13)
    assert model.h(x).shape == (*np.broadcast_shapes(of_H, of_x), m)


@pytest.mark.parametrize(("m", "n"), [(1, 1), (2, 3), (3, 2)])
def test_derivatives_are_h_and_zero(m, n):
    model, x = random(m, n), np.random.default_rng(0).normal(size=(4, n))
    assert_array_equal(np.broadcast_to(model.jacobian(x), (4, m, n)), np.stack([model.H] * 4))
    assert_array_equal(model.hessian(x), np.zeros((4, m, n, n)))
    for j in range(n):  # differences of a linear function are exact but for rounding
        step = np.eye(n)[j]
        difference = (model.h(x + step) - model.h(x - step)) / 2
        assert_allclose(difference, np.stack([model.H[:, j]] * 4), rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("of_x", [(), (4,), (2, 3)])
def test_derivatives_broadcast_with_the_state(of_x):
    model, x = random(2, 3), np.ones((*of_x, 3))
    assert np.broadcast_shapes(model.jacobian(x).shape, (*of_x, 2, 3)) == (*of_x, 2, 3)
    assert model.hessian(x).shape == (*of_x, 2, 3, 3)


def test_lists_are_taken_and_the_model_is_frozen():
    model = Linear([[1, 2]], [[3]])
    assert model.H.dtype == model.R.dtype == np.float64
    with pytest.raises(AttributeError, match="cannot assign"):
        model.R = np.eye(1)


REFUSED = {
    "H: a vector": ([1.0, 2.0], np.eye(2), "H must be", r"\(2,\)"),
    "H: NaN": ([[np.nan]], np.eye(1), "H must be", r"nan at index \(0, 0\)"),
    "H: complex": ([[1j]], np.eye(1), "H must be", "complex128"),
    "H: strings": ([["1"]], np.eye(1), "H must be", "<U1"),
    "H: empty": (np.ones((2, 0)), np.eye(2), "H must be", r"\(2, 0\)"),
    "R: another size": (np.ones((2, 3)), np.eye(3), r"R must have shape .*2, 2", r"\(3, 3\)"),
    "R: a number": (np.ones((1, 3)), 1.0, "R must be", r"\(\)"),
    "R: not square": (np.eye(2), np.ones((2, 3)), r"R must have shape .*2, 2", r"\(2, 3\)"),
    "R: infinite": (np.eye(1), [[np.inf]], "R must be", r"inf at index \(0, 0\)"),
    "R: asymmetric": (np.eye(2), [[1, 0.5], [0, 1]], "R must be symmetric", "difference of 0.5"),
    "R: indefinite": (np.eye(2), np.diag([1.0, -1.0]), "R must be .* positive definite", "-1"),
    "R: singular": (np.eye(2), np.ones((2, 2)), "R must be .* positive definite", "eigenvalue"),
    "R: zero": (np.eye(2), np.zeros((2, 2)), "R must be .* positive definite", "0"),
    "batches": (np.ones((2, 1, 1)), np.ones((3, 1, 1)), "must broadcast", r"H \(2,\), R \(3,\)"),
}


@pytest.mark.parametrize(("H", "R", "needed", "found"), REFUSED.values(), ids=REFUSED)
def test_the_constructor_refuses_by_name(H, R, needed, found):
    with pytest.raises(ValueError, match=f"{needed}.*found.*{found}"):
        Linear(H, R)
