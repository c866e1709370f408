"""The leader file of an ALOS PALSAR level-1.0 product.

The tables give 0-based offsets from the start of a record and the values that are possible.
"""

import datetime
import warnings
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import NamedTuple

import numpy as np

from navfilters.sar._ceos import (
    HEADER,
    SPEED_OF_LIGHT,
    Field,
    Record,
    agreed,
    code_text,
    descriptor,
    fault,
    header,
    take,
)

_DAY = 86400.0

LEADER = {
    "file name": Field(48, "A16"),
    "number of data set summary records": Field(180, "I6", 1, 1),
    "number of map projection records": Field(192, "I6", 0, 1),
    "number of platform position records": Field(204, "I6", 1, 1),
    "number of attitude records": Field(216, "I6", 0, 1),
    **{
        f"number of records at byte {offset}": Field(offset, "I6", 0, 99)
        for offset in (*range(228, 349, 12), 420)
    },
}

SUMMARY = {
    "scene": Field(20, "A32"),
    "scene centre time": Field(68, "A32"),
    "ellipsoid": Field(164, "A16"),
    "platform": Field(396, "A16"),
    "sensor and mode": Field(412, "A32"),
    "orbit number": Field(444, "A8"),
    "clock angle in deg": Field(476, "F8"),
    "incidence in deg": Field(484, "F8"),
    "frequency in GHz": Field(492, "F8", 0, 10),
    "wavelength in m": Field(500, "F16", 0.2, 0.3),
    "chirp rate in Hz/s": Field(550, "F16", -1e13, 1e13),
    "sampling rate in MHz": Field(710, "F16", 1, 100),
    "range gate in us": Field(726, "F16"),
    "pulse length in us": Field(742, "F16", 0, 100),
    "quantisation bits": Field(798, "I8"),
    "DC bias of I": Field(818, "F16", 1, 31),
    "DC bias of Q": Field(834, "F16", 1, 31),
    "PRF in mHz": Field(934, "F16"),
    "facility": Field(1046, "A16"),
    "processing system": Field(1062, "A8"),
    "version": Field(1070, "A8"),
    "level": Field(1094, "A16"),
    "direction along a line": Field(1534, "A8"),
    "Doppler constant term": Field(1734, "F16"),  # of processed images: shown, never used
    "Doppler linear term": Field(1750, "F16"),
    "calibration data": Field(1766, "I4", 0, 1),
    "first calibration line at the top": Field(1770, "I8", 0, 9_999_999),
    "last calibration line at the top": Field(1778, "I8", 0, 9_999_999),
    "first calibration line at the bottom": Field(1786, "I8", 0, 9_999_999),
    "last calibration line at the bottom": Field(1794, "I8", 0, 9_999_999),
    "PRF changes": Field(1802, "I4"),
    "line of PRF change": Field(1806, "I8"),
    "yaw steering off": Field(1830, "I4"),
    "off-nadir angle in deg": Field(1838, "F16"),
    "beam number": Field(1854, "I4"),
}

_POINT = 132  # bytes a state vector
_STATE = {
    **{f"{axis} in m": Field(386 + 22 * i, "F22", -7.3e6, 7.3e6) for i, axis in enumerate("xyz")},
    **{f"v{axis} in m/s": Field(452 + 22 * i, "F22", -8e3, 8e3) for i, axis in enumerate("xyz")},
}
POSITION = {
    "orbit kind": Field(12, "A32"),
    "number of points": Field(140, "I4", 8, 28),
    "year": Field(144, "I4", 2006, 2011),  # from launch to the end of the mission
    "month": Field(148, "I4", 1, 12),
    "day": Field(152, "I4", 1, 31),
    "day of year": Field(156, "I4", 1, 366),
    "second of day": Field(160, "F22", 0, _DAY),
    "interval in s": Field(182, "F22", 1, 300),
    "frame": Field(204, "A64"),
    **_STATE,
    "leap second flag": Field(4100, "I1", 0, 9),
}

_USED = {10: ("data set summary", 4096, SUMMARY), 30: ("platform position", 4680, POSITION)}
_NAMES = {
    **{code: name for code, (name, _, _) in _USED.items()},
    20: "map projection",
    40: "attitude",
    50: "radiometric",
    60: "data quality",
    130: "calibration",
    200: "facility related",
}
_LATER = {
    "ALOS2": ": a product of PALSAR-2, another radar, which is not read",
    "ALOS4": ": a product of PALSAR-3, another radar, which is not read",
}
_PROCESSED = {
    "1.1": ", an image that is focused already",
    "1.5": ", an image that is focused and projected already",
}


class StateVectors(NamedTuple):
    """The satellite's motion in the Earth-fixed frame.

    Parameters
    ----------
    times : ndarray (n,)
        UTC seconds of the product's day: negative before it, 86400 and more after it.
    positions : ndarray (n, 3)
        m.
    velocities : ndarray (n, 3)
        Relative to the turning Earth, m/s.
    """

    times: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray


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
    name = _NAMES.get(codes[1]) if codes[:1] == b"\x12" else None
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


def state_vectors(position: Record, day: datetime.date) -> StateVectors:
    """The orbit in a leader file.

    Parameters
    ----------
    position : Record
    day : datetime.date
        That times count from.

    Returns
    -------
    StateVectors

    Raises
    ------
    ValueError
        Another frame, an impossible date, motion that no satellite has, or velocities that are not
        the rates of the positions.
    """
    if not position.text("frame").startswith("ECR"):
        raise position.error("frame", repr(position.text("frame")), "ECR, Earth-fixed")
    year, month, date = (position.integer(name) for name in ("year", "month", "day"))
    try:
        start = datetime.date(year, month, date)
    except ValueError as error:
        raise position.error("day", f"{date} ({error})", "a day of the month") from None
    of_year = start.timetuple().tm_yday
    if (said := position.integer("day of year")) != of_year:
        raise position.error("day of year", said, f"{of_year}, as the date {start} says")
    if position.integer("leap second flag", blank=0):
        warnings.warn(
            f"{position.path}: the orbit may hold a leap second, which its times do not show",
            stacklevel=3,
        )
    count, interval = position.integer("number of points"), position.number("interval in s")
    first = (start - day).days * _DAY + position.number("second of day")
    state = np.array(
        [[position.number(name, shift=_POINT * k) for name in _STATE] for k in range(count)]
    )
    r, v = state[:, :3], state[:, 3:]
    _check(position, "x in m", r, "a radius from 6.9e6 to 7.3e6 m", 6.9e6, 7.3e6)
    _check(position, "vx in m/s", v, "a speed from 7000 to 8000 m/s", 7e3, 8e3)
    moved, rate = np.diff(r, axis=0) / interval, (v[1:] + v[:-1]) / 2
    # The trapezoid is off by (orbital rate * interval)^2 / 12 of the speed, 0.03 % at a minute and
    # 0.8 % at five; inertial velocities are off by 6 %.
    off = np.linalg.norm(moved - rate, axis=1) / np.linalg.norm(rate, axis=1)
    if (off > 0.01).any():
        k = int(np.argmax(off > 0.01))
        offset = position.start + POSITION["vx in m/s"].offset + _POINT * k
        found = f"{100 * off[k]:.1f} % from it"
        raise fault(position.path, offset, "velocity", found, "the rate of the positions")
    return StateVectors(first + interval * np.arange(count), r, v)


def _check(
    position: Record, name: str, vectors: np.ndarray, needed: str, low: float, high: float
) -> None:
    """Raise for the first of (n, 3) vectors whose length is out of bounds."""
    length = np.linalg.norm(vectors, axis=1)
    bad = (length < low) | (length > high)
    if bad.any():
        k = int(np.argmax(bad))
        offset = position.start + POSITION[name].offset + _POINT * k
        raise fault(position.path, offset, f"vector that starts with {name}", length[k], needed)


def pulse(summary: Record, line: Record, sampling_rate: float) -> tuple[float, float]:
    """The transmitted pulse, if leader and image agree on it.

    Parameters
    ----------
    summary : Record
    line : Record
        Prefix of a line.
    sampling_rate : float
        Hz.

    Returns
    -------
    rate : float
        Hz/s, negative whatever the sign in the file, which readers do not agree on.
    length : float
        s.

    Raises
    ------
    ValueError
        Nothing given, two that differ by more than 1 %, or a band wider than the sampling rate.
    """
    length = agreed(
        "pulse length in s",
        (summary, "pulse length in us", 1e-6 * summary.number("pulse length in us", blank=0)),
        (line, "chirp length in ns", 1e-9 * line.number("chirp length in ns")),
    )
    slope = 1e6 * line.number("chirp linear term in Hz/us")
    rate = agreed(
        "magnitude of the chirp rate in Hz/s",
        (summary, "chirp rate in Hz/s", abs(summary.number("chirp rate in Hz/s", blank=0))),
        (line, "chirp linear term in Hz/us", abs(slope)),
    )
    if rate * length > sampling_rate:
        needed = f"one whose band over {length:.6g} s fits {sampling_rate:.6g} Hz"
        raise summary.error("chirp rate in Hz/s", f"{rate:.6g}", needed)
    return -rate, length


def wavelength(summary: Record) -> float:
    """Of the carrier, m, if the frequency does not contradict it.

    Parameters
    ----------
    summary : Record

    Returns
    -------
    float

    Raises
    ------
    ValueError
    """
    frequency = 1e9 * summary.number("frequency in GHz", blank=0)
    return agreed(
        "wavelength in m",
        (summary, "wavelength in m", summary.number("wavelength in m")),
        (summary, "frequency in GHz", SPEED_OF_LIGHT / frequency if frequency else 0.0),
    )
