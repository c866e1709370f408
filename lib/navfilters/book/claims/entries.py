"""Entries of a TOML file as values of a class: an error says which file, entry and field."""

import tomllib
from dataclasses import fields
from pathlib import Path
from types import UnionType
from typing import Any, get_args, get_origin

_DOTS = 200  # in one line: of a key of n tables in tables tomllib's memory grows as n squared


class ClaimError(AssertionError):
    """A fresh value that does not give the recorded verdict, or an entry that is not one."""


def tables(path: Path) -> dict[str, Any]:
    """What a file holds.

    Parameters
    ----------
    path : Path

    Returns
    -------
    dict

    Raises
    ------
    ClaimError
        It is no TOML file; naming it.
    """
    try:
        text = path.read_text(encoding="utf-8")
        if dotted := [n for n, line in enumerate(text.splitlines(), 1) if line.count(".") > _DOTS]:
            raise ValueError(f"more than {_DOTS} dots in line {dotted[0]}")
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # of TOML, of UTF-8, of brackets in brackets
        raise ClaimError(f"{path} must be a TOML file in UTF-8; found: {error}") from None


def listed(table: dict[str, Any], name: str) -> list[dict[str, Any]]:
    """The entries ``[[name]]``, at least one; ClaimError if that is something else."""
    found = table.get(name)
    if not isinstance(found, list) or not all(isinstance(entry, dict) for entry in found):
        raise ClaimError(f"entries [[{name}]] are needed; found {str(found)[:60]}")
    return found


def made(kind: type, name: str, entry: Any) -> Any:
    """A dataclass of an entry.

    Parameters
    ----------
    kind : type
    name : str
        Of the entry, for messages.
    entry : dict
        Its fields.

    Returns
    -------
    kind

    Raises
    ------
    ClaimError
        A field that is missing, unknown, or of another type than the class says.
    """
    if not isinstance(entry, dict):
        raise ClaimError(f"{name} must be a table; found {entry!r}")
    for field in fields(kind):
        wanted = get_args(field.type) if isinstance(field.type, UnionType) else (field.type,)
        plain = tuple(get_origin(part) or part for part in wanted)
        if field.name in entry and Any not in plain and not isinstance(entry[field.name], plain):
            raise ClaimError(f"{name}: {field.name} cannot be {entry[field.name]!r}")
    try:
        return kind(**entry)
    except TypeError as error:
        raise ClaimError(f"{name}: {error}") from None
