"""Nudges: one unit in the last place, the same for the same input, and nothing else."""

import ast

import last_bits
import numpy as np
import pytest
from numpy.testing import assert_array_equal


def units(moved, values):
    """By how many units in the last place numbers moved."""
    return np.round((moved - values) / np.spacing(np.abs(values)))


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_every_number_moves_by_at_most_one_unit_and_some_to_each_side(kind):
    values = np.random.default_rng(3).uniform(1.1, 1.9, (40, 50)).astype(kind)
    moved = last_bits.nudged(values, 7)
    assert moved.dtype == kind
    assert set(np.unique(units(moved, values))) == {-1, 0, 1}


def test_the_same_input_moves_alike_and_another_seed_moves_it_otherwise():
    values = np.random.default_rng(3).standard_normal(100)
    assert_array_equal(last_bits.nudged(values, 1), last_bits.nudged(values.copy(), 1))
    assert not np.array_equal(last_bits.nudged(values, 1), last_bits.nudged(values, 2))


def test_zeros_integers_and_truths_stay():
    assert_array_equal(last_bits.nudged(np.zeros(9), 1), np.zeros(9))
    for values in (np.arange(9), np.ones(9, bool), "text", 3):
        assert last_bits.nudged(values, 1) is values
    assert isinstance(last_bits.nudged(0.3, 1), float)


def test_a_covariance_stays_symmetric():
    root = np.random.default_rng(0).standard_normal((5, 4, 4))
    cov = root @ root.swapaxes(-1, -2)
    cov = (cov + cov.swapaxes(-1, -2)) / 2
    moved = last_bits.nudged_covariance(cov, 5)
    assert_array_equal(moved, moved.swapaxes(-1, -2))
    assert not np.array_equal(moved, cov)


def test_only_numbers_with_a_point_inside_arrays_are_inputs():
    source = "a = np.array([0.3, 2]); b = f(0.3); c = [0.3]"
    for seed in range(9):
        tree = ast.fix_missing_locations(last_bits.Literals(seed).visit(ast.parse(source)))
        inside, called, listed = (ast.unparse(node.value) for node in tree.body)
        assert (called, listed) == ("f(0.3)", "[0.3]")
        first, second = ast.literal_eval(inside.removeprefix("np.array(").removesuffix(")"))
        assert second == 2
        assert abs(first - 0.3) <= np.spacing(0.3)


def test_draws_of_a_nudging_generator():
    plain = np.random.default_rng(5).standard_normal(1000)
    moved = last_bits.make_generator(1)(np.random.PCG64(5)).standard_normal(1000)
    assert set(np.unique(units(moved, plain))) <= {-1, 0, 1, -2, 2}
    assert not np.array_equal(moved, plain)
