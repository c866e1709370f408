"""Values are taken apart and put together again, and equal structures are equal."""

from functools import partial
from types import SimpleNamespace

import numpy as np
from numpy.testing import assert_array_equal

from navfilters import FILTERS, Gaussian, SigmaPoints
from navfilters.models import Linear, RangeBearing
from navfilters.runs.trees import flatten, unflatten

VALUES = {
    "filter": (FILTERS["EKF"], []),
    "options": (
        partial(FILTERS["B-UKF"], bump=np.ones(3), points=SigmaPoints(np.ones(3), 2.0, [0.1, 0.2])),
        ["value.points.alpha", "value.points.kappa", "value.bump"],
    ),
    "arguments": (partial(max, np.ones(2), key=np.ones(1)), ["value", "value.key"]),
    "model": (Linear(np.eye(2), np.eye(2)), ["value.H", "value.R"]),
    "pair": ((RangeBearing(np.eye(2)), None), ["value.0.R"]),
    "state": (Gaussian(np.ones(2), np.eye(2)), ["value.mean", "value.cov"]),
    "number": (1.0, []),
    "opaque": (SimpleNamespace(R=np.eye(2)), []),
}


def test_values_come_back_with_their_arrays():
    for value, names in VALUES.values():
        tree, leaves = flatten("value", value, 0)
        assert sorted(leaf.name for leaf in leaves) == sorted(names)
        assert tree.size == len(leaves)
        again = unflatten(tree, [2 * leaf.array for leaf in leaves])
        assert type(again) is type(value)
        for ours, theirs in zip(flatten("value", again, 0)[1], leaves, strict=True):
            assert_array_equal(ours.array, 2 * theirs.array)
    filter_ = unflatten(*flatten("value", VALUES["filter"][0], 0))
    assert filter_ == FILTERS["EKF"]


def test_equal_structures_are_equal_and_others_are_not():
    """What JAX compiles once: the values of arrays do not matter, all else does."""
    trees = [flatten("value", value, 0)[0] for value, _ in VALUES.values()]
    assert len(set(trees)) == len(trees)
    points = SigmaPoints(np.zeros(3) + 0.5, 2.0, [0.3, 0.4])
    same = partial(FILTERS["B-UKF"], bump=np.zeros(7), points=points)
    assert flatten("value", same, 0)[0] == trees[1]
    assert hash(flatten("value", same, 0)[0]) == hash(trees[1])
    numbers = [flatten("value", value, 0)[0] for value in (1, 1.0, True, 2)]
    assert len(set(numbers)) == 4


def test_what_has_no_hash_is_equal_to_itself_alone():
    one, two = SimpleNamespace(R=1.0), SimpleNamespace(R=1.0)
    assert one == two
    trees = [flatten("value", value, 0)[0] for value in (one, one, two)]
    assert len(set(trees)) == 2
