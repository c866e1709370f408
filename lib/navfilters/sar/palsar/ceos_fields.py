"""The fields of a CEOS record."""

import math
import re
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import Any

SPEED_OF_LIGHT = 299792458.0
"""m/s."""

_INTEGER = re.compile(r"[+-]?[0-9]+")

_NUMBER = {
    **dict.fromkeys("BSI", _INTEGER),
    "F": re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([EDed][+-]?[0-9]{1,3})?"),
}


def fault(path: Path, offset: int, name: str, found: Any, needed: str) -> ValueError:
    """The error for a value that a file must not hold.

    Parameters
    ----------
    path : Path
    offset : int
        From the start of the file, 0-based.
    name : str
        What is wrong.
    found : object
    needed : str

    Returns
    -------
    ValueError
    """
    return ValueError(f"{path}, byte {offset}: {name} must be {needed}; found {found}")


def take(file: FileIO, path: Path, start: int, length: int, name: str) -> bytes:
    """Bytes of a file, all of them.

    Parameters
    ----------
    file : FileIO
        Open for reading.
    path : Path
    start, length : int
        Bytes; the caller has compared them with the size of the file.
    name : str
        What is read.

    Returns
    -------
    bytes (length,)

    Raises
    ------
    ValueError
        The file ends before.
    """
    file.seek(start)
    data = file.read(length)
    if len(data) < length:
        found = f"the end of the file at byte {start + len(data)}"
        raise fault(path, start, name, found, f"{length} bytes long")
    return data


@dataclass(frozen=True)
class Field:
    """Where a field stands in its record, and which values it may have.

    Parameters
    ----------
    offset : int
        From the start of the record.
    kind : str
        As in the module's docstring.
    low, high : float
        Smallest and largest number that is possible.
    seen : {"A", "B", "C", ""}
        Who vouches for place and meaning: several public readers of real files, or a check on one
        (A); two descriptions, or one with the agency's own numbers of fields (B); a single one, or
        a conclusion (C). Empty for what is shown and never used.
    why : str
        Why other numbers are refused, where the field's name does not tell.
    """

    offset: int
    kind: str
    low: float = -math.inf
    high: float = math.inf
    seen: str = ""
    why: str = ""

    @property
    def size(self) -> int:
        """Bytes."""
        return int(self.kind[1:])

    @property
    def needed(self) -> str:
        """What a number of this field must be, in words."""
        if self.low == self.high:
            return f"{self.low:.10g}"
        kind = "a number" if self.kind[0] == "F" else "an integer"
        return f"{kind} from {self.low:.10g} to {self.high:.10g}"


def code_text(codes: bytes) -> str:
    """The four codes of a record as the format's tables have them, such as "50 10 18 20"."""
    return " ".join(map(str, codes))
