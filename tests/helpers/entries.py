"""Entries of a ledger that the tests change."""

from navfilters.book.claims import ESTABLISHED, NOT_REPRODUCED, Claim

PAPER = {"value": 10.0, "bound": {"at_most": 1.0}, "order": ["a", "b", "c"], "boolean": True}


def make(kind="value", **changes):
    """A claim of the kind, with the strictest rules."""
    fields = {
        "id": "some-claim",
        "chapter": "part/chapter",
        "source": "someone1999, Fig. 1",
        "statement": "It holds.",
        "kind": kind,
        "ours": 0,
        "verdict": NOT_REPRODUCED,
        "paper_value": PAPER.get(kind),
        "reason": "Because.",
        "threshold": "printed",
    }
    if kind == "value":
        fields["reproduced_within"] = {"abs": 0.0}
    return Claim(**{**fields, **changes})


def finding(**changes):
    """A finding of the book's own."""
    fields = {
        "verdict": ESTABLISHED,
        "paper_value": None,
        "threshold": None,
        "agreement": {"rel": 1e-3},
        "route": "Another way.",
    }
    return make(**{**fields, "reproduced_within": None, **changes})


ENTRY = """
[[claim]]
id = "{id}"
chapter = "part/chapter"
source = "someone1999, Fig. 1"
statement = "It is ten."
kind = "value"
threshold = "printed"
paper_value = 10
reproduced_within = {{ abs = 1 }}
ours = 10.5
tolerance = {{ abs = 0.1 }}
verdict = "reproduced"
"""
