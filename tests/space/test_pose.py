"""Position, velocity and attitude: an error and the state it leads to undo each other."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.space.pose import difference, retract
from navfilters.space.quaternions import matrix

part = st.floats(-1, 1)
threes = st.tuples(part, part, part).map(np.array)
quaternions = (
    st.tuples(part, part, part, part)
    .filter(lambda q: sum(x * x for x in q) > 1e-3)
    .map(lambda q: np.array(q) / np.linalg.norm(q))
)
poses = st.tuples(threes, threes, quaternions).map(np.concatenate)
errors = st.tuples(threes, threes, threes).map(np.concatenate)  # turns of at most sqrt(3)


def turned(x):
    return matrix(x[..., 6:])


@given(poses, errors)
def test_the_difference_of_a_retraction_is_its_error(x, dx):
    assert_allclose(difference(retract(x, dx), x), dx, rtol=0, atol=1e-12)


@given(poses, poses)
def test_the_retraction_by_a_difference_is_the_other_state(x, y):
    back = retract(y, difference(x, y))
    assert_allclose(back[:6], x[:6], rtol=0, atol=1e-12)
    assert_allclose(turned(back), turned(x), rtol=0, atol=1e-12)
    assert_allclose(np.linalg.norm(back[6:]), 1, rtol=1e-14)


@given(poses)
def test_no_error_leads_nowhere(x):
    assert_allclose(retract(x, np.zeros(9)), x, rtol=0, atol=1e-15)
    other = np.concatenate([x[:6], -x[6:]])
    assert_allclose(difference(other, x), np.zeros(9), rtol=0, atol=1e-15)


def test_the_rotation_is_multiplied_from_the_left():
    """Its axes are those after the rotation by q: a quarter about z, then a little about x."""
    x = np.array([0.0, 0, 0, 0, 0, 0, 0, 0, np.sqrt(0.5), np.sqrt(0.5)])
    dx = np.array([1.0, 2, 3, 4, 5, 6, 1e-8, 0, 0])
    after = retract(x, dx)
    assert_array_equal(after[:6], dx[:6])
    small = np.array([[1.0, 0, 0], [0, 1, 1e-8], [0, -1e-8, 1]])
    assert_allclose(turned(after), small @ turned(x), rtol=0, atol=1e-15)


@pytest.mark.parametrize("engine", [np.asarray, jnp.asarray], ids=["NumPy", "JAX"])
def test_batch_axes_broadcast_in_both_engines(engine):
    rng = np.random.default_rng(2)
    x, dx = rng.normal(size=(3, 1, 10)), rng.normal(size=(4, 9))
    x[..., 6:] /= np.linalg.norm(x[..., 6:], axis=-1, keepdims=True)
    after = retract(engine(x), engine(dx))
    assert isinstance(after, jax.Array) == (engine is jnp.asarray)
    assert after.shape == (3, 4, 10)
    for i, j in np.ndindex(3, 4):
        assert_allclose(after[i, j], retract(x[i, 0], dx[j]), rtol=1e-14, atol=1e-15)
    back = difference(after, engine(x))
    wanted = np.broadcast_to(dx, (3, 4, 9))
    assert_allclose(back[..., :6], wanted[..., :6], rtol=0, atol=1e-12)
    few = np.linalg.norm(dx[:, 6:], axis=-1) < np.pi
    assert few.sum() > 1
    assert_allclose(back[:, few], wanted[:, few], rtol=0, atol=1e-12)
