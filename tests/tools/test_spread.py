"""Spreads: what moved, rounded upwards, and what then is wrong with a claim."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest
import spread
from hypothesis import given
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parent.parent / "claims"))
from entries import make

from navfilters.book.claims import NOT_REPRODUCED


@given(st.floats(1e-300, 1e300))
def test_two_digits_upwards(x):
    up = spread.upwards(x)
    assert x * (1 - 1e-11) <= up <= x * 1.11
    assert float(f"{up:.2g}") == up


def test_upwards_of_what_has_no_digits():
    assert spread.upwards(0.0) == 0.0
    assert math.isnan(spread.upwards(math.nan))
    assert spread.upwards(math.inf) == math.inf


def test_spread_is_the_largest_difference_of_each_number():
    assert spread.spread_of([1.0, 5.0], [[1.0, 5.5], [0.75, 5.0]]) == [0.25, 0.5]
    assert spread.spread_of([1.0], []) == [0.0]
    with pytest.raises(ValueError, match="argument"):
        spread.spread_of([1.0, 2.0], [[1.0]])


@pytest.mark.parametrize(
    ("tolerance", "moved", "holds"),
    [
        ({"abs": 0.3}, [0.09, 0.09], True),
        ({"abs": 0.3}, [0.1, 0.11], False),
        ({"rel": 0.3}, [0.09, 0.89], True),
        ({"rel": 0.3}, [0.2, 0.0], False),
        (None, [0.0, 0.0], True),
        (None, [0.0, 1e-300], False),
        ({"abs": 1e9}, [math.nan, 0.0], False),
        ({"abs": 9}, [0.1], False),
    ],
)
def test_a_tolerance_below_three_spreads_is_a_fault(tolerance, moved, holds):
    claim = make(ours=[1.0, 9.0], tolerance=tolerance)
    assert (spread.faults(claim, moved, [NOT_REPRODUCED]) == []) is holds


def test_another_verdict_anywhere_is_a_fault():
    claim = make(ours=1.0)
    found = spread.faults(claim, [0.0], ["reproduced", NOT_REPRODUCED])
    assert found == ["verdict 'reproduced'"]


def test_nan_in_a_run_is_not_taken_for_no_difference():
    assert np.isnan(spread.spread_of([1.0], [[math.nan]])[0])
