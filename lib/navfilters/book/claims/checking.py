"""What a chapter calls: a fresh value against the ledger's entry."""

import sys
from collections.abc import Mapping
from typing import Any

from .entries import ClaimError
from .ledger import find, load
from .pages import Badge, plain
from .verdicts import derive, near


def check(claim_id: str, value: Any, *, second: Any = None) -> None:
    """Derive the verdict from a fresh value, compare it with the recorded one, show the badge.

    Parameters
    ----------
    claim_id : str
        An id in the ledger.
    value : number, list, bool, mapping, Readings, Parts or Some
        The fresh value; see ``derive``.
    second : number, list or bool, optional
        The independent second computation of a finding of the book's own.

    Raises
    ------
    ClaimError
        An unknown id; a derived verdict other than the recorded one; or a value that has drifted
        from the recorded ``ours`` by more than its tolerance.
    """
    ledger = load()
    if claim_id not in ledger:
        raise ClaimError(f"no claim {claim_id!r} in {find()}")
    claim = ledger[claim_id]
    derived = derive(claim, value, second=second)
    if derived != claim.verdict:
        raise ClaimError(
            f"{claim_id}: recorded as {claim.verdict!r}, but {plain(value)} gives {derived!r} "
            f"against the paper's {plain(claim.paper_value)}"
        )
    if not near(value, _ordered_like(value, claim.ours), claim.tolerance):
        raise ClaimError(
            f"{claim_id}: found {value!r}, recorded {claim.ours!r}, tolerance {claim.tolerance}"
        )
    _show(Badge(claim))


def _ordered_like(value: Any, recorded: Any) -> Any:
    if isinstance(value, Mapping) and isinstance(recorded, Mapping):
        if set(value) != set(recorded):
            return []
        return {key: _ordered_like(value[key], recorded[key]) for key in value}
    return recorded


def _show(badge: Badge) -> None:
    if "IPython" in sys.modules:
        from IPython import get_ipython
        from IPython.display import display

        if get_ipython() is not None:
            display(badge)
