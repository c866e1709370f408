"""The ledger: every claim of every source, and whether it held.

``book/claims.toml`` holds one entry per claim. A chapter computes a value and calls
``claims.check("claim-id", value)`` under its figure. The verdict is *derived* from the fresh value,
and a recorded verdict that the fresh value does not give is an error: the notebook stops, and with
it the build. The badge that appears shows the ledger's numbers, which the fresh ones were just
found to equal.
"""

import html
import math
import sys
import tomllib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

REPRODUCED = "reproduced"
IN_SHAPE = "reproduced in shape"
UNDERDETERMINED = "underdetermined"
NOT_REPRODUCED = "not reproduced"
ESTABLISHED = "established here"
VERDICTS = (REPRODUCED, IN_SHAPE, UNDERDETERMINED, NOT_REPRODUCED, ESTABLISHED)
KINDS = ("value", "bound", "order", "boolean")

_NEAR = {"abs", "rel", "factor"}
_SHAPE_KEYS = {
    "value": _NEAR,
    "bound": {"at_most", "at_least"},
    "order": {"swaps"},
    "boolean": {"holding"},
}


class ClaimError(AssertionError):
    """A fresh value that does not give the recorded verdict, or an entry that is not one."""


@dataclass(frozen=True)
class Claim:
    """One entry of the ledger.

    Parameters
    ----------
    id : str
        Its name in ``check``.
    chapter : str
        The notebook that checks it, relative to book/ and without its ending.
    source : str
        The work, with section, equation, figure or table; "this book" for its own findings.
    statement : str
        The claim, in our own words.
    kind : str
        "value", "bound", "order" or "boolean".
    ours : number, list, bool or table
        What was found; a table where several readings of the source are possible.
    verdict : str
        One of ``VERDICTS``.
    paper_value : number, list, bool or table, optional
        What the source gives: a number or numbers; at_most and at_least for a bound; names, best
        first, for an order. None for a finding of the book's own.
    our_reading : bool
        Whether paper_value is our reading of a word such as "similar", and not a printed number.
    reproduced_within : table, optional
        abs, rel or factor: how near a value must come, from the printed digits.
    shape_rule : table, optional
        What still counts as reproduced in shape: abs, rel or factor for a value, at_most or
        at_least for a bound, swaps (of neighbours) for an order, holding (how many parts) for
        booleans.
    tolerance : table, optional
        abs or rel: guards ``ours`` against drift; exact where absent.
    agreement : table, optional
        abs or rel: how near the second computation of a finding must come.
    reason : str, optional
        Needed for every verdict but "reproduced".

    Raises
    ------
    ClaimError
        An entry that lacks what its kind or verdict needs.
    """

    id: str
    chapter: str
    source: str
    statement: str
    kind: str
    ours: Any
    verdict: str
    paper_value: Any = None
    reproduced_within: Mapping | None = None
    shape_rule: Mapping | None = None
    tolerance: Mapping | None = None
    agreement: Mapping | None = None
    reason: str = ""
    our_reading: bool = False

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ClaimError(f"{self.id}: kind must be one of {KINDS}; found {self.kind!r}")
        if self.verdict not in VERDICTS:
            raise ClaimError(
                f"{self.id}: verdict must be one of {VERDICTS}; found {self.verdict!r}"
            )
        if self.verdict != REPRODUCED and not self.reason:
            raise ClaimError(f"{self.id}: a verdict of {self.verdict!r} needs a reason")
        own = self.verdict == ESTABLISHED
        if own != (self.paper_value is None) or own != (self.agreement is not None):
            raise ClaimError(
                f"{self.id}: a finding of the book's own has an agreement and no paper_value, any "
                "other claim a paper_value and no agreement"
            )
        if self.kind == "value" and not own and self.reproduced_within is None:
            raise ClaimError(f"{self.id}: a claim of kind 'value' needs reproduced_within")
        rules = [
            ("reproduced_within", _NEAR),
            ("tolerance", {"abs", "rel"}),
            ("agreement", {"abs", "rel"}),
            ("shape_rule", _SHAPE_KEYS[self.kind]),
        ]
        if self.kind == "bound" and not own:
            rules.append(("paper_value", _SHAPE_KEYS["bound"]))
        for name, known in rules:
            rule = getattr(self, name)
            if rule is not None and not (isinstance(rule, Mapping) and rule and set(rule) <= known):
                raise ClaimError(f"{self.id}: {name} is a table of {sorted(known)}; found {rule!r}")


def derive(claim: Claim, value: Any, *, second: Any = None) -> str:
    """The verdict that a fresh value gives.

    Parameters
    ----------
    claim : Claim
        Its paper_value and rules; the recorded verdict takes no part.
    value : number, list, bool or mapping
        The fresh value, in the claim's kind. For an order: a mapping of names to numbers, smaller
        being better. For booleans: one, or a mapping of named parts. For the values of several
        readings of the source: a ``Readings``.
    second : number, list or bool, optional
        The independent second computation of a finding of the book's own.

    Returns
    -------
    str
        One of ``VERDICTS``.

    Raises
    ------
    ClaimError
        A finding without its second computation, or whose two computations differ.
    """
    if claim.paper_value is None:
        if second is None:
            raise ClaimError(f"{claim.id}: a finding of the book's own needs second=")
        if not _near(value, second, claim.agreement):
            raise ClaimError(f"{claim.id}: the two computations differ: {value} and {second}")
        return ESTABLISHED
    if isinstance(value, Readings):
        verdicts = {derive(claim, reading) for reading in value.values()}
        return verdicts.pop() if len(verdicts) == 1 else UNDERDETERMINED
    return _RULES[claim.kind](claim, value)


class Readings(dict):
    """The values that a claim takes under different readings of a source that leaves them open.

    Where the readings do not agree on the verdict, the claim is underdetermined.
    """


def _value(claim: Claim, value: Any) -> str:
    if _near(value, claim.paper_value, claim.reproduced_within):
        return REPRODUCED
    if claim.shape_rule and _near(value, claim.paper_value, claim.shape_rule):
        return IN_SHAPE
    return NOT_REPRODUCED


def _bound(claim: Claim, value: Any) -> str:
    if _within(value, claim.paper_value):
        return REPRODUCED
    if claim.shape_rule and _within(value, claim.shape_rule):
        return IN_SHAPE
    return NOT_REPRODUCED


def _order(claim: Claim, value: Mapping) -> str:
    names = claim.paper_value
    if set(value) != set(names):
        raise ClaimError(f"{claim.id}: the order is of {names}; found values for {list(value)}")
    pairs = [(a, b) for i, a in enumerate(names) for b in names[i + 1 :]]
    if any(math.isnan(x) for x in _numbers(value)):
        return NOT_REPRODUCED
    swaps = sum(not value[a] < value[b] for a, b in pairs)
    if swaps == 0:
        return REPRODUCED
    if claim.shape_rule and swaps <= claim.shape_rule["swaps"]:
        return IN_SHAPE
    return NOT_REPRODUCED


def _boolean(claim: Claim, value: Any) -> str:
    parts = list(value.values()) if isinstance(value, Mapping) else [value]
    holding = sum(part == claim.paper_value for part in parts)
    if holding == len(parts):
        return REPRODUCED
    if claim.shape_rule and holding >= claim.shape_rule["holding"]:
        return IN_SHAPE
    return NOT_REPRODUCED


_RULES = {"value": _value, "bound": _bound, "order": _order, "boolean": _boolean}


def _numbers(value: Any) -> list[float]:
    if isinstance(value, Mapping):
        return [x for key in value for x in _numbers(value[key])]
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [x for item in value for x in _numbers(item)]
    return [float(value)]


def _near(value: Any, target: Any, rule: Mapping | None) -> bool:
    """Whether every number of value is within the rule of its counterpart."""
    rule = rule or {}
    found, wanted = _numbers(value), _numbers(target)
    if len(found) != len(wanted):
        return False
    return all(_near_one(a, b, rule) for a, b in zip(found, wanted, strict=True))


def _near_one(a: float, b: float, rule: Mapping) -> bool:
    if "factor" in rule:
        return b != 0 and 1 / rule["factor"] <= a / b <= rule["factor"]
    return abs(a - b) <= rule.get("abs", 0.0) + rule.get("rel", 0.0) * abs(b)


def _within(value: Any, bound: Mapping) -> bool:
    low, high = bound.get("at_least", -math.inf), bound.get("at_most", math.inf)
    numbers = _numbers(value)
    return bool(numbers) and all(low <= x <= high for x in numbers)


def check(claim_id: str, value: Any, *, second: Any = None) -> None:
    """Derive the verdict from a fresh value, compare it with the recorded one, show the badge.

    Parameters
    ----------
    claim_id : str
        An id in the ledger.
    value : number, list, bool, mapping or Readings
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
            f"{claim_id}: recorded as {claim.verdict!r}, but {_plain(value)} gives {derived!r} "
            f"against the paper's {_plain(claim.paper_value)}"
        )
    if not _near(value, _ordered_like(value, claim.ours), claim.tolerance):
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


def _show(badge: "Badge") -> None:
    if "IPython" in sys.modules:
        from IPython import get_ipython
        from IPython.display import display

        if get_ipython() is not None:
            display(badge)


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
        word = "read as" if c.our_reading else "paper"
        return f"[{c.verdict}] {c.id}: {word} {_plain(c.paper_value)}, ours {_plain(c.ours)}"

    def _repr_html_(self) -> str:
        c = self.claim
        numbers = f"ours {_rich(c.ours)}"
        if c.paper_value is not None:
            word = "read as" if c.our_reading else "paper"
            numbers = f"{word} {_rich(c.paper_value)} · {numbers}"
        reason = f'<div class="claim-reason">{_text(c.reason)}</div>' if c.reason else ""
        return (
            f'<div class="claim claim-{_slug(c.verdict)}" id="claim-{c.id}">'
            f'<span class="claim-verdict">{c.verdict}</span> {_text(c.statement)} '
            f'<span class="claim-source">{_text(c.source)}</span>'
            f'<div class="claim-numbers">{numbers}</div>{reason}</div>'
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
    """Verdicts of each source, counted: the one table that a hurried reader needs.

    Returns
    -------
    Page
    """
    ledger = load().values()
    sources = list(dict.fromkeys(_work(c) for c in ledger))
    counts = Counter((_work(c), c.verdict) for c in ledger)
    head = "".join(f"<th>{_text(source)}</th>" for source in sources)
    rows, lines = [], []
    for verdict in (*VERDICTS, "all"):
        chosen = VERDICTS if verdict == "all" else (verdict,)
        numbers = [sum(counts[source, v] for v in chosen) for source in sources]
        cells = "".join(f"<td>{n or '·'}</td>" for n in numbers)
        rows.append(f'<tr class="claim-{_slug(verdict)}"><th>{verdict}</th>{cells}</tr>')
        lines.append(f"{verdict}: {dict(zip(sources, numbers, strict=True))}")
    table = f'<table class="claims-summary"><tr><th>verdict</th>{head}</tr>{"".join(rows)}</table>'
    return Page(f'<div class="claims-scroll">{table}</div>', "\n".join(lines))


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
    chosen = [c for c in load().values() if _work(c) == work]
    if not chosen:
        raise ClaimError(f"no claim of {work!r} in {find()}")
    head = "".join(f"<th>{t}</th>" for t in ("claim", "paper", "ours", "verdict"))
    rows = []
    for c in chosen:
        where = f'<a href="{c.chapter}.html#claim-{c.id}">{_text(_place(c))}</a>'
        reason = f'<div class="claim-reason">{_text(c.reason)}</div>' if c.reason else ""
        paper = "" if c.paper_value is None else _rich(c.paper_value)
        if c.our_reading:
            paper = f'<span class="claim-reason">read as</span> {paper}'
        rows.append(
            f"<tr><td>{_text(c.statement)} {where}{reason}</td><td>{paper}</td>"
            f'<td>{_rich(c.ours)}</td><td class="claim-{_slug(c.verdict)}">'
            f'<span class="claim-verdict">{c.verdict}</span></td></tr>'
        )
    table = f'<table class="claims-table"><tr>{head}</tr>{"".join(rows)}</table>'
    text = "\n".join(repr(Badge(c)) for c in chosen)
    return Page(f'<div class="claims-scroll">{table}</div>', text)


def _work(claim: Claim) -> str:
    return claim.source.split(",")[0]


def _place(claim: Claim) -> str:
    return claim.source.partition(", ")[2] or claim.chapter.rpartition("/")[2]


def _slug(verdict: str) -> str:
    return verdict.replace(" ", "-")


def _text(text: str) -> str:
    return html.escape(text, quote=False)


def _plain(value: Any) -> str:
    """A value in few digits."""
    if value is None:
        return "none"
    if isinstance(value, Mapping):
        return "; ".join(f"{key}: {_plain(item)}" for key, item in value.items())
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return ", ".join(_plain(item) for item in value)
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return f"{value:.5g}"
    return str(value)


def _rich(value: Any) -> str:
    names = {"at_most": "≤ ", "at_least": "≥ "}
    if isinstance(value, Mapping):
        return "; ".join(f"{names.get(k) or _text(k) + ': '}{_rich(v)}" for k, v in value.items())
    if isinstance(value, int | float) and not isinstance(value, bool) and value:
        digits = f"{value:.5g}"
        if "e" in digits:
            mantissa, exponent = digits.split("e")
            return f"{mantissa}&thinsp;×&thinsp;10<sup>{int(exponent)}</sup>"
    if isinstance(value, list | tuple):
        return ", ".join(_rich(item) for item in value)
    return _text(_plain(value))


def find(start: Path | None = None) -> Path:
    """The ledger: book/claims.toml in the working folder or above it.

    Parameters
    ----------
    start : Path, optional
        Where to begin; the working folder by default.

    Returns
    -------
    Path

    Raises
    ------
    ClaimError
        When there is none.
    """
    start = (start or Path.cwd()).resolve()
    for folder in (start, *start.parents):
        path = folder / "book" / "claims.toml"
        if path.is_file():
            return path
    raise ClaimError(f"no book/claims.toml in {start} or above it")


def load(path: Path | None = None) -> dict[str, Claim]:
    """The ledger, by id.

    Parameters
    ----------
    path : Path, optional
        The file; by default the one that ``find`` finds.

    Returns
    -------
    dict of str to Claim

    Raises
    ------
    ClaimError
        Two entries of one id, a field that no entry has, or an entry that lacks what it needs.
    """
    path = path or find()
    return _load(path, path.stat().st_mtime_ns)


@cache
def _load(path: Path, stamp: int) -> dict[str, Claim]:
    ledger: dict[str, Claim] = {}
    for entry in tomllib.loads(path.read_text(encoding="utf-8"))["claim"]:
        try:
            claim = Claim(**entry)
        except TypeError as error:
            raise ClaimError(f"{entry.get('id', 'an entry without id')}: {error}") from None
        if claim.id in ledger:
            raise ClaimError(f"{claim.id}: two entries of this id")
        ledger[claim.id] = claim
    return ledger
