"""What the ledger holds: ``navfilters claims``."""

import argparse
import sys
import textwrap
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from .entries import ClaimError
from .ledger import VERDICTS, Claim, load
from .pages import cited, named, plain, work_of


def main(arguments: Sequence[str] | None = None) -> int:
    """Count the verdicts of every source, list claims, or show one of them.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line by default.

    Returns
    -------
    int
        0, or 1 where nothing matches.
    """
    parser = argparse.ArgumentParser(
        prog="navfilters claims", description="The ledger: every claim, and whether it held."
    )
    parser.add_argument("word", nargs="*", help="in the id, the source or the statement")
    parser.add_argument("--verdict", choices=VERDICTS, help="claims of one verdict only")
    parser.add_argument("--ledger", type=Path, help="the file; by default this book's")
    chosen = parser.parse_args(arguments)
    try:
        ledger = load(chosen.ledger)
    except (ClaimError, OSError) as error:
        parser.error(f"{error}")
    asked = [word.lower() for word in chosen.word]
    found = [
        claim
        for claim in ledger.values()
        if chosen.verdict in (None, claim.verdict) and all(word in _words(claim) for word in asked)
    ]
    if not found:
        sys.stderr.write("no claim has all of that\n")
        return 1
    listed = _counts(found) if not asked and not chosen.verdict else _listed(found)
    sys.stdout.write("\n".join(listed) + "\n")
    return 0


def _words(claim: Claim) -> str:
    return f"{claim.id} {claim.source} {cited(claim)} {claim.statement}".lower()


def _counts(found: Sequence[Claim]) -> Iterable[str]:
    counts = Counter((work_of(claim), claim.verdict) for claim in found)
    for work in dict.fromkeys(work for work, _ in counts):
        said = ", ".join(f"{counts[work, v]} {v}" for v in VERDICTS if counts[work, v])
        yield f"{named(work)}: {said}"
    yield "A word, as in `navfilters claims ukf`, lists the claims that have it."


def _listed(found: Sequence[Claim]) -> Iterable[str]:
    for claim in found:
        yield f"{claim.id}: {claim.verdict}"
        yield from textwrap.wrap(claim.statement, 92, initial_indent="  ", subsequent_indent="  ")
        if len(found) == 1:
            yield f"  source: {cited(claim)}; chapter: {claim.chapter}"
            yield f"  ours: {plain(claim.ours)}"
            why = claim.reason or claim.route
            yield from textwrap.wrap(why, 92, initial_indent="  ", subsequent_indent="  ")
