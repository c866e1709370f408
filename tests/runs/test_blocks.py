"""Blocks of members, which the compiled engine takes one after the other."""

import jax
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from navfilters.runs.compiled import BLOCK, _join, _split


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_block_is_neighbours_and_blocks_join_to_what_was_split(axis):
    shape = [2, 3, 4]
    shape[axis] = 3 * BLOCK
    array = np.arange(np.prod(shape)).reshape(shape)
    blocks = _split(jax.numpy.asarray(array), axis)
    for got, wanted in zip(blocks, np.split(array, 3, axis), strict=True):
        assert_array_equal(got, wanted)
    assert_array_equal(_join(blocks, axis), array)
