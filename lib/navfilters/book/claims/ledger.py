"""Entries of the ledger, and what each of them must say."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from .entries import ClaimError, listed, made, tables

REPRODUCED, IN_SHAPE = "reproduced", "reproduced in shape"
UNDERDETERMINED = "underdetermined"
NOT_REPRODUCED = "not reproduced"
ESTABLISHED = "established here"
VERDICTS = (REPRODUCED, IN_SHAPE, UNDERDETERMINED, NOT_REPRODUCED, ESTABLISHED)
KINDS = ("value", "bound", "order", "boolean")
PRINTED, OURS = "printed", "ours"
SHAPE_OF_A_NUMBER = {"factor": 2}

_NEAR = {"abs", "rel", "factor"}
_SHAPE_KEYS = {
    "value": _NEAR,
    "bound": {"at_most", "at_least"},
    "order": {"swaps"},
    "boolean": set(),
}


@dataclass(frozen=True)
class Word:
    """How the whole book reads one word of degree, such as "much" or "similar".

    Parameters
    ----------
    meaning : str
        What is compared with the rule.
    rule : table
        at_most, at_least or factor.
    shape_rule : table, optional
        What still counts as reproduced in shape.
    """

    meaning: str
    rule: Mapping[str, Any]
    shape_rule: Mapping[str, Any] | None = None


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
        What was found; a table where there are several parts or several readings of the source.
    verdict : str
        One of ``VERDICTS``.
    paper_value : number, list, bool or table, optional
        What the source gives: a number or numbers; at_most and at_least for a bound; names, best
        first, for an order. None for a finding of the book's own.
    threshold : str, optional
        Where the limit of the verdict stands: "printed", as a number, an order or an equation of
        the source, or "ours", our reading of a word. None for a finding of the book's own.
    word : str, optional
        The word of degree that an "ours" reads; its rule is that of the ledger's table of words.
    own_rule : str, optional
        Why this entry's rule is another than that of its word, or of printed numbers.
    reproduced_within : table, optional
        abs, rel or factor: how near a value must come, from the printed digits.
    shape_rule : table, optional
        What still counts as reproduced in shape: a factor of 2 for a number, at_most or at_least
        for a bound, swaps (of neighbours) for an order. A boolean has no shape.
    left_open : str, optional
        What the source's text leaves open. Needed where several readings of it are computed.
    quantifier : str, optional
        "some" where the source says that a thing can happen, and one case is enough.
    revised : list of tables, optional
        Rules that this entry had before: was and why.
    tolerance : table, optional
        abs or rel: guards ``ours`` against drift; exact where absent.
    agreement : table, optional
        abs or rel: how near the second computation of a finding must come.
    route : str, optional
        By which route the second computation of a finding was made. Needed there.
    reason : str, optional
        Needed for every verdict of a source's claim but "reproduced".

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
    threshold: str | None = None
    word: str = ""
    own_rule: str = ""
    reproduced_within: Mapping[str, Any] | None = None
    shape_rule: Mapping[str, Any] | None = None
    left_open: str = ""
    quantifier: str = ""
    revised: tuple[Any, ...] | list[Any] = ()
    tolerance: Mapping[str, Any] | None = None
    agreement: Mapping[str, Any] | None = None
    route: str = ""
    reason: str = ""

    def __post_init__(self) -> None:
        for fault in _faults(self):
            raise ClaimError(f"{self.id}: {fault}")

    @property
    def own(self) -> bool:
        """Whether it is a finding of the book's own."""
        return self.verdict == ESTABLISHED


def _faults(claim: Claim) -> Iterator[str]:
    """Whatever an entry gets wrong, in words."""
    if claim.kind not in KINDS:
        yield f"kind must be one of {KINDS}; found {claim.kind!r}"
    elif claim.verdict not in VERDICTS:
        yield f"verdict must be one of {VERDICTS}; found {claim.verdict!r}"
    else:
        yield from _faults_of_finding(claim) if claim.own else _faults_of_source(claim)
        yield from _faults_of_rules(claim)


def _faults_of_finding(claim: Claim) -> Iterator[str]:
    if claim.paper_value is not None or claim.threshold or claim.agreement is None:
        yield (
            "a finding of the book's own has an agreement, and neither paper_value nor threshold"
        )
    if not claim.route:
        yield "a finding of the book's own says in route how its second computation was made"


def _faults_of_source(claim: Claim) -> Iterator[str]:
    if claim.paper_value is None or claim.agreement is not None:
        yield "a claim of a source has a paper_value and no agreement"
    if claim.threshold not in (PRINTED, OURS):
        yield f"threshold must be {PRINTED!r} or {OURS!r}; found {claim.threshold!r}"
    if claim.verdict != REPRODUCED and not claim.reason:
        yield f"a verdict of {claim.verdict!r} needs a reason"
    if claim.kind == "value" and claim.reproduced_within is None:
        yield "a claim of kind 'value' needs reproduced_within"
    if claim.threshold == OURS and not (claim.word or claim.own_rule):
        yield "a threshold of ours needs the word that it reads, or own_rule"
    if claim.threshold == PRINTED and claim.word:
        yield "a printed threshold reads no word"
    number = claim.kind == "value" and claim.threshold == PRINTED and not claim.own_rule
    if number and claim.shape_rule not in (None, SHAPE_OF_A_NUMBER):
        yield f"a printed number's shape_rule is {SHAPE_OF_A_NUMBER}; found {claim.shape_rule}"
    if claim.quantifier not in ("", "some"):
        yield f"quantifier can only be 'some'; found {claim.quantifier!r}"
    if any(not isinstance(old, dict) or set(old) != {"was", "why"} for old in claim.revised):
        yield f"revised is a list of tables of was and why; found {claim.revised!r}"


def _faults_of_rules(claim: Claim) -> Iterator[str]:
    rules = [
        ("reproduced_within", _NEAR),
        ("tolerance", {"abs", "rel"}),
        ("agreement", {"abs", "rel"}),
        ("shape_rule", _SHAPE_KEYS[claim.kind]),
    ]
    if claim.kind == "bound" and not claim.own:
        rules.append(("paper_value", _SHAPE_KEYS["bound"]))
    for name, known in rules:
        rule = getattr(claim, name)
        if rule is not None and not (isinstance(rule, Mapping) and rule and set(rule) <= known):
            yield f"{name} is a table of {sorted(known)}; found {rule!r}"


def _fault_of_word(claim: Claim, words: Mapping[str, Word]) -> str:
    """How an entry's rule departs from that of its word."""
    if not claim.word:
        return ""
    if claim.word not in words:
        return f"no word {claim.word!r} in the ledger's table; it has {sorted(words)}"
    if claim.own_rule or claim.kind == "boolean":
        return ""
    word = words[claim.word]
    rule = claim.reproduced_within if claim.kind == "value" else claim.paper_value
    if rule != word.rule or claim.shape_rule not in (None, word.shape_rule):
        return (
            f"{claim.word!r} is read as {dict(word.rule)} through the whole book; found {rule}. "
            "Another rule needs own_rule"
        )
    return ""


def find(start: Path | None = None) -> Path:
    """The ledger: book/claims.toml in the working folder or above it, or that of the wheel.

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
    places = [folder / "book" / "claims.toml" for folder in (start, *start.parents)]
    for path in (*places, Path(__file__).with_name("claims.toml")):
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
        Two entries of one id, a field that no entry has, an entry that lacks what it needs, or a
        rule that is not its word's.
    """
    path = path or find()
    return _load(path, path.stat().st_mtime_ns)[0]


def load_words(path: Path | None = None) -> dict[str, Word]:
    """How the ledger reads words of degree.

    Parameters
    ----------
    path : Path, optional
        The file; by default the one that ``find`` finds.

    Returns
    -------
    dict of str to Word

    Raises
    ------
    ClaimError
        As ``load``.
    """
    path = path or find()
    return _load(path, path.stat().st_mtime_ns)[1]


@cache
def _load(path: Path, stamp: int) -> tuple[dict[str, Claim], dict[str, Word]]:
    table = tables(path)
    try:
        return _entries(table)
    except ClaimError as error:
        raise ClaimError(f"{path}: {error}") from None


def _entries(table: dict[str, Any]) -> tuple[dict[str, Claim], dict[str, Word]]:
    named = table.get("word", {})
    if not isinstance(named, dict):
        raise ClaimError(f"tables [word.name] are needed; found {named!r}")
    words = {name: made(Word, name, entry) for name, entry in named.items()}
    ledger: dict[str, Claim] = {}
    for entry in listed(table, "claim"):
        claim = made(Claim, str(entry.get("id", "an entry without id")), entry)
        if claim.id in ledger:
            raise ClaimError(f"{claim.id}: two entries of this id")
        if fault := _fault_of_word(claim, words):
            raise ClaimError(f"{claim.id}: {fault}")
        ledger[claim.id] = claim
    return ledger, words
