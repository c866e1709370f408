"""The scorecard: every claim of a source in a table, bars that count them, all of it as data."""

import json
from collections import Counter
from html import escape
from typing import Any
from urllib.parse import urlencode

from .entries import ClaimError
from .ledger import OURS, PRINTED, VERDICTS, Claim, find, load
from .pages import (
    NAMES,
    OF_A_SOURCE,
    Badge,
    Page,
    because,
    cited,
    named,
    place_of,
    plain,
    rich,
    slug,
    text,
    work_of,
)
from .pages import table as table_of

TITLES = {
    "perea2007": "Nonlinearity in Sensor Fusion: Divergence Issues in EKF, modified truncated SOF, "
    "and UKF",
    "lecture16": "Lecture 16: Extended Kalman Filter",
    "xiong2009": "Adaptive Robust Extended Kalman Filter",
    "pogorelsky2020": "Spacecraft Terrain Relative Navigation with Synthetic Aperture Radar",
}
"""Of the sources."""


def scorecard(work: str) -> Page:
    """Every claim of one source: the paper's value, ours, the verdict, and where it is checked.

    Parameters
    ----------
    work : str
        The first word of the claims' source, such as "perea2007".

    Returns
    -------
    Page
        Links are relative to book/.

    Raises
    ------
    ClaimError
        When the ledger holds nothing of that source.
    """
    chosen = [c for c in load().values() if work_of(c) == work]
    if not chosen:
        raise ClaimError(f"no claim of {work!r} in {find()}")
    head = ("claim", "paper", "ours", "verdict")
    page = table_of("claims-table", head, [_row(c) for c in chosen])
    return Page(_folding(chosen, page), "\n".join(repr(Badge(c)) for c in chosen))


def _folding(chosen: list[Claim], page: str) -> str:
    """A table under a line that counts its verdicts; the page's script folds it."""
    counts = Counter(c.verdict for c in chosen)
    told = ", ".join(
        f'<span class="claim-{slug(v)}"><span class="claim-verdict">{counts[v]} {v}</span></span>'
        for v in VERDICTS
        if counts[v]
    )
    noun = "claim" if len(chosen) == 1 else "claims"
    return (
        f'<details class="claims-work" open><summary>{len(chosen)} {noun}: {told}</summary>'
        f"{page}</details>"
    )


def _row(c: Claim) -> str:
    paper = "" if c.paper_value is None else rich(c.paper_value)
    if c.threshold == OURS:
        paper = f'<span class="claim-reason">read as</span> {paper}'
    links = (
        f'<a href="{c.chapter}.html#claim-{c.id}">{text(place_of(c))}</a> '
        f'<a class="claim-link" href="#row-{c.id}" title="link to this row">{c.id}</a>'
    )
    rule = f'<div class="claim-reason">Rule: {text(_rule(c))}</div>'
    return (
        f'<tr id="row-{c.id}"><td>{text(c.statement)} {links}'
        f"<details><summary>rule and reason</summary>{rule}{because(c)}</details></td>"
        f'<td>{paper}</td><td>{rich(c.ours)}</td><td class="claim-{slug(c.verdict)}">'
        f'<span class="claim-verdict">{c.verdict}</span></td></tr>'
    )


def _rule(c: Claim) -> str:
    """How the verdict follows from ours, in words."""
    parts = []
    if c.word:
        parts.append(f'the book\'s rule for "{c.word}"')
    if c.own_rule:
        parts.append(c.own_rule)
    if c.paper_value is not None:
        parts.append(f"{c.kind} {plain(c.paper_value)}")
    if c.reproduced_within:
        parts.append(f"within {plain(c.reproduced_within)}")
    if c.shape_rule:
        parts.append(f"in shape: {plain(c.shape_rule)}")
    if c.agreement:
        parts.append(f"two computations agree within {plain(c.agreement)}")
    return "; ".join(parts) or c.kind


def database() -> Page:
    """The whole ledger as data, in the page: what its search, its filters and its exports read.

    Returns
    -------
    Page
    """
    rows = [
        {
            "id": c.id,
            "paper": work_of(c),
            "source": cited(c),
            "statement": c.statement,
            "kind": c.kind,
            "limit": c.threshold or "",
            "paper value": plain(c.paper_value) if c.paper_value is not None else "",
            "ours": plain(c.ours),
            "verdict": c.verdict,
            "rule": _rule(c),
            "left open": c.left_open,
            "reason": c.reason,
            "second computation": c.route,
            "page": f"{c.chapter}.html#claim-{c.id}",
        }
        for c in load().values()
    ]
    told = json.dumps(rows, ensure_ascii=False).replace("<", "\\u003c")
    data = f'<script id="ledger" type="application/json">{told}</script>'
    names = escape(json.dumps(NAMES))
    page = f'<div class="claims-browser" data-names="{names}"></div>{data}'
    return Page(page, f"{len(rows)} claims")


def bars() -> Page:
    """One bar a source and limit, a segment a verdict; each leads to its claims in the scorecard.

    Returns
    -------
    Page
        Links are relative to book/.
    """
    counts: Counter[Any] = Counter((work_of(c), c.threshold, c.verdict) for c in load().values())
    rows, lines = [], []
    for work, title in TITLES.items():
        rows.append(f'<div class="bar-title"><b>{text(title)}</b> ({text(named(work))})</div>')
        for limit in (PRINTED, OURS):
            found = {v: counts[work, limit, v] for v in OF_A_SOURCE if counts[work, limit, v]}
            if not found:
                continue
            parts = "".join(
                f'<a class="bar-part claim-{slug(v)}" style="flex-grow: {n}" title="{v}: {n}" '
                f'href="{_filtered(work, limit, v)}">{n}</a>'
                for v, n in found.items()
            )
            rows.append(f'<div class="bar"><span class="bar-limit">{limit}</span>{parts}</div>')
            lines.append(f"{named(work)} {limit}: {found}")
    key = "".join(f'<span class="bar-key claim-{slug(v)}">{v}</span>' for v in OF_A_SOURCE)
    own = counts["this book", None, VERDICTS[-1]]
    last = f'<a href="{_filtered("this book")}">{own} findings of this book</a>'
    page = f'<div class="claims-bars"><div>{key}</div>{"".join(rows)}<div>{last}</div></div>'
    return Page(page, "\n".join([*lines, f"this book: {own}"]))


def _filtered(work: str, limit: str = "", verdict: str = "") -> str:
    """The address of the scorecard's rows of one kind, for HTML."""
    chosen = {"paper": work, "limit": limit, "verdict": verdict}
    return escape("scorecard.html#" + urlencode({k: v for k, v in chosen.items() if v}))
