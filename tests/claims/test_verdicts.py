"""The ledger's rules: which verdict a value gives, whatever is recorded."""

import math

import numpy as np
import pytest
from entries import finding, make

from navfilters.book.claims import (
    ESTABLISHED,
    IN_SHAPE,
    NOT_REPRODUCED,
    REPRODUCED,
    UNDERDETERMINED,
    Claim,
    ClaimError,
    Parts,
    Readings,
    Some,
    derive,
)

# --- values -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rule", "inside", "outside"),
    [
        ({"abs": 0}, [10.0], [10.000001, 9.999999]),
        ({"abs": 0.5}, [9.5, 10.5], [9.49, 10.51]),
        ({"rel": 0.1}, [9.0, 11.0], [8.99, 11.01]),
        ({"abs": 0.5, "rel": 0.1}, [8.5, 11.5], [8.49, 11.51]),
        ({"factor": 2}, [5.0, 20.0], [4.99, 20.01, -10.0, 0.0]),
    ],
)
def test_value_within_its_rule(rule, inside, outside):
    strict = make(reproduced_within=rule)
    loose = make(shape_rule=rule, own_rule="A test.")
    for value in inside:
        assert derive(strict, value) == REPRODUCED
        assert derive(loose, value) == (REPRODUCED if value == 10 else IN_SHAPE)
    for value in outside:
        assert derive(strict, value) == derive(loose, value) == NOT_REPRODUCED


def test_rel_and_factor_take_the_papers_value_as_their_measure():
    assert derive(make(paper_value=-10.0, reproduced_within={"rel": 0.1}), -11.0) == REPRODUCED
    assert derive(make(paper_value=-10.0, reproduced_within={"factor": 2}), -20.0) == REPRODUCED


def test_a_factor_between_tiny_numbers():
    """Their product is zero in floating point."""
    assert derive(make(paper_value=1e-200, reproduced_within={"factor": 2}), 2e-200) == REPRODUCED


@pytest.mark.parametrize("value", [[1.0, 2.0], (1, 2), np.array([1, 2]), [np.float64(1), 2]])
def test_value_of_several_numbers(value):
    claim = make(paper_value=[1.0, 2.05], reproduced_within={"abs": 0.1})
    assert derive(claim, value) == REPRODUCED
    assert derive(claim, [1.0, 2.2]) == NOT_REPRODUCED
    assert derive(claim, [1.0, 2.0, 3.0]) == derive(claim, 1.0) == NOT_REPRODUCED


# --- bounds -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("bound", "inside", "outside"),
    [
        ({"at_most": 1}, [1, -5, [0.5, 1.0]], [1.001, [0.5, 2.0]]),
        ({"at_least": 1}, [1, 5, np.array([1, 2])], [0.999, [0.5, 2.0]]),
        ({"at_least": 1, "at_most": 2}, [1, 2], [0.9, 2.1]),
    ],
)
def test_bound(bound, inside, outside):
    for value in inside:
        assert derive(make("bound", paper_value=bound), value) == REPRODUCED
    for value in outside:
        assert derive(make("bound", paper_value=bound), value) == NOT_REPRODUCED


def test_bound_in_shape():
    claim = make("bound", shape_rule={"at_most": 2.0})
    assert [derive(claim, x) for x in (1, 2, 3)] == [REPRODUCED, IN_SHAPE, NOT_REPRODUCED]


# --- orders and booleans ------------------------------------------------------------------------


def test_order_is_from_the_smallest_whatever_the_mappings_order():
    assert derive(make("order"), {"c": 3, "a": 1, "b": 2}) == REPRODUCED
    assert derive(make("order"), {"a": 1, "b": 1, "c": 3}) == NOT_REPRODUCED


@pytest.mark.parametrize(
    ("values", "swaps"), [((1, 2, 3), 0), ((2, 1, 3), 1), ((3, 1, 2), 2), ((3, 2, 1), 3)]
)
def test_order_in_shape_allows_swaps_of_neighbours(values, swaps):
    found = dict(zip("abc", values, strict=True))
    for allowed in (1, 2, 3):
        wanted = IN_SHAPE if swaps <= allowed else NOT_REPRODUCED
        claim = make("order", shape_rule={"swaps": allowed})
        assert derive(claim, found) == (wanted if swaps else REPRODUCED)


@pytest.mark.parametrize("names", ["ab", "abcd", "abx"])
def test_order_of_other_names_is_refused(names):
    with pytest.raises(ClaimError, match="some-claim"):
        derive(make("order"), dict.fromkeys(names, 1))


@pytest.mark.parametrize("truth", [True, False])
def test_boolean(truth):
    claim = make("boolean", paper_value=truth)
    for kind in (bool, np.bool_):
        assert derive(claim, kind(truth)) == REPRODUCED
        assert derive(claim, kind(not truth)) == NOT_REPRODUCED
    assert derive(claim, {"x": truth, "y": truth}) == REPRODUCED
    assert derive(claim, {"x": truth, "y": not truth}) == NOT_REPRODUCED


def test_a_conjunction_of_nothing_does_not_hold():
    assert derive(make("boolean"), {}) == NOT_REPRODUCED


# --- NaN ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("claim", "value"),
    [
        (make(reproduced_within={"abs": 1e9}, shape_rule={"factor": 2}), math.nan),
        (make(reproduced_within={"factor": 1e9}), math.nan),
        (make(reproduced_within={"abs": math.inf}), math.nan),
        (make(paper_value=[1.0, 2.0], reproduced_within={"abs": 9}), [1.0, math.nan]),
        (make("bound", shape_rule={"at_most": 9}), math.nan),
        (make("bound", paper_value={"at_least": 0}), [1.0, math.nan]),
        (make("order"), {"a": 1, "b": 2, "c": math.nan}),
        (make("order", shape_rule={"swaps": 3}), {"a": 1, "b": 2, "c": math.nan}),
        (make("boolean"), math.nan),
        (make("boolean"), {"x": True, "y": math.nan}),
    ],
    ids=lambda x: x.kind if isinstance(x, Claim) else str(x),
)
def test_nan_reproduces_nothing(claim, value):
    assert derive(claim, value) == NOT_REPRODUCED


def test_nan_agrees_with_nothing():
    with pytest.raises(ClaimError, match="differ"):
        derive(finding(agreement={"abs": 1e9}), math.nan, second=math.nan)


# --- several values and findings -----------------------------------------------------------------


@pytest.mark.parametrize(
    ("values", "verdict"),
    [
        ((10, 10), REPRODUCED),
        ((11, 9), IN_SHAPE),
        ((99, 77), NOT_REPRODUCED),
        ((10, 11), UNDERDETERMINED),
        ((10, 99), UNDERDETERMINED),
    ],
)
def test_readings_share_a_verdict_or_leave_it_open(values, verdict):
    claim = make(shape_rule={"abs": 1}, own_rule="A test.", left_open="The unit.")
    assert derive(claim, Readings(zip("xy", values, strict=True))) == verdict


@pytest.mark.parametrize(
    ("values", "worst", "best"),
    [
        ((10, 10), REPRODUCED, REPRODUCED),
        ((10, 11), IN_SHAPE, REPRODUCED),
        ((11, 99), NOT_REPRODUCED, IN_SHAPE),
        ((99, 10), NOT_REPRODUCED, REPRODUCED),
    ],
)
def test_parts_are_as_good_as_the_worst_and_some_as_the_best(values, worst, best):
    claim = make(shape_rule={"abs": 1}, own_rule="A test.", quantifier="some")
    named = dict(zip("xy", values, strict=True))
    assert derive(claim, Parts(named)) == worst
    assert derive(claim, Some(named)) == best


def test_parts_of_readings_and_of_orders():
    claim = make("order", left_open="The unit.")
    right, wrong = {"a": 1, "b": 2, "c": 3}, {"a": 3, "b": 2, "c": 1}
    open_part = Readings(x=right, y=wrong)
    assert derive(claim, Parts(p=right, q=open_part)) == UNDERDETERMINED
    assert derive(claim, Parts(p=wrong, q=open_part)) == NOT_REPRODUCED
    assert derive(claim, Readings(x=Parts(p=right), y=Parts(p=right, q=right))) == REPRODUCED


@pytest.mark.parametrize(
    ("several", "message"),
    [
        (Readings(x=10, y=10), "left_open"),
        (Some(x=10), "quantifier"),
        (Parts(), "empty Parts"),
        (Parts(x=Readings(y=10)), "left_open"),
    ],
)
def test_several_values_need_an_entry_that_says_why(several, message):
    with pytest.raises(ClaimError, match=f"some-claim: .*{message}"):
        derive(make(), several)


def test_a_finding_needs_its_second_computation_and_their_agreement():
    assert derive(finding(), 1000.0, second=1000.9) == ESTABLISHED
    assert derive(finding(), [1.0, 2.0], second=np.array([1.0, 2.0])) == ESTABLISHED
    with pytest.raises(ClaimError, match="needs second"):
        derive(finding(), 1000.0)
    for second in (1002.0, [1000.0, 1000.0]):
        with pytest.raises(ClaimError, match="differ"):
            derive(finding(), 1000.0, second=second)
