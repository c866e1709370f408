"""A filter's log: times, innovations with their covariances, and errors where a truth is known."""

import csv
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.extras import needed
from navfilters.runs import stored_arrays
from navfilters.types import Array

_VECTOR = re.compile(r"(innovation|error)_(\d+)")
_MATRIX = re.compile(r"([SP])_(?:(\d)(\d)|(\d+)_(\d+))")


SYMMETRY = 1e-3
"""Largest difference of a covariance from its transpose, as a correlation, that says nothing: of a
filter in single precision, or of numbers that were written with few digits."""


class LogError(ValueError):
    """A log that cannot be read; says where and what is needed."""


@dataclass(frozen=True, eq=False)
class Log:
    """What a filter wrote down.

    Parameters
    ----------
    time : array (k,)
        Of each update, in any unit; does not decrease.
    innovation : array (k, m)
        Measured minus expected; NaN where it was not measured.
    S : array (k, m, m)
        The covariance that the filter gave the innovation.
    error : array (k, n), optional
        Estimate minus truth after the update.
    P : array (k, n, n), optional
        The covariance that the filter gave the error. Needed with ``error``.
    ignored : tuple of str
        Columns of the file that were not used.

    Raises
    ------
    LogError
        Shapes that do not fit, times that decrease or are not finite, no update, an innovation
        that was measured and has no variance or is infinite, an S or P that is not symmetric.
    """

    time: Array
    innovation: Array
    S: Array
    error: Array | None = None
    P: Array | None = None
    ignored: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, axes in (("time", 1), ("innovation", 2), ("S", 3), ("error", 2), ("P", 3)):
            value = getattr(self, name)
            if value is None:
                continue
            value = validation.real_array(name, value, "", finite=False)
            if value.ndim != axes:
                raise LogError(f"{name} must have {axes} axes; found shape {value.shape}")
            object.__setattr__(self, name, value)
        _fits("innovation", self.innovation, "S", self.S, len(self.time))
        if (self.error is None) != (self.P is None):
            raise LogError("error and P belong together; found one of them")
        if self.error is not None:
            _fits("error", self.error, "P", self.P, len(self.time))
        _times(self.time)
        if np.isinf(self.innovation).any():
            row, channel = np.argwhere(np.isinf(self.innovation))[0]
            raise LogError(
                "innovation must be finite, or NaN where it was not measured; found innovation_"
                f"{channel + 1} = {self.innovation[row, channel]} at time {self.time[row]:g}"
            )
        for name, matrix in (("S", self.S), ("P", self.P)):
            _symmetric(name, matrix, self.time)
        measured = np.isfinite(self.innovation)
        blind = measured & ~np.isfinite(np.diagonal(self.S, axis1=1, axis2=2))
        if blind.any():
            row, channel = np.argwhere(blind)[0]
            raise LogError(
                f"S must be finite where there is an innovation; found S_{channel + 1}{channel + 1}"
                f" = {self.S[row, channel, channel]} at time {self.time[row]:g}"
            )


def _fits(name: str, vector: Array, other: str, matrix: Array | None, count: int) -> None:
    assert matrix is not None
    size = vector.shape[1]
    if vector.shape != (count, size) or matrix.shape != (count, size, size) or not size:
        raise LogError(
            f"time, {name} and {other} must have shapes (k,), (k, n) and (k, n, n) with n at least "
            f"1; found ({count},), {vector.shape} and {matrix.shape}"
        )


def _symmetric(name: str, matrix: Array | None, time: Array) -> None:
    if matrix is None:
        return
    variance = np.diagonal(matrix, axis1=1, axis2=2)
    deviation = np.sqrt(np.where(variance > 0, variance, np.inf))  # an indefinite one is a finding
    allowed = SYMMETRY * deviation[:, :, None] * deviation[:, None, :]
    with np.errstate(invalid="ignore"):
        apart = np.argwhere(np.abs(matrix - matrix.mT) > allowed)  # NaN is no difference
    if len(apart):
        k, i, j = apart[0]
        raise LogError(
            f"{name} must be symmetric; found {_names(name, i + 1, j + 1)[0]} = {matrix[k, i, j]:g}"
            f" and {_names(name, j + 1, i + 1)[0]} = {matrix[k, j, i]:g} at time {time[k]:g}"
        )


def _times(time: Array) -> None:
    if not len(time):
        raise LogError("time must hold at least one update; found none")
    if not np.isfinite(time).all():
        raise LogError(f"time must be finite; found {time[~np.isfinite(time)][0]}")
    back = np.flatnonzero(np.diff(time) < 0)
    if back.size:
        before, after = time[back[0]], time[back[0] + 1]
        raise LogError(f"time must not decrease; found {after:g} after {before:g}")


def read_log(path: str | Path) -> Log:
    """Read a log from a CSV file with a header, or from a Parquet file.

    Parameters
    ----------
    path : path
        Columns: ``time``; ``innovation_1`` to ``innovation_m``; ``S_11``, ``S_12``, ... of one
        triangle or of both (``S_1_10`` from ten channels on); and, where a truth is known,
        ``error_1`` to ``error_n`` with ``P_11``, ... An empty cell was not measured. Other columns
        are named in ``ignored``.

    Returns
    -------
    Log

    Raises
    ------
    LogError
        A missing column, a cell that is no number, an empty file.
    ImportError
        Parquet without pyarrow.
    """
    path = Path(path)
    columns = _parquet(path) if path.suffix == ".parquet" else _csv(path)
    if "time" not in columns:
        raise LogError(f"{path}: column time is needed; found {', '.join(columns) or 'none'}")
    innovation, S = _block(path, columns, "innovation", "S")
    if innovation is None:
        raise LogError(f"{path}: column innovation_1 is needed; found {', '.join(columns)}")
    error, P = _block(path, columns, "error", "P")
    ignored = tuple(name for name in columns if not _used(name))
    try:
        return Log(columns["time"], innovation, S, error, P, ignored)
    except LogError as fault:
        raise LogError(f"{path}: {fault}") from None


def write_log(log: Log, path: str | Path) -> Path:
    """Write a log that :func:`read_log` reads, all of it or nothing.

    Parameters
    ----------
    log : Log
    path : path
        A CSV file; with the ending .parquet a Parquet file, which needs pyarrow.

    Returns
    -------
    Path

    Raises
    ------
    OSError
        It cannot be written; naming the file, which is as it was.
    """
    path, columns = Path(path), {"time": log.time}
    for name, vector, matrix, cov in (
        ("innovation", log.innovation, "S", log.S),
        ("error", log.error, "P", log.P),
    ):
        if vector is None or cov is None:
            continue
        size = vector.shape[1]
        columns |= {f"{name}_{i + 1}": vector[:, i] for i in range(size)}
        for i in range(size):
            columns |= {_names(matrix, i + 1, j + 1)[0]: cov[:, i, j] for j in range(i, size)}
    if path.suffix == ".parquet":
        parquet = needed("pyarrow.parquet", "pyarrow", "a log in Parquet")
        pyarrow = needed("pyarrow", "pyarrow", "a log in Parquet")
        whole = io.BytesIO()
        parquet.write_table(pyarrow.table(columns), whole)
        stored_arrays.write(path, whole.getvalue())
        return path
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(columns)
    for row in zip(*columns.values(), strict=True):
        table.writerow("" if np.isnan(x) else repr(float(x)) for x in row)
    stored_arrays.write(path, text.getvalue().encode())
    return path


def _csv(path: Path) -> dict[str, np.ndarray]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = list(csv.reader(file))
    except (UnicodeDecodeError, csv.Error) as error:
        raise LogError(f"{path}: a CSV file in UTF-8 is needed; found {error}") from None
    if not rows:
        raise LogError(f"{path}: a line of column names is needed; found an empty file")
    names = [name.strip() for name in rows[0]]
    double = {name for name in names if names.count(name) > 1}
    if double:
        raise LogError(f"{path}: column names must differ; found {sorted(double)[0]} twice")
    filled = [(i, row) for i, row in enumerate(rows[1:], 2) if row]
    for line, row in filled:
        if len(row) != len(names):
            raise LogError(f"{path}, line {line}: {len(names)} cells are needed; found {len(row)}")
    columns: dict[str, np.ndarray] = {name: np.empty(0) for name in names}
    for name in filter(_used, names):
        j = names.index(name)
        columns[name] = np.array([_number(path, line, name, row[j]) for line, row in filled])
    return columns


def _used(name: str) -> bool:
    """Whether a column of this name belongs to a log."""
    return bool(name == "time" or _VECTOR.fullmatch(name) or _MATRIX.fullmatch(name))


def _number(path: Path, line: int, name: str, cell: str) -> float:
    try:
        return float(cell) if cell.strip() else np.nan
    except ValueError:
        raise LogError(f"{path}, line {line}: {name} must be a number; found {cell!r}") from None


def _parquet(path: Path) -> dict[str, np.ndarray]:
    parquet = needed("pyarrow.parquet", "pyarrow", "a log in Parquet")
    try:
        dataset = parquet.ParquetDataset(path)
        names = dataset.schema.names
        table = dataset.read([name for name in names if _used(name)])
        table.validate(full=True)  # Arrow's readers may return what is not valid, and say so
        arrays = {name: table[name].to_numpy() for name in table.column_names}
    except FileNotFoundError:
        raise
    except Exception as error:  # pyarrow raises nearly anything
        raise LogError(f"{path}: a Parquet file is needed; found: {error}") from None
    columns = {name: np.empty(0) for name in names}
    for name, values in arrays.items():
        if values.dtype.kind not in "iuf":
            raise LogError(f"{path}: {name} must be numbers; found {table[name].type}")
        columns[name] = values.astype(float)
    return columns


def _block(
    path: Path, columns: Mapping[str, np.ndarray], vector: str, matrix: str
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """A vector and its covariance from their columns; None without any."""
    found = [m for name in columns if (m := _VECTOR.fullmatch(name)) and m[1] == vector]
    size = len(found)
    if not size:
        return None, None
    names = [f"{vector}_{i}" for i in range(1, size + 1)]
    _all_of(path, names, columns)
    cov = np.empty((len(columns["time"]), size, size))
    for i in range(size):
        for j in range(i, size):
            upper, lower = (_names(matrix, a + 1, b + 1) for a, b in ((i, j), (j, i)))
            known = [columns[name] for name in (*upper, *lower) if name in columns]
            if not known:
                raise LogError(f"{path}: column {upper[0]} is needed; write 0 if it is zero")
            one, other = known[0], known[-1]  # both triangles, or one
            cov[:, i, j] = np.where(np.isnan(one), other, one)
            cov[:, j, i] = np.where(np.isnan(other), one, other)
    return np.stack([columns[name] for name in names], axis=1), cov


def _names(matrix: str, i: int, j: int) -> list[str]:
    short = [f"{matrix}_{i}{j}"] if i < 10 and j < 10 else []
    return [*short, f"{matrix}_{i}_{j}"]


def _all_of(path: Path, names: Sequence[str], columns: Mapping[str, np.ndarray]) -> None:
    for name in names:
        if name not in columns:
            raise LogError(f"{path}: column {name} is needed; found {', '.join(columns)}")
