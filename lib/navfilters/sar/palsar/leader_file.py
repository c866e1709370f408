"""The leader file of a PALSAR product."""

import warnings
from dataclasses import dataclass
from io import FileIO
from pathlib import Path

from navfilters.sar.palsar.ceos_fields import code_text, fault, take
from navfilters.sar.palsar.ceos_records import HEADER, Record, descriptor, header
from navfilters.sar.palsar.leader_records import _LATER, _NAMES, _PROCESSED, _USED, LEADER, SUMMARY


@dataclass(frozen=True)
class Leader:
    """The records of a leader file.

    Parameters
    ----------
    descriptor, summary, position : Record
        The three that are used.
    records : tuple of (int, str, int)
        Start, codes and length in bytes of each.
    """

    descriptor: Record
    summary: Record
    position: Record
    records: tuple[tuple[int, str, int], ...]


def read_leader(path: Path) -> Leader:
    """Walk through a leader file.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Leader

    Raises
    ------
    ValueError
        Not the leader file of a level-1.0 product, or one that is cut.
    OSError
    """
    found: dict[int, Record] = {}
    with open(path, "rb", buffering=0) as file:
        size = path.stat().st_size
        head = descriptor(file, path, size, 11, LEADER)
        counts = [
            head.integer(name, blank=int(field.low))
            for name, field in LEADER.items()
            if field.kind == "I6"
        ]
        counted = 1 + sum(counts) + _more_facilities(head)
        records, start = [(0, code_text(head.data[4:8]), 720)], 720
        while start < size or len(records) < counted:
            number = len(records) + 1
            which = f"record {number} of {counted}" if number <= counted else f"record {number}"
            if start == size:
                raise fault(path, start, which, "the end of the file", "there")
            if len(records) >= counted and not _is_record(file, start, size):
                warnings.warn(
                    f"{path}, byte {start}: {size - start} bytes after the last of {counted} "
                    "records are no record, and are not read",
                    stacklevel=3,
                )
                break
            codes, length = header(file, path, start, size, _called(file, which, start))
            if codes[1] in _USED and codes[1] not in found:
                name, needed, fields = _USED[codes[1]]
                if length != needed:
                    raise fault(path, start + 8, f"length of the {name}", length, f"{needed}")
                found[codes[1]] = Record(path, start, take(file, path, start, length, name), fields)
                if fields is SUMMARY:  # before any other record: its layout may be another's
                    _refuse_foreign(found[codes[1]])
            records.append((start, code_text(codes), length))
            start += length
    for code, (name, _, _) in _USED.items():
        if code not in found:
            types = ", ".join(text.split()[1] for _, text, _ in records[1:])
            raise fault(path, 720 + 5, "type codes of the records", types, f"{code}, {name}, too")
    return Leader(head, found[10], found[30], tuple(records))


def _more_facilities(head: Record) -> int:
    """Records of further facilities: leaders go on with pairs of a count (6) and a length (8)."""
    total = 0
    for offset in range(434, 707, 14):
        pair = head.data[offset : offset + 6].strip(), head.data[offset + 6 : offset + 14].strip()
        if not (all(text.isdigit() for text in pair) and int(pair[0]) <= 99):
            break
        total += int(pair[0])
    return total


def _is_record(file: FileIO, start: int, size: int) -> bool:
    """Whether what follows the counted records begins as a leader's records do."""
    file.seek(start)
    return size - start >= HEADER and file.read(HEADER)[4:7:2] == b"\x12\x12"


def _called(file: FileIO, which: str, start: int) -> str:
    """The number of a record, and its kind if that is known."""
    file.seek(start)
    codes = file.read(HEADER)[4:8]
    name = _NAMES.get(codes[1]) if len(codes) > 1 and codes[0] == 0x12 else None
    return f"{which} ({name})" if name else which


def _refuse_foreign(summary: Record) -> None:
    """Raise where the texts tell of another satellite, agency or level."""
    platform = summary.text("platform")
    if platform != "ALOS":
        hint = _LATER.get(platform.replace("-", "")[:5], "")
        raise summary.error("platform", f"{platform!r}{hint}", "ALOS")
    if summary.text("facility").startswith("ERSDAC"):
        raise summary.error("facility", "ERSDAC", "one that writes the agency's own layout")
    system, level = summary.text("processing system"), summary.text("level")
    if system.startswith("SKY"):
        raise summary.error("processing system", repr(system), "one of the agency's own layout")
    if level and "1.0" not in level:
        hint = next((text for name, text in _PROCESSED.items() if name in level), "")
        needed = "1.0, raw signal data, of which images are formed here"
        raise summary.error("level", f"{level!r}{hint}", needed)
