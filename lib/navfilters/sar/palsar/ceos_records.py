"""The records of a CEOS file."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import Any

from navfilters.sar.palsar.ceos_fields import _NUMBER, Field, code_text, fault, take

HEADER = 12
"""Bytes at the start of every record: sequence number, four codes, length."""

_CLOSE = 0.01
"""Relative difference up to which two fields are taken to say the same."""


@dataclass(frozen=True)
class Record:
    """One record of a file.

    Parameters
    ----------
    path : Path
    start : int
        Of the record in the file.
    data : bytes
    fields : mapping of str to Field
    """

    path: Path
    start: int
    data: bytes
    fields: Mapping[str, Field]

    def text(self, name: str) -> str:
        """A field as it stands, without the blanks around it."""
        field = self.fields[name]
        raw = self.data[field.offset : field.offset + field.size]
        if field.kind[0] == "C":
            return code_text(raw)
        if field.kind[0] in "BS":
            return str(int.from_bytes(raw, "big", signed=field.kind[0] == "S"))
        return raw.decode("latin-1").strip(" \0")

    def number(self, name: str, blank: float | None = None, shift: int = 0) -> float:
        """The value of a numeric field.

        Parameters
        ----------
        name : str
        blank : float, optional
            What a blank field stands for; an error without.
        shift : int
            Bytes from the field to its repetition.

        Returns
        -------
        float
            Within the field's bounds, so finite; exact for integers.

        Raises
        ------
        ValueError
            No number, one out of bounds, or a blank field that has no meaning.
        """
        field = self.fields[name]
        start = field.offset + shift
        raw = self.data[start : start + field.size]
        text = raw.decode("latin-1")
        if field.kind[0] in "BS":
            text = str(int.from_bytes(raw, "big", signed=field.kind[0] == "S"))
        elif blank is not None and not text.strip(" \0"):
            return blank
        plain = text.strip(" ")
        if _NUMBER[field.kind[0]].fullmatch(plain):
            value = float(re.sub("[Dd]", "E", plain))
            if field.low <= value <= field.high and math.isfinite(value):
                return value
        raise fault(self.path, self.start + start, name, repr(text), field.needed)

    def integer(self, name: str, blank: int | None = None) -> int:
        """As :meth:`number`, for a count."""
        return int(self.number(name, blank))

    def error(self, name: str, found: Any, needed: str, where: str = "") -> ValueError:
        """The error for a field that contradicts something else."""
        offset = self.start + self.fields[name].offset
        return fault(self.path, offset, f"{name}{where}", found, needed)


def header(file: FileIO, path: Path, start: int, size: int, name: str) -> tuple[bytes, int]:
    """Codes and length of the record at a byte of a file.

    Parameters
    ----------
    file : FileIO
    path : Path
    start : int
    size : int
        Of the file.
    name : str
        What the record is thought to be.

    Returns
    -------
    codes : bytes (4,)
    length : int
        Positive, and within the file.

    Raises
    ------
    ValueError
    """
    first = take(file, path, start, HEADER, name)
    codes, length = first[4:8], int.from_bytes(first[8:], "big")
    if not HEADER <= length <= size - start:
        swapped = int.from_bytes(first[8:], "little")
        hint = ""
        if HEADER <= swapped <= size - start:
            hint = " (the bytes are in the wrong order)"
        elif length > size - start:
            hint = f": {length - size + start} bytes are missing, the file is cut"
        needed = f"from {HEADER} to the {size - start} bytes that the file has left"
        name = f"length of the {name}, codes {code_text(codes)},"
        raise fault(path, start + 8, name, f"{length}{hint}", needed)
    return codes, length


_MAGIC = {
    b"PK\3\4": "a zip archive: unpack it",
    b"\x1f\x8b": "a gzip archive: unpack it",
    b"BZh": "a bzip2 archive: unpack it",
    b"\x89HDF": "an HDF5 file",
    b"II*\0": "a TIFF image, so of a processed level",
    b"MM\0*": "a TIFF image, so of a processed level",
    b"<": "markup text, such as GDAL's .aux.xml",
}

_NOT_READ = {
    "VOL": "the volume directory (VOL), which only lists the product's files",
    "TRL": "the trailer (TRL), which holds neither echoes nor an orbit",
}


def foreign_kind(path: Path, start: bytes) -> str:
    """What a file is that a product's reader cannot use, by its first bytes and its name.

    Parameters
    ----------
    path : Path
    start : bytes
        At least 12 bytes, where there are so many.

    Returns
    -------
    str
        Empty for what may be an image or a leader file.
    """
    for magic, kind in _MAGIC.items():
        if start.startswith(magic):
            return kind
    codes, named = start[4:8], path.name.upper().startswith
    if codes[1:] == b"\xc0\x12\x12" and codes[:1] == b"\xc0":  # 192 192 18 18
        return _NOT_READ["VOL"]
    if codes[1:] == b"\xc0\x12\x12" and codes[:1] == b"?":  # 63 192 18 18
        return _NOT_READ["TRL"]
    return next((kind for name, kind in _NOT_READ.items() if named(f"{name}-")), "")


def descriptor(
    file: FileIO, path: Path, size: int, first_code: int | None, fields: Mapping[str, Field]
) -> Record:
    """The first record of a file.

    Parameters
    ----------
    file : FileIO
    path : Path
    size : int
        Of the file.
    first_code : int or None
        What its first sub-type code must be; None for any.
    fields : mapping of str to Field

    Returns
    -------
    Record
        Of 720 bytes.

    Raises
    ------
    ValueError
        A file that is shorter, or another format's.
    """
    start = file.read(HEADER)
    if kind := foreign_kind(path, start):
        found, needed = f"{kind}", "an image file IMG-... or a leader file LED-..."
        raise fault(path, 0, "file", found, needed)
    if size < 720:
        raise fault(path, size, "file", f"its end at byte {size}", "at least 720 bytes long")
    if (length := int.from_bytes(start[8:], "big")) == 16252:
        raise fault(path, 8, "length of the file descriptor", "16252, ERSDAC's layout", "720")
    if length != 720:
        swapped = int.from_bytes(start[8:], "little") == 720
        hint = " (720 in the wrong byte order)" if swapped else ""
        raise fault(path, 8, "length of the file descriptor", f"{length}{hint}", "720")
    if start[5:8] != b"\xc0\x12\x12" or first_code not in (None, start[4]):
        needed = f"{'any' if first_code is None else first_code} 192 18 18"
        kind = {11: ", a leader file's", 50: ", an image file's"}.get(start[4], "")
        hint = kind if start[5:8] == b"\xc0\x12\x12" else ""
        found = f"{code_text(start[4:8])}{hint}"
        raise fault(path, 4, "codes of the file descriptor", found, needed)
    return Record(path, 0, take(file, path, 0, 720, "file descriptor"), fields)


def agreed(name: str, *claims: tuple[Record, str, float]) -> float:
    """The one value that several fields give.

    Parameters
    ----------
    name : str
        What they are about.
    *claims : (Record, str, float)
        Record, field and value in common units; a value of 0 is none.

    Returns
    -------
    float
        The first that is given.

    Raises
    ------
    ValueError
        None given, or two that differ by more than 1 %.
    """
    given = [claim for claim in claims if claim[2]]
    if not given:
        record, field, _ = claims[0]
        raise record.error(field, "blank or 0 in every field", f"given: the {name}")
    record, field, value = given[0]
    for other, their, claim in given[1:]:
        if abs(claim - value) > _CLOSE * abs(value):
            first = f"{record.path}, byte {record.start + record.fields[field].offset}"
            needed = f"within 1 % of the {name} {value:.9g} at {first}"
            raise other.error(their, f"{claim:.9g}", needed)
    return value
