"""What a reader sees of the ledger: badges, the summary, the rules."""

import html
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .ledger import (
    ESTABLISHED,
    OURS,
    PRINTED,
    SHAPE_OF_A_NUMBER,
    VERDICTS,
    Claim,
    load,
    load_words,
)

NAMES = {
    "perea2007": "Perea et al. 2007",
    "lecture16": "Lecture 16",
    "xiong2009": "Xiong et al. 2009",
    "pogorelsky2020": "Pogorelsky et al. 2020",
    "schmidt1966": "Schmidt 1966",
    "blom1988": "Blom and Bar-Shalom 1988",
    "sarkka2009": "Särkkä and Nummenmaa 2009",
    "garcia2015": "García-Fernández et al. 2015",
    "jiang2024": "Jiang et al. 2024",
}
"""What a reader sees of a source; one without a name here is called by its key."""

_KEYS = re.compile(rf"\b({'|'.join(NAMES)})\b")

OF_A_SOURCE = tuple(verdict for verdict in VERDICTS if verdict != ESTABLISHED)


@dataclass(frozen=True)
class Badge:
    """What a reader sees of a check: the claim, the paper's value, ours and the verdict.

    Parameters
    ----------
    claim : Claim
    """

    claim: Claim

    def __repr__(self) -> str:
        c = self.claim
        return f"[{c.verdict}] {c.id}: {side_of(c)} {plain(c.paper_value)}, ours {plain(c.ours)}"

    def _repr_html_(self) -> str:
        c, up = self.claim, "../" * self.claim.chapter.count("/")
        numbers = f"ours {rich(c.ours)}"
        if c.paper_value is not None:
            numbers = f"{side_of(c)} {rich(c.paper_value)} · {numbers}"
        return (
            f'<div class="claim claim-{slug(c.verdict)}" id="claim-{c.id}">'
            f'<span class="claim-verdict">{c.verdict}</span> {text(c.statement)} '
            f'<a class="claim-source" href="{up}scorecard.html#row-{c.id}">{text(cited(c))}</a>'
            f'<div class="claim-numbers">{numbers}</div>{because(c)}</div>'
        )


@dataclass(frozen=True)
class Page:
    """A piece of HTML that a notebook shows, with plain text for where there is none.

    Parameters
    ----------
    html : str
    text : str
    """

    html: str
    text: str

    def __repr__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        return self.html


def summary() -> Page:
    """Verdicts of each source, counted, printed limits and our readings of words apart.

    Returns
    -------
    Page
    """
    ledger = [c for c in load().values() if not c.own]
    findings = len(load()) - len(ledger)
    counts = Counter((work_of(c), c.threshold, c.verdict) for c in ledger)
    rows, lines = [], []
    for source in dict.fromkeys(work_of(c) for c in ledger):
        limits = _thresholds(ledger, source)
        heading = f'<th rowspan="{len(limits)}">{text(named(source))}</th>'
        for threshold in limits:
            found = {verdict: counts[source, threshold, verdict] for verdict in OF_A_SOURCE}
            found["all"] = sum(found.values())
            cells = "".join(
                f'<td class="claim-{slug(verdict)}">{n or "·"}</td>' for verdict, n in found.items()
            )
            limit = f'<td class="claims-limit">{threshold}</td>'
            rows.append(f"<tr>{heading}{limit}{cells}</tr>")
            heading = ""
            lines.append(f"{named(source)} {threshold}: {found}")
    titles = "".join(
        f'<th class="claim-{slug(v)}"><span class="claim-verdict">{v}</span></th>'
        for v in OF_A_SOURCE
    )
    head = f"<tr><th>source</th><th>limit</th>{titles}<th>all</th></tr>"
    counted = f'<table class="claims-summary">{head}{"".join(rows)}</table>'
    own = f"{ESTABLISHED}, as findings of this book's own: {findings}"
    note = f'<div class="claim-{slug(ESTABLISHED)}"><span class="claim-verdict">{own}</span></div>'
    return Page(_scrolling(counted) + note, "\n".join([*lines, own]))


def rules() -> Page:
    """How the book reads words of degree, how often, and which claims depart from that and why.

    Returns
    -------
    Page
    """
    ledger = load().values()
    groups = [
        (f"{name}: {word.meaning}", rule_of(word.rule), [c for c in ledger if c.word == name])
        for name, word in load_words().items()
    ]
    printed = [c for c in ledger if c.kind == "value" and c.threshold == PRINTED]
    in_shape = f"in shape: {rule_of(SHAPE_OF_A_NUMBER)}"
    groups.append(("printed numbers: within their digits", in_shape, printed))
    wordless = [c for c in ledger if c.threshold == OURS and not c.word]
    groups.append(("readings of another kind", "each its own", wordless))
    rows, lines = [], []
    for name, rule, using in groups:
        others = [c for c in using if c.own_rule]
        departures = "".join(
            f'<div class="claim-reason">{text(_at(c))}: {text(c.own_rule)}</div>' for c in others
        )
        same = len(using) - len(others)
        rows.append(
            f"<tr><td>{text(name)}{departures}</td><td>{rule}</td><td>{same}</td>"
            f"<td>{len(others)}</td></tr>"
        )
        lines.append(f"{name.partition(':')[0]}: {same} and {len(others)} others")
    head = ("word", "rule", "claims", "others")
    return Page(table("claims-listing claims-rules", head, rows), "\n".join(lines))


def _at(claim: Claim) -> str:
    """A claim's limit, with its name."""
    return f"{claim.id} ({plain(claim.paper_value)})"


def _thresholds(ledger: Sequence[Claim], source: str) -> list[str]:
    found = {c.threshold for c in ledger if work_of(c) == source}
    return [t for t in (PRINTED, OURS) if t in found]


def side_of(claim: Claim) -> str:
    return "read as" if claim.threshold == OURS else "paper"


def because(claim: Claim) -> str:
    """What stands under a claim: reason, what is open, the route, rules that it had before."""
    notes = [claim.reason]
    if claim.left_open:
        notes.append(f"Left open: {claim.left_open}")
    if claim.route:
        notes.append(f"Twice: {claim.route}")
    notes += [f"The rule was {old['was']}; changed: {old['why']}" for old in claim.revised]
    return "".join(f'<div class="claim-reason">{text(note)}</div>' for note in notes if note)


def _scrolling(table: str) -> str:
    return f'<div class="claims-scroll">{table}</div>'


def table(style: str, head: Sequence[str], rows: Sequence[str]) -> str:
    """A table that may scroll sideways."""
    top = "".join(f"<th>{title}</th>" for title in head)
    return _scrolling(f'<table class="{style}"><tr>{top}</tr>{"".join(rows)}</table>')


def work_of(claim: Claim) -> str:
    return claim.source.split(",")[0]


def named(work: str) -> str:
    return NAMES.get(work, work)


def cited(claim: Claim) -> str:
    """A claim's source with every work called by its name."""
    return _KEYS.sub(lambda key: NAMES[key[0]], claim.source)


def place_of(claim: Claim) -> str:
    """Where in its source a claim stands, or else its chapter."""
    return cited(claim).partition(", ")[2] or claim.chapter.rpartition("/")[2]


def slug(verdict: str) -> str:
    return verdict.replace(" ", "-")


def text(words: str) -> str:
    return html.escape(words, quote=False)


def rule_of(rule: Mapping[str, Any]) -> str:
    if "factor" in rule:
        return f"within a factor {rule['factor']:g}"
    return rich(rule)


def plain(value: Any) -> str:
    """A value in few digits."""
    if value is None:
        return "none"
    if isinstance(value, Mapping):
        return "; ".join(f"{key}: {plain(item)}" for key, item in value.items())
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return ", ".join(plain(item) for item in value)
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return f"{value:.5g}"
    return str(value)


def rich(value: Any) -> str:
    names = {"at_most": "≤ ", "at_least": "≥ "}
    if isinstance(value, Mapping):
        return "; ".join(f"{names.get(k) or text(k) + ': '}{rich(v)}" for k, v in value.items())
    if isinstance(value, int | float) and not isinstance(value, bool) and value:
        digits = f"{value:.5g}"
        if "e" in digits:
            mantissa, exponent = digits.split("e")
            return f"{mantissa}&thinsp;×&thinsp;10<sup>{int(exponent)}</sup>"
    if isinstance(value, list | tuple):
        return ", ".join(rich(item) for item in value)
    return text(plain(value))
