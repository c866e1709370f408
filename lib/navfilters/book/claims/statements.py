"""What the sources state, sentence by sentence, and how much of it the ledger checks."""

import html
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .entries import ClaimError, listed, made, tables
from .ledger import find
from .pages import Page, named, table


@dataclass(frozen=True)
class Statement:
    """One figure, table, number, equation or statement of a source.

    Parameters
    ----------
    id : str
        Work, section and running number.
    work : str
        The source.
    section : str
        Its section.
    what : str
        "statement", "figure", "table", "number" or "equation".
    text : str
        In our own words.
    claims : tuple of str
        The claims that check it.
    set_aside : str
        Why no claim does.
    open : str
        What a claim would have to compute.
    shown : str
        The label of the chapter's figure that shows the same.
    """

    id: str
    work: str
    section: str
    what: str
    text: str
    claims: tuple[Any, ...] | list[Any] = ()
    set_aside: str = ""
    open: str = ""
    shown: str = ""

    @property
    def state(self) -> str:
        """Whether it is "checked", "set aside" or "open"."""
        return "checked" if self.claims else "set aside" if self.set_aside else "open"


STATES = ("checked", "set aside", "open")


def load_statements(path: Path | None = None) -> list[Statement]:
    """What the sources state, in reading order.

    Parameters
    ----------
    path : Path, optional
        The file; by default statements.toml beside the ledger.

    Returns
    -------
    list of Statement

    Raises
    ------
    ClaimError
        An entry that is not exactly one of checked, set aside and open, or two of one id.
    """
    path = path or find().parent / "statements.toml"
    table = tables(path)
    try:
        return _sound(table)
    except ClaimError as error:
        raise ClaimError(f"{path}: {error}") from None


def _sound(table: dict[str, Any]) -> list[Statement]:
    entries = listed(table, "statement")
    found = [made(Statement, str(e.get("id", "an entry without id")), e) for e in entries]
    for statement in found:
        if bool(statement.claims) + bool(statement.set_aside) + bool(statement.open) != 1:
            raise ClaimError(f"{statement.id}: exactly one of claims, set_aside and open")
    twice = [name for name, n in Counter(s.id for s in found).items() if n > 1]
    if twice:
        raise ClaimError(f"two statements of one id: {twice}")
    return found


def statements() -> Page:
    """How many statements of each source are checked, set aside and open, and which are open.

    Returns
    -------
    Page
    """
    found = load_statements()
    rows, lines = [], []
    for work in dict.fromkeys(s.work for s in found):
        mine = [s for s in found if s.work == work]
        counts = Counter(s.state for s in mine)
        numbers = [len(mine), *(counts[state] for state in STATES)]
        missing = "".join(
            f"<li>section {_text(s.section)}: {_text(s.text)} A claim would compute: "
            f"{_text(s.open)}</li>"
            for s in mine
            if s.open
        )
        listed = f"<details><summary>open ones</summary><ul>{missing}</ul></details>"
        cells = "".join(f"<td>{n}</td>" for n in numbers)
        rows.append(f"<tr><td>{_text(named(work))}{listed if missing else ''}</td>{cells}</tr>")
        lines.append(f"{named(work)}: {dict(zip(('all', *STATES), numbers, strict=True))}")
    head = ("source", "statements", *STATES)
    return Page(table("claims-listing", head, rows), "\n".join(lines))


def _text(text: str) -> str:
    return html.escape(text, quote=False)
