"""Formulas that are computed in floats for one member: same bits, fewer calls."""

from functools import partial
from inspect import signature

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from navfilters.numerics.analytic import atan2, hypot
from navfilters.numerics.in_floats import POINTS, in_floats
from navfilters.numerics.small_matrices import matmul, matrix, outer_sum, right_divide, vector


def gain_and_rest(P, S, H):
    """All that stands between matrices."""
    K = right_divide(matmul(P, H.mT), S)
    rest = P.__array_namespace__().eye(2) - matmul(K, H)
    return K, (rest + rest.mT) / 2 - 0.1 * P


def turned(x):
    """What models take."""
    r, angle = hypot(x[..., 0], x[..., 1]), atan2(x[..., 1], x[..., 0])
    return vector([-r, 3 - x.__array_namespace__().ceil(angle)]), matrix([[1 / r, r], [r, angle]])


def spread(d, weight):
    return weight * outer_sum(d[1:], d[1:]) + outer_sum(d[:1], d[:1])


FORMULAS = [
    (gain_and_rest, ((2, 2), (2, 2), (2, 2)), 2),
    (gain_and_rest, ((2, 2), (1, 1), (1, 2)), 2),
    (turned, ((2,),), 2),
    (spread, ((POINTS, 2), (1, 1)), POINTS),
    (spread, ((3, 1), (1, 1)), POINTS),
]


def watched(formula):
    """A formula of as many arrays, and the types of the elements that it was given."""
    seen = []

    def followed(*arrays):
        seen.append(arrays[0].dtype.char)
        return formula(*arrays)

    followed.__signature__ = signature(formula)
    return followed, seen


@pytest.mark.parametrize(("formula", "shapes", "longest"), FORMULAS)
def test_one_member_has_the_bits_that_numpy_gives(formula, shapes, longest):
    """The formula is followed once, with symbols, and never given the numbers."""
    rng = np.random.default_rng(0)
    followed, seen = watched(formula)
    fast = in_floats(followed, longest=longest)
    for _ in range(100):
        arrays = [rng.normal(size=shape) for shape in shapes]
        for got, wanted in zip(_all(fast(*arrays)), _all(formula(*arrays)), strict=True):
            assert type(got) is np.ndarray
            assert got.dtype == wanted.dtype
            assert_array_equal(got, wanted, strict=True)
            got[...] = 0  # it may be written to
    assert seen == ["O"]


def _all(found):
    return found if isinstance(found, tuple) else (found,)


@pytest.mark.parametrize("members", [(1,), (2,), (3,), (2, 1)])
def test_members_have_the_bits_that_they_have_alone(members):
    rng = np.random.default_rng(1)
    P, S, H = rng.normal(size=(3, *members, 2, 2))
    followed, seen = watched(gain_and_rest)
    together = in_floats(followed)(P, S, H)
    assert seen == ["O" if members in [(1,), (2,)] else "d"]
    for i in np.ndindex(members):
        for one, all_of_them in zip(
            in_floats(gain_and_rest)(P[i], S[i], H[i]), together, strict=True
        ):
            assert_array_equal(one, all_of_them[i])


def test_what_floats_refuse_is_left_to_the_formula():
    """A quotient by zero is infinite or NaN, with NumPy's warning."""
    fast = in_floats(lambda a, b: a / b)
    with pytest.warns(RuntimeWarning, match="divide by zero"):
        assert_array_equal(fast(np.array([1.0, -1.0]), np.array([0.0, 2.0])), [np.inf, -0.5])
    assert_array_equal(fast(np.array([1.0, 1.0]), np.array([4.0, 2.0])), [0.25, 0.5])


@pytest.mark.parametrize(
    "x",
    [
        np.ones(2, complex),
        np.ones(2, np.float32),
        np.ones(2, int),
        np.ones(2, ">f8"),
        np.ones((2, 2)).view(np.matrix),
        np.ones(3),
        np.ones((3, 2)),
        np.ones((2, 2, 2, 2)),
        np.ones(()),
        np.ones(0),
        np.float64(1),
    ],
    ids=repr,
)
def test_anything_else_goes_through_the_formula(x):
    followed, seen = watched(lambda x: x + x)
    got = in_floats(followed)(x)
    assert seen == [x.dtype.char]
    assert_array_equal(got, x + x, strict=True)


def test_shapes_are_followed_one_by_one():
    """Every shape has its own plan, and keeps it."""
    followed, seen = watched(lambda x: 2 * x)
    fast = in_floats(followed)
    for shape in [(1,), (2,), (1, 2), (2, 1), (2, 2), (1,), (2, 2)]:
        assert fast(np.ones(shape)).shape == shape
    assert len(seen) == 5


def test_points_are_longer_than_matrices():
    """Three by three is left to BLAS; five points of two are not."""
    for longest, char in ((2, "d"), (POINTS, "O")):
        followed, seen = watched(lambda d: 2 * d)
        in_floats(followed, longest=longest)(np.ones((POINTS, 2)))
        assert seen == [char]
    followed, seen = watched(lambda d: 2 * d)
    partial(in_floats, longest=POINTS)(followed)(np.ones((3, 3)))
    assert seen == ["d"]
