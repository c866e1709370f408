"""Orbit, pulse and wavelength from a leader file."""

import datetime
import warnings
from typing import NamedTuple

import numpy as np

from navfilters.sar.palsar.ceos_fields import SPEED_OF_LIGHT, fault
from navfilters.sar.palsar.ceos_records import Record, agreed
from navfilters.sar.palsar.leader_records import _DAY, _POINT, _STATE, POSITION


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
        if summary.number("chirp rate in Hz/s", blank=0):
            raise summary.error("chirp rate in Hz/s", f"{rate:.6g}", needed)
        raise line.error("chirp linear term in Hz/us", f"{1e-6 * rate:.6g}", needed)
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
