"""The verdict that a fresh value gives: rules that take no notice of the recorded one."""

import math
from collections.abc import Mapping
from typing import Any

from .entries import ClaimError
from .ledger import (
    ESTABLISHED,
    IN_SHAPE,
    NOT_REPRODUCED,
    REPRODUCED,
    UNDERDETERMINED,
    Claim,
)

_WORST_LAST = (REPRODUCED, IN_SHAPE, UNDERDETERMINED, NOT_REPRODUCED)


class Readings(dict[Any, Any]):
    """The values that a claim takes under different readings of a text that leaves them open.

    Where the readings do not agree on the verdict, the claim is underdetermined.
    """


class Parts(dict[Any, Any]):
    """The values of the cases, places or settings that a source claims together.

    The claim is as good as the worst of them.
    """


class Some(dict[Any, Any]):
    """The values of cases of which a source says that the thing can happen.

    The claim is as good as the best of them.
    """


def derive(claim: Claim, value: Any, *, second: Any = None) -> str:
    """The verdict that a fresh value gives.

    Parameters
    ----------
    claim : Claim
        Its paper_value and rules; the recorded verdict takes no part.
    value : number, list, bool or mapping
        The fresh value, in the claim's kind. For an order: a mapping of names to numbers, smaller
        being better. For booleans: one, or a mapping of named parts, all of which must hold. Or a
        ``Readings``, ``Parts`` or ``Some`` of such values.
    second : number, list or bool, optional
        The independent second computation of a finding of the book's own.

    Returns
    -------
    str
        One of ``VERDICTS``.

    Raises
    ------
    ClaimError
        A finding without its second computation, or whose two computations differ; several
        readings or some of several cases, where the entry does not say what is left open or that
        some are enough.
    """
    if claim.own:
        if second is None:
            raise ClaimError(f"{claim.id}: a finding of the book's own needs second=")
        if not near(value, second, claim.agreement):
            raise ClaimError(f"{claim.id}: the two computations differ: {value} and {second}")
        return ESTABLISHED
    if isinstance(value, Readings | Parts | Some):
        return _several(claim, value)
    return _RULES[claim.kind](claim, value)


def _several(claim: Claim, value: Readings | Parts | Some) -> str:
    if not value:
        raise ClaimError(f"{claim.id}: an empty {type(value).__name__}")
    verdicts = {derive(claim, part) for part in value.values()}
    if isinstance(value, Readings):
        if not claim.left_open:
            raise ClaimError(f"{claim.id}: several readings need left_open in the entry")
        return verdicts.pop() if len(verdicts) == 1 else UNDERDETERMINED
    if isinstance(value, Some):
        if claim.quantifier != "some":
            raise ClaimError(f"{claim.id}: Some needs quantifier = 'some' in the entry")
        return min(verdicts, key=_WORST_LAST.index)
    return max(verdicts, key=_WORST_LAST.index)


def _value(claim: Claim, value: Any) -> str:
    if near(value, claim.paper_value, claim.reproduced_within):
        return REPRODUCED
    if claim.shape_rule and near(value, claim.paper_value, claim.shape_rule):
        return IN_SHAPE
    return NOT_REPRODUCED


def _bound(claim: Claim, value: Any) -> str:
    if _within(value, claim.paper_value):
        return REPRODUCED
    if claim.shape_rule and _within(value, claim.shape_rule):
        return IN_SHAPE
    return NOT_REPRODUCED


def _order(claim: Claim, value: Mapping[str, Any]) -> str:
    names = claim.paper_value
    if set(value) != set(names):
        raise ClaimError(f"{claim.id}: the order is of {names}; found values for {list(value)}")
    pairs = [(a, b) for i, a in enumerate(names) for b in names[i + 1 :]]
    if any(math.isnan(x) for x in numbers(value)):
        return NOT_REPRODUCED
    swaps = sum(not value[a] < value[b] for a, b in pairs)
    if swaps == 0:
        return REPRODUCED
    if claim.shape_rule and swaps <= claim.shape_rule["swaps"]:
        return IN_SHAPE
    return NOT_REPRODUCED


def _boolean(claim: Claim, value: Any) -> str:
    parts = list(value.values()) if isinstance(value, Mapping) else [value]
    holds = bool(parts) and all(part == claim.paper_value for part in parts)
    return REPRODUCED if holds else NOT_REPRODUCED


_RULES = {"value": _value, "bound": _bound, "order": _order, "boolean": _boolean}


def numbers(value: Any) -> list[float]:
    """Every number of a value, in order."""
    if isinstance(value, Mapping):
        return [x for key in value for x in numbers(value[key])]
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [x for item in value for x in numbers(item)]
    return [float(value)]


def near(value: Any, target: Any, rule: Mapping[str, Any] | None) -> bool:
    """Whether every number of value is within the rule of its counterpart."""
    rule = rule or {}
    found, wanted = numbers(value), numbers(target)
    if len(found) != len(wanted):
        return False
    return all(_near_one(a, b, rule) for a, b in zip(found, wanted, strict=True))


def _near_one(a: float, b: float, rule: Mapping[str, Any]) -> bool:
    if "factor" in rule:
        return b != 0 and 1 / rule["factor"] <= a / b <= rule["factor"]
    return abs(a - b) <= rule.get("abs", 0.0) + rule.get("rel", 0.0) * abs(b)


def _within(value: Any, bound: Mapping[str, Any]) -> bool:
    low, high = bound.get("at_least", -math.inf), bound.get("at_most", math.inf)
    found = numbers(value)
    return bool(found) and all(low <= x <= high for x in found)
