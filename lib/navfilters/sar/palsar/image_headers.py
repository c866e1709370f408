"""The headers of the signal records of a PALSAR image file."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from navfilters.numerics.validation import whole_number
from navfilters.sar.palsar.ceos_fields import Field, code_text, fault, take
from navfilters.sar.palsar.ceos_records import Record, descriptor, header

PREFIX = 412
"""Bytes before the samples of a line."""

_TICK = 1e-3  # s, of the lines' times

_HEADER = 128  # bytes of the prefix that are read; what follows has no agreed meaning

_CODES = b"\x32\x0a\x12\x14"  # 50 10 18 20

IMAGE = {
    "file name": Field(48, "A16", seen="A"),
    "number of signal records": Field(180, "I6", 2, 999_999, seen="A"),
    "signal record length": Field(186, "I6", PREFIX + 2, 999_999, seen="A"),
    "bits a sample": Field(216, "I4", seen="C"),
    "channels": Field(232, "I4"),
    "number of lines": Field(236, "I8", 2, 999_999, seen="A"),
    "samples a line": Field(248, "I8"),
    "interleave": Field(268, "A4"),
    "prefix bytes": Field(276, "I4", PREFIX, PREFIX, seen="A"),
    "format identifier": Field(400, "A28"),
}

LINE = {
    "record codes": Field(4, "C4", seen="A"),
    "record length": Field(8, "B4", seen="A"),
    "line number": Field(12, "B4", 1, 9_999_999, seen="A"),
    "left fill samples": Field(20, "B4", 0, 499_999, seen="A"),
    "data samples": Field(24, "B4", 1, 499_999, seen="A"),
    "right fill samples": Field(28, "B4", 0, 499_999, seen="A"),
    "year": Field(36, "B4", 2006, 2011, seen="A", why="ALOS flew from 2006 to 2011"),
    "day of year": Field(40, "B4", 1, 366, seen="A"),
    "millisecond of day": Field(44, "B4", 0, 86_400_999, seen="A"),
    "channel indicator": Field(48, "B2"),
    "transmit polarisation": Field(52, "B2", 0, 1, seen="B"),
    "receive polarisation": Field(54, "B2", 0, 1, seen="B"),
    "PRF in mHz": Field(56, "B4", 1_000_000, 5_000_000, seen="A"),
    "ScanSAR scan number": Field(
        60, "B4", 0, 0, seen="A", why="the bursts of ScanSAR are not read"
    ),
    "range compression": Field(
        64, "B2", 0, 0, seen="A", why="pulses that are compressed on board are not read"
    ),
    "chirp type": Field(66, "B2", 0, 0, seen="B", why="only a linear chirp is read"),
    "chirp length in ns": Field(68, "B4", 0, 100_000, seen="A"),
    "chirp constant term in Hz": Field(72, "S4"),
    "chirp linear term in Hz/us": Field(76, "S4", seen="B"),
    "missing-line flag": Field(96, "B4", 0, 1, seen="B"),
    "slant range in m": Field(116, "B4", 600_000, 1_300_000, seen="A"),
    "window position": Field(120, "B4"),  # its unit and zero are unknown: shown, never used
}

_CONSTANT = (
    "PRF in mHz",
    "chirp length in ns",
    "chirp linear term in Hz/us",
    "transmit polarisation",
    "receive polarisation",
)

_TYPES = {"B": ">u", "S": ">i", "C": "S"}

_HEADERS = np.dtype(
    {
        "names": list(LINE),
        "formats": [f"{_TYPES[field.kind[0]]}{field.size}" for field in LINE.values()],
        "offsets": [field.offset for field in LINE.values()],
        "itemsize": _HEADER,
    }
)


@dataclass(frozen=True, eq=False)
class Headers:
    """The prefixes of successive records of an image file.

    Parameters
    ----------
    descriptor : Record
    values : ndarray (records,)
        Structured, with a field for each of LINE.
    first : int
        The first of these records among all signal records of the file, 0-based.
    length : int
        Of each record, bytes.
    """

    descriptor: Record
    values: np.ndarray
    first: int
    length: int

    def start(self, index: np.ndarray) -> np.ndarray:
        """Bytes of the file that records start at."""
        return 720 + (self.first + index) * self.length

    def record(self, index: int) -> Record:
        """One prefix, as far as it is read."""
        start = 720 + (self.first + index) * self.length
        return Record(self.descriptor.path, start, self.values[index].tobytes(), LINE)

    def within(self, name: str, index: np.ndarray) -> np.ndarray:
        """A field (n,) of some records (n,), within its bounds."""
        values, field = self.values[name][index].astype(np.int64), LINE[name]
        self.refuse(name, index, (values < field.low) | (values > field.high), field.needed)
        return values

    def refuse(self, name: str, index: np.ndarray, bad: np.ndarray, needed: str) -> None:
        """Raise for the first bad one (n,) of some records (n,)."""
        if bad.any():
            record = self.record(int(index[np.argmax(bad)]))
            where = f" in line {record.text('line number')}"
            why = f": {LINE[name].why}" if LINE[name].why else ""
            raise record.error(name, f"{record.text(name)}{why}", needed, where)


def read_headers(path: Path, records: tuple[int, int] | None = None) -> Headers:
    """The prefixes of an image file's lines.

    Parameters
    ----------
    path : Path
    records : tuple of int, optional
        First and last signal record, 0-based, half-open; all of them by default.

    Returns
    -------
    Headers

    Raises
    ------
    ValueError
        Not the image file of a level-1.0 product, or one that is cut: nothing is allocated before
        the size of the file is known to fit.
    OSError
    """
    with open(path, "rb", buffering=0) as file:
        size = path.stat().st_size
        head = descriptor(file, path, size, None, IMAGE)
        _refuse_processed(head)
        codes, length = header(file, path, 720, size, "first signal record")
        if codes != _CODES:
            hint = ", processed data" if codes[1] == 11 else ""
            found, needed = f"{code_text(codes)}{hint}", f"{code_text(_CODES)}, raw signal data"
            raise fault(path, 724, "codes of the first signal record", found, needed)
        count = head.integer("number of signal records")
        if (said := head.integer("signal record length")) != length:
            raise head.error("signal record length", said, f"{length}, as the first record says")
        if size != 720 + count * length:
            needed = f"{720 + count * length} bytes long, 720 and {count} records of {length}"
            raise fault(path, min(size, 720 + count * length), "file", f"{size} bytes", needed)
        if (said := head.integer("number of lines", blank=count)) != count:
            raise head.error("number of lines", said, f"{count}, the number of signal records")
        head.integer("prefix bytes", blank=PREFIX)
        first, last = (0, count) if records is None else records
        first, last = whole_number("records[0]", first, 0), whole_number("records[1]", last, 0)
        if not first < last - 1 < count:
            needed = f"two or more of the {count} records (first, last), 0-based, half-open"
            raise ValueError(f"{path}: records must be {needed}; found {records}")
        prefixes = bytearray()
        for k in range(first, last):
            prefixes += take(file, path, 720 + k * length, _HEADER, "signal record")
    values = np.frombuffer(prefixes, _HEADERS)
    headers, every = Headers(head, values, first, length), np.arange(last - first)
    headers.refuse("record codes", every, values["record codes"] != _CODES, code_text(_CODES))
    headers.refuse("record length", every, values["record length"] != length, f"{length}")
    headers.within("missing-line flag", every)
    return headers


def _refuse_processed(head: Record) -> None:
    """Raise where the descriptor tells of another radar, or of samples that are no raw bytes."""
    if (name := head.text("file name")).startswith("AL2"):
        found = f"{name!r}: an image of PALSAR-2, another radar, which is not read"
        raise head.error("file name", found, "that of an image of ALOS's PALSAR")
    bits = head.text("bits a sample")
    if bits.isdigit() and 8 < int(bits) <= 64:
        found = f"{bits}: an image of a processed level, such as 1.1 or 1.5"
        raise head.error("bits a sample", found, "at most 8, as raw data of level 1.0 have")
