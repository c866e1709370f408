"""Shuster's quaternions beside SciPy's, which are Hamilton's and active."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from navfilters.space.quaternions import (
    conjugate,
    cross_matrix,
    from_rotation_vector,
    matrix,
    normalized,
    product,
    rotation_vector,
)

part = st.floats(-1, 1)
quaternions = (
    st.tuples(part, part, part, part)
    .filter(lambda q: sum(x * x for x in q) > 1e-3)
    .map(lambda q: np.array(q) / np.linalg.norm(q))
)
vectors = st.tuples(part, part, part).map(np.array)


def test_a_quarter_turn_moves_the_axes_and_not_the_vector():
    """By a right-handed quarter turn about z the new x axis is the old y axis."""
    q = from_rotation_vector(np.array([0.0, 0.0, np.pi / 2]))
    assert_allclose(q, [0, 0, np.sqrt(0.5), np.sqrt(0.5)], atol=1e-16)
    old_y = np.array([0.0, 1.0, 0.0])
    assert_allclose(matrix(q) @ old_y, [1, 0, 0], atol=1e-15)  # passive: it is the new x
    assert_allclose(Rotation.from_quat(q).apply(old_y), [-1, 0, 0], atol=1e-15)  # active


@given(quaternions)
def test_the_matrix_is_the_transpose_of_scipys(q):
    assert_allclose(matrix(q), Rotation.from_quat(q).as_matrix().T, rtol=0, atol=1e-14)


@given(quaternions, quaternions)
def test_the_product_is_scipys_with_operands_exchanged(p, q):
    got = product(p, q)
    hamilton = (Rotation.from_quat(q) * Rotation.from_quat(p)).as_quat()
    assert_allclose(got * np.sign(got @ hamilton), hamilton, rtol=0, atol=1e-14)
    assert_allclose(matrix(got), matrix(p) @ matrix(q), rtol=0, atol=1e-14)


@given(quaternions, quaternions, quaternions)
def test_quaternions_are_a_group(p, q, s):
    assert_allclose(product(product(p, q), s), product(p, product(q, s)), rtol=0, atol=1e-14)
    assert_allclose(product(p, conjugate(p)), [0, 0, 0, 1], rtol=0, atol=1e-14)
    assert_array_equal(product(p, np.array([0.0, 0, 0, 1])), p)


def test_product_and_matrix_are_equations_5_and_6():
    rng = np.random.default_rng(0)
    for p, q in rng.normal(size=(5, 2, 4)):
        pv, ps, qv, qs = p[:3], p[3], q[:3], q[3]
        wanted = [*(ps * qv + qs * pv - np.cross(pv, qv)), ps * qs - pv @ qv]
        assert_allclose(product(p, q), wanted, rtol=0, atol=1e-14)
        square = (qs**2 - qv @ qv) * np.eye(3) + 2 * np.outer(qv, qv)
        assert_allclose(matrix(q), square - 2 * qs * cross_matrix(qv), rtol=0, atol=1e-14)
        assert_allclose(cross_matrix(pv) @ qv, np.cross(pv, qv), rtol=0, atol=1e-15)


@given(vectors, st.floats(-320, 0.49))
def test_rotation_vectors_there_and_back_at_any_size(direction, exponent):
    """From the smallest number to nearly pi, each component to rounding."""
    theta = 10.0**exponent * direction / max(np.linalg.norm(direction), 1.0)
    q = from_rotation_vector(theta)
    assert_allclose(np.linalg.norm(q), 1, rtol=1e-15)
    assert_allclose(rotation_vector(q), theta, rtol=1e-14, atol=1e-322)
    assert_array_equal(rotation_vector(-q), rotation_vector(q))
    assert_allclose(q, Rotation.from_rotvec(theta).as_quat(), rtol=0, atol=1e-15)


@pytest.mark.parametrize("size", [0.0, 1e-200, 1e-30, 1e-12, 1e-7, 1e-4, 0.1, 3.0])
def test_equation_37_in_fifty_digits(size):
    theta = size * np.array([0.6, -0.48, 0.64])
    with mp.workdps(50):
        angle = mp.sqrt(sum(mpf(x) ** 2 for x in theta))
        ratio = mp.sin(angle / 2) / angle if angle else mpf(1) / 2
        vector, scalar = [float(ratio * mpf(x)) for x in theta], float(mp.cos(angle / 2))
    got = from_rotation_vector(theta)
    assert_allclose(got[:3], vector, rtol=1e-15)
    assert_allclose(got[3], scalar, rtol=0, atol=2e-16)


def test_no_rotation_is_the_identity_exactly():
    assert_array_equal(from_rotation_vector(np.zeros(3)), [0, 0, 0, 1])
    assert_array_equal(rotation_vector(np.array([0.0, 0, 0, 1])), [0, 0, 0])
    assert_array_equal(rotation_vector(np.array([0.0, 0, 0, -1])), [0, 0, 0])


def test_half_a_turn():
    axis = np.array([0.6, 0.0, -0.8])
    got = rotation_vector(np.array([*axis, 0.0]))
    assert_allclose(np.linalg.norm(got), np.pi)
    assert_allclose(np.abs(got), np.pi * np.abs(axis))


def test_small_rotations_are_equation_25():
    """T(dq) = I - [theta x], off by theta^2 / 2."""
    theta = np.array([2e-4, -1e-4, 3e-4])
    difference = matrix(from_rotation_vector(theta)) - (np.eye(3) - cross_matrix(theta))
    assert np.abs(difference).max() < theta @ theta / 2
    assert_allclose(difference, cross_matrix(theta) @ cross_matrix(theta) / 2, atol=1e-11)


def test_normalized():
    q = np.array([[1.0, 2, 3, 4], [0, 0, 0, 1e-3]])
    assert_allclose(np.linalg.norm(normalized(q), axis=-1), 1)
    assert_allclose(normalized(q)[0] / q[0], 30**-0.5)


@pytest.mark.parametrize("batch", [(), (1,), (4,), (2, 3), (0,)])
def test_batch_axes_come_first_and_members_do_not_meet(batch):
    rng = np.random.default_rng(1)
    p, q = normalized(rng.normal(size=(2, *batch, 4)))
    theta = rng.normal(size=(*batch, 3))
    whole = [f(q) for f in (conjugate, normalized, matrix, rotation_vector)]
    whole += [product(p, q), from_rotation_vector(theta), cross_matrix(theta)]
    for i in np.ndindex(batch):
        alone = [f(q[i]) for f in (conjugate, normalized, matrix, rotation_vector)]
        alone += [product(p[i], q[i]), from_rotation_vector(theta[i]), cross_matrix(theta[i])]
        for got, wanted in zip(whole, alone, strict=True):
            assert_array_equal(got[i], wanted)


def test_a_member_that_fails_stays_alone():
    theta = np.array([[0.1, 0.2, 0.3], [np.nan, 0.0, 0.0], [0.0, 0.0, 0.0]])
    q = from_rotation_vector(theta)
    assert np.isnan(q[1]).any()
    assert np.isnan(rotation_vector(q)[1]).any()
    assert_allclose(rotation_vector(q)[[0, 2]], theta[[0, 2]], rtol=1e-15)


@pytest.mark.parametrize("outer", [jax.jacfwd, jax.jacrev])
@pytest.mark.parametrize("inner", [jax.jacfwd, jax.jacrev])
def test_derivatives_under_jax_where_nothing_turns(inner, outer):
    """dq = (theta / 2, 1 - theta' theta / 8) and theta = 2 v to second order."""

    def of_vector_part(v):
        return rotation_vector(jnp.concat([v, jnp.ones(1)]))

    def derivatives(f):
        first = inner(f)
        return [jax.jit(df)(jnp.zeros(3)) for df in (first, outer(first))]

    there, back = derivatives(from_rotation_vector), derivatives(of_vector_part)
    second = np.zeros((4, 3, 3))
    second[3] = -np.eye(3) / 4
    assert_array_equal(there[0], np.eye(4, 3) / 2)
    assert_array_equal(there[1], second)
    assert_array_equal(back[0], 2 * np.eye(3))
    assert_array_equal(back[1], np.zeros((3, 3, 3)))


def test_the_same_source_compiles_under_jax():
    rng = np.random.default_rng(2)
    q, theta = normalized(rng.normal(size=(5, 4))), rng.normal(size=(5, 3))

    @jax.jit
    def composed(q, theta):
        return matrix(normalized(product(from_rotation_vector(theta), q))), rotation_vector(q)

    got = composed(jnp.asarray(q), jnp.asarray(theta))
    assert_allclose(got[0], matrix(product(from_rotation_vector(theta), q)), atol=1e-15)
    assert_allclose(got[1], rotation_vector(q), atol=1e-15)
