"""Tracking files: one measurement a line, and settings as ``key [i] = value``."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

COMPONENTS = {"RANGE": (0,), "AZ_EL": (1, 2)}
"""Kinds of measurement, and which of (range, azimuth, elevation) each gives."""

_SETTING = re.compile(r"^(?P<key>[\w.]+)\s*(?:\[(?P<index>\d+)\])?\s*=\s*(?P<value>.*?)\s*;?$")


@dataclass(frozen=True, eq=False)
class Observations:
    """Ranges, azimuths and elevations, in the order of time.

    Parameters
    ----------
    time : array (N,)
        Of reception, s after the epoch.
    station : int array (N,)
        Number in ``stations``.
    z : array (N, 3)
        Range, m; azimuth and elevation, rad; NaN where it was not measured.
    stations : tuple of str
    """

    time: np.ndarray
    station: np.ndarray
    z: np.ndarray
    stations: tuple[str, ...]


def read_observations(path: Path, stations: tuple[str, ...], epoch: datetime) -> Observations:
    """Observations of a file with lines of date, kind, station and values, km and deg.

    Parameters
    ----------
    path : path
        Lines that begin with # are comments.
    stations : tuple of str
        The names that may occur.
    epoch : datetime
        UTC; no second may be inserted between it and the measurements.

    Returns
    -------
    Observations

    Raises
    ------
    ValueError
        Naming file and line, what was found and what is needed.
    """
    rows = []
    for where, line in _lines(path):
        words = line.split()
        kind = words[1] if len(words) > 1 else ""
        if kind not in COMPONENTS:
            raise ValueError(f"{where}: a kind of {sorted(COMPONENTS)} is needed; found {kind!r}")
        components = COMPONENTS[kind]
        if len(words) != 3 + len(components):
            raise ValueError(
                f"{where}: date, kind, station and {len(components)} values are needed for {kind}; "
                f"found {len(words)} words"
            )
        if words[2] not in stations:
            raise ValueError(f"{where}: a station of {list(stations)} is needed; found {words[2]}")
        z = np.full(3, np.nan)
        given = [_number(word, where) for word in words[3:]]
        z[list(components)] = np.multiply(given, 1e3) if kind == "RANGE" else np.radians(given)
        time = (_date(words[0], where) - epoch).total_seconds()
        rows.append((time, stations.index(words[2]), z))
    if not rows:
        raise ValueError(f"{path}: at least one measurement is needed; found none")
    rows.sort(key=lambda row: row[0])
    times, numbers, values = map(np.array, zip(*rows, strict=True))
    return Observations(times, numbers, values, tuple(stations))


@dataclass(frozen=True, eq=False)
class Settings:
    """Settings of a file, each the text after its equals sign.

    Parameters
    ----------
    path : path
    values : dict
        By (key, index), index None where the line has none.
    """

    path: Path
    values: dict[tuple[str, int | None], str]

    def text(self, key: str, index: int | None = None) -> str:
        """A setting as it stands; ValueError naming the key where there is none."""
        if (key, index) not in self.values:
            at = "" if index is None else f" [{index}]"
            raise ValueError(f"{self.path}: a line '{key}{at} = ...' is needed; found none")
        return self.values[key, index]

    def number(self, key: str, index: int | None = None) -> float:
        """A setting that is one number."""
        return _number(self.text(key, index), f"{self.path}, {key}")

    def date(self, key: str) -> datetime:
        """A setting that is a date."""
        return _date(self.text(key), f"{self.path}, {key}")

    def count(self, key: str) -> int:
        """How many of a key there are, [0] to [count - 1]."""
        return sum(name == key and index is not None for name, index in self.values)

    def numbers(self, key: str) -> np.ndarray:
        """All of an indexed key, (count,)."""
        return np.array([self.number(key, i) for i in range(self.count(key))])


def read_settings(path: Path) -> Settings:
    """Settings of a file with lines ``key = value`` or ``key [i] = value``.

    Parameters
    ----------
    path : path
        Lines that begin with # are comments.

    Returns
    -------
    Settings

    Raises
    ------
    ValueError
        A line without an equals sign, or a key for the second time, by file and line.
    """
    values: dict[tuple[str, int | None], str] = {}
    for where, line in _lines(path):
        match = _SETTING.match(line)
        if match is None:
            raise ValueError(f"{where}: 'key = value' or 'key [i] = value' is needed; found {line}")
        key = match["key"], None if match["index"] is None else _count(match["index"], where)
        if key in values:
            raise ValueError(f"{where}: a key may stand once; found {match['key']} again")
        values[key] = match["value"]
    return Settings(Path(path), values)


def read_coefficients(path: Path, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Fully normalised coefficients of a gravity field from lines of n, m, C, S, ...

    Parameters
    ----------
    path : path
    degree : int
        The last degree that is wanted, with all orders.

    Returns
    -------
    tuple of array (degree + 1, degree + 1)
        C and S by degree and order; 0 above the diagonal, in degree 1 and where the file has none.

    Raises
    ------
    ValueError
        By file and line, or a file that ends before the degree.
    """
    C, S = np.zeros((2, degree + 1, degree + 1))
    last = -1
    for where, line in _lines(path):
        words = line.split()
        if len(words) < 4 or not (words[0].isdecimal() and words[1].isdecimal()):
            raise ValueError(f"{where}: degree, order, C and S are needed; found {line}")
        n, m = (_count(word, where) for word in words[:2])
        if m > n:
            raise ValueError(f"{where}: an order of at most the degree {n} is needed; found {m}")
        last = max(last, n)
        if n <= degree:
            C[n, m], S[n, m] = (_number(word, where) for word in words[2:4])
    if last < degree:
        raise ValueError(f"{path}: coefficients to degree {degree} are needed; found {last}")
    return C, S


def _lines(path: Path) -> Iterator[tuple[str, str]]:
    with open(path, "rb") as file:
        for number, raw in enumerate(file, 1):
            where = f"{path}, line {number}"
            try:
                line = raw.decode("utf-8").strip()
            except UnicodeDecodeError as error:
                found = raw[error.start : error.end]
                raise ValueError(f"{where}: text in UTF-8 is needed; found {found!r}") from None
            if line and not line.startswith("#"):
                yield where, line


def _count(digits: str, where: str) -> int:
    if len(digits) > 9:
        raise ValueError(f"{where}: a number of at most 9 digits is needed; found {len(digits)}")
    return int(digits)


def _number(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise ValueError(f"{where}: a finite number is needed; found {text!r}")
    return value


def _date(text: str, where: str) -> datetime:
    try:
        date = datetime.fromisoformat(text)
    except ValueError:
        date = None
    if date is None or date.tzinfo is not None:
        raise ValueError(f"{where}: a date as 2010-11-02T03:00:13.3851 is needed; found {text!r}")
    return date
