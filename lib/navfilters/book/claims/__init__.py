"""The ledger: every claim of every source, and whether it held.

``book/claims.toml`` holds one entry per claim. A chapter computes a value and calls
``claims.check("claim-id", value)`` under its figure. The verdict is *derived* from the fresh value,
and a recorded verdict that the fresh value does not give is an error: the notebook stops, and with
it the build. The badge that appears shows the ledger's numbers, which the fresh ones were just
found to equal.
"""

from .checking import check
from .entries import ClaimError
from .essay import omissions, told, verdicts_of
from .ledger import (
    ESTABLISHED,
    IN_SHAPE,
    KINDS,
    NOT_REPRODUCED,
    REPRODUCED,
    UNDERDETERMINED,
    VERDICTS,
    Claim,
    Word,
    find,
    load,
    load_words,
)
from .pages import Badge, Page, rules, summary
from .scorecard import bars, database, scorecard
from .statements import Statement, load_statements, statements
from .verdicts import Parts, Readings, Some, derive

__all__ = [
    "ESTABLISHED",
    "IN_SHAPE",
    "KINDS",
    "NOT_REPRODUCED",
    "REPRODUCED",
    "UNDERDETERMINED",
    "VERDICTS",
    "Badge",
    "Claim",
    "ClaimError",
    "Page",
    "Parts",
    "Readings",
    "Some",
    "Statement",
    "Word",
    "bars",
    "check",
    "database",
    "derive",
    "find",
    "load",
    "load_statements",
    "load_words",
    "omissions",
    "rules",
    "scorecard",
    "statements",
    "summary",
    "told",
    "verdicts_of",
]
