"""The grid of a PALSAR image's samples: lines, pulses and delays."""

import warnings
from dataclasses import dataclass
from datetime import date

import numpy as np

from navfilters.sar.palsar.ceos_fields import fault
from navfilters.sar.palsar.image_headers import _CONSTANT, _TICK, Headers
from navfilters.sar.palsar.leader_records import _DAY


@dataclass(frozen=True, eq=False)
class Grid:
    """Where the records with echoes lie on an even grid of lines.

    Parameters
    ----------
    good : ndarray (n,)
        Indices of the records.
    rows : ndarray (n,)
        Of the grid, for each of them.
    lines : int
        Rows of the grid.
    day : date
        UTC day of the first good line.
    times : ndarray (lines,)
        UTC seconds of the day.
    interval : float
        Between lines, s.
    """

    good: np.ndarray
    rows: np.ndarray
    lines: int
    day: date
    times: np.ndarray
    interval: float


def grid(headers: Headers, without_echo: np.ndarray) -> Grid:
    """Lines by their numbers and times.

    A line's time is cut to whole milliseconds: the start of an even grid is the middle of what the
    times of all lines allow.

    Parameters
    ----------
    headers : Headers
    without_echo : ndarray (records,) of bool
        Records to leave out; nothing in them is looked at.

    Returns
    -------
    Grid

    Raises
    ------
    ValueError
        Another mode, line numbers that do not rise, times that do not follow them, or a rate,
        pulse or polarisation that changes.
    """
    good = np.flatnonzero(~without_echo)
    if len(good) < 2:
        needed = "at least 2 records that are not missing"
        raise fault(
            headers.descriptor.path, 720, "image", f"{len(good)} of {len(without_echo)}", needed
        )
    for name in ("ScanSAR scan number", "range compression", "chirp type"):
        headers.within(name, good)
    number = headers.within("line number", good)
    falls = np.r_[False, np.diff(number) <= 0]
    headers.refuse("line number", good, falls, "above that of the line before")
    rows = number - number[0] + good[0]
    lines = int(rows[-1]) + len(without_echo) - int(good[-1])
    headers.refuse(
        "line number", good, rows >= 2 * len(without_echo), "such that half of the lines are there"
    )
    for name in _CONSTANT:
        _check_constant(headers, good, name)
    interval = line_interval(int(headers.within("PRF in mHz", good)[0]))
    years = np.array([date(year, 1, 1).toordinal() for year in range(2006, 2012)])
    days = years[headers.within("year", good) - 2006] + headers.within("day of year", good) - 1
    clock = (days - days[0]) * _DAY + headers.within("millisecond of day", good) * _TICK
    late = clock - rows * interval
    _check_dates(headers, good, days, late)
    spread = np.maximum.accumulate(late) - np.minimum.accumulate(late)
    headers.refuse(
        "millisecond of day",
        good,
        spread > 2 * _TICK,
        f"within 2 ms of even steps of {1e6 * interval:.6g} us a line number",
    )
    if spread[-1] > 1.05 * _TICK:
        warnings.warn(
            f"{headers.descriptor.path}: line times lie {1e3 * spread[-1]:.2f} ms apart about even "
            "steps, and cutting to whole milliseconds explains 1 ms",
            stacklevel=3,
        )
    start = (late.max() + late.min() + _TICK) / 2
    times = start + interval * np.arange(lines)
    return Grid(good, rows, lines, date.fromordinal(int(days[0])), times, interval)


def _check_constant(headers: Headers, good: np.ndarray, name: str) -> None:
    """Raise for the first line at which a field changes, with the parts that can be opened."""
    value = headers.values[name][good]
    changed = value != value[0]
    k = int(np.argmax(changed))
    split, end = headers.first + int(good[k]), headers.first + len(headers.values)
    sides = [(headers.first, split)] if k > 1 else []
    if len(value) > k + 1 and (value[k:] == value[k]).all():
        sides.append((split, end))
    parts = " or ".join(map(str, sides))
    cure = f"; records={parts} open{'' if len(sides) > 1 else 's'} one side" if sides else ""
    headers.refuse(name, good, changed, f"{value[0]} as in the lines before{cure}")


def _check_dates(headers: Headers, good: np.ndarray, days: np.ndarray, late: np.ndarray) -> None:
    """Raise for the first line whose date is not the one that the lines before lead to.

    What each line's clock is ahead of even steps (n,) is in s.
    """
    step = np.r_[0.0, np.diff(late)]
    off = np.rint(step / _DAY)
    jumps = (off != 0) & (np.abs(step - off * _DAY) <= 2 * _TICK)
    if jumps.any():
        k = int(np.argmax(jumps))
        due = date.fromordinal(int(days[k] - off[k]))
        name, value = "day of year", due.timetuple().tm_yday
        if headers.values["year"][good[k]] != due.year:
            name, value = "year", due.year
        headers.refuse(name, good, jumps, f"{value}: {due}, to which the lines before lead")


def line_interval(prf: int) -> float:
    """Time between the lines of a channel.

    Parameters
    ----------
    prf : int
        As in the file, mHz.

    Returns
    -------
    float
        s: a whole number of microseconds where the rate is one to its last digit.

    Notes
    -----
    A rate above 3000 Hz is that of two alternating polarisations.
    """
    whole = round(1e9 / prf)
    interval = whole * 1e-6 if abs(1e9 / whole - prf) <= 0.5 else 1e3 / prf
    return interval if prf <= 3_000_000 else 2 * interval
