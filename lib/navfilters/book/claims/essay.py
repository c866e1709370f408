"""Sentences whose numbers are the ledger's."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from .entries import ClaimError
from .ledger import VERDICTS, Claim, load
from .pages import Page, named, plain, rich, slug, work_of
from .pages import table as table_of

_PLACE = re.compile(r"\{([^{}]*)\}")
_TAG = re.compile(r"<[^>]+>")


def told(*paragraphs: str) -> Page:
    """Paragraphs in which {name} is the number of that claim, linked to where it is computed.

    Parameters
    ----------
    *paragraphs : str
        Plain text. ``{name}`` is what was found, ``{name|key}`` one part of it, by its key or its
        place from 0; ``{name!paper}`` what the source gives, and ``{name=words}`` a link of words.

    Returns
    -------
    Page
        Links are relative to book/.

    Raises
    ------
    ClaimError
        A name or a part that the ledger does not have.
    """
    ledger = load()
    html = "".join(f"<p>{_filled(p, ledger)}</p>" for p in paragraphs)
    return Page(html, "\n".join(_TAG.sub("", _filled(p, ledger)) for p in paragraphs))


def omissions(rows: Sequence[tuple[str, str, str]]) -> Page:
    """A table of what is left unsaid, and what it costs.

    Parameters
    ----------
    rows : sequence of (str, str, str)
        What must be stated, what depends on it, and the cost; texts as of :func:`told`.

    Returns
    -------
    Page
    """
    ledger = load()
    filled = [[_filled(cell, ledger) for cell in row] for row in rows]
    html = [
        f"<tr><th scope='row'>{what}</th><td>{why}</td><td>{cost}</td></tr>"
        for what, why, cost in filled
    ]
    page = table_of("claims-omissions", ("state", "because", "cost of leaving it out"), html)
    return Page(page, "\n".join(_TAG.sub("", " | ".join(row)) for row in filled))


def verdicts_of(work: str) -> str:
    """A source's name, and how many of its claims got which verdict.

    Parameters
    ----------
    work : str
        Such as "perea2007".

    Returns
    -------
    str
    """
    found = [c.verdict for c in load().values() if work_of(c) == work]
    if not found:
        raise ClaimError(f"no claim of {work!r}")
    counted = [f"{found.count(v)} {v}" for v in VERDICTS if v in found]
    return f"{named(work)}: of {len(found)} claims, " + ", ".join(counted)


def _filled(words: str, ledger: Mapping[str, Claim]) -> str:
    return _PLACE.sub(lambda place: _linked(place[1], ledger), words)


def _linked(place: str, ledger: Mapping[str, Claim]) -> str:
    place, _, shown = place.partition("=")
    place, _, paper = place.partition("!")
    name, *parts = place.split("|")
    if name not in ledger:
        raise ClaimError(f"no claim {name!r} in the ledger")
    claim = ledger[name]
    value = claim.paper_value if paper else claim.ours
    for part in parts:
        value = _part(name, value, part)
    link = f'href="{claim.chapter}.html#claim-{name}" class="claim-{slug(claim.verdict)}"'
    return f'<a {link} title="{claim.verdict}: {name}">{shown or rich(value)}</a>'


def _part(name: str, value: Any, part: str) -> Any:
    try:
        return value[part] if isinstance(value, Mapping) else value[int(part)]
    except (KeyError, IndexError, ValueError, TypeError):
        raise ClaimError(f"{name} has no part {part!r}; it is {plain(value)}") from None
