"""Whether the innovations of one run are what the filter says that they are."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from navfilters.diagnosis.channels import Channel, channel
from navfilters.diagnosis.log_file import Log
from navfilters.numerics import validation
from navfilters.numerics.chi_square import quantile
from navfilters.numerics.small_matrices import EPS, cholesky
from navfilters.runs.chi_square import tail_of
from navfilters.runs.consistency import nees
from navfilters.types import Array


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What was found in a log.

    Parameters
    ----------
    time : array (k,)
        Of each update.
    nis : array (k,)
        Normalised innovation squared; NaN where nothing was measured.
    dof : int array (k,)
        How many components were measured: what the NIS is on the average, if the filter is right.
    ratio, low, high : float
        Sum of the NIS over the sum of ``dof``, and the band of a filter that is right.
    windows : array (w, 4)
        First and last time of each window, its ratio over the ends of its band: below 1 and above
        1, in that order, where it is inside.
    stopped, above : float, optional
        First time of the first window outside its band, and of the first above it.
    channels : tuple of Channel
    indefinite : int
        Updates whose S is not positive definite.
    nees : array (k,), optional
        Normalised error squared, where a truth is known.
    nees_ratio, nees_low, nees_high : float, optional
        Its mean over n, and the band; the errors of one run are correlated in time, for which the
        band is widened.
    confidence : float
        Of all findings together.
    findings : tuple of str
        What is wrong, in words; empty for a filter that may be right.
    """

    time: Array
    nis: Array
    dof: Array
    ratio: float
    low: float
    high: float
    windows: Array
    stopped: float | None
    above: float | None
    channels: tuple[Channel, ...]
    indefinite: int
    confidence: float
    nees: Array | None = None
    nees_ratio: float | None = None
    nees_low: float | None = None
    nees_high: float | None = None
    findings: tuple[str, ...] = ()

    @property
    def consistent(self) -> bool:
        """Whether nothing was found."""
        return not self.findings

    def summary(self) -> dict[str, Any]:
        """Numbers and findings without the series, for JSON."""
        kept = ("ratio", "low", "high", "stopped", "above", "indefinite", "confidence")
        numbers = {name: getattr(self, name) for name in kept}
        numbers |= {n: getattr(self, n) for n in ("nees_ratio", "nees_low", "nees_high")}
        channels = [asdict(c) for c in self.channels]
        return numbers | {"channels": channels, "findings": list(self.findings)}


def diagnose(
    log: Log,
    *,
    angles: Mapping[int, float] | None = None,
    window: int = 50,
    confidence: float = 0.95,
) -> Diagnosis:
    """Test the innovations of a log, and its errors where a truth is known.

    Parameters
    ----------
    log : Log
    angles : mapping of int to float, optional
        Channels (from 1) that wrap, with their period: {2: 2 * pi}.
    window : int
        Updates in a window, at least 10.
    confidence : float
        Probability that a filter that is right passes all tests together. The test of colour is
        approximate where updates are few: 0.95 was 0.935 to 0.955 for 20 to 200 of them.

    Returns
    -------
    Diagnosis

    Raises
    ------
    ValueError
        An unknown channel, a period that is not positive, a window below 10, a confidence not
        between 0 and 1, a log without a measurement.

    References
    ----------
    Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and Navigation, 5.4.
    """
    rest = 2 * tail_of(confidence)
    validation.whole_number("window", window, 10)
    y = _wrapped(log.innovation, angles or {})
    white, nis, dof, indefinite = _whitened(y, log.S)
    good = np.isfinite(nis)
    if not good.any():
        raise ValueError("log must hold at least one innovation with a definite S; found none")
    m = y.shape[1]
    tests = 2 + 2 * m + (log.error is not None)
    tail = rest / tests / 2
    total = int(dof[good].sum())
    ratio = float(nis[good].sum() / total)
    low, high = (float(quantile(p, total) / total) for p in (tail, 1 - tail))
    windows = _windows(log.time[good], nis[good], dof[good], window, 2 * tail)
    beyond = windows[:, 2] > 1
    outside = beyond | (windows[:, 3] < 1)
    stopped, above = (float(windows[w][0, 0]) if w.any() else None for w in (outside, beyond))
    channels = tuple(channel(i + 1, y[:, i], log.S[:, i, i], white[:, i], tail) for i in range(m))
    common = log.time, nis, dof, ratio, low, high, windows, stopped, above, channels
    found = Diagnosis(*common, indefinite, confidence)
    if log.error is not None:
        found = replace(found, **_errors(log, tail))
    return replace(found, findings=tuple(_findings(found)))


def _wrapped(y: Array, angles: Mapping[int, float]) -> Array:
    y = y.copy()
    for number, period in angles.items():
        if not 1 <= number <= y.shape[1]:
            raise ValueError(f"angles must name channels 1 to {y.shape[1]}; found {number}")
        if not 0 < period < np.inf:
            raise ValueError(f"angles must have positive periods; found {period}")
        y[:, number - 1] -= period * np.ceil(y[:, number - 1] / period - 0.5)
    return y


def _whitened(y: Array, S: Array) -> tuple[Array, Array, Array, int]:
    """L^-1 y of what was measured, its square, how many components, and how many S had no L."""
    measured = np.isfinite(y)
    white = np.full(y.shape, np.nan)
    bad = np.zeros(len(y), bool)
    for pattern in np.unique(measured, axis=0):
        if not pattern.any():
            continue
        rows = np.flatnonzero((measured == pattern).all(axis=1))
        part = S[np.ix_(rows, pattern, pattern)]
        with np.errstate(invalid="ignore"):
            variance = np.diagonal(part, axis1=1, axis2=2)
            scale = 1 / np.sqrt(np.where(variance > 0, variance, np.nan))  # metres, microradians
            L = cholesky(scale[:, :, None] * part * scale[:, None, :])
            left = np.diagonal(L, axis1=1, axis2=2) ** 2
        sound = np.isfinite(L).all((1, 2)) & (left > 8 * left.shape[1] * EPS).all(1)
        bad[rows[~sound]] = True
        scaled = (scale * y[np.ix_(rows, pattern)])[sound]
        u = np.linalg.solve(L[sound], scaled[..., None])[..., 0]
        white[np.ix_(rows[sound], pattern)] = u
    dof = np.where(bad, 0, measured.sum(axis=1))
    nis = np.where(dof > 0, np.nansum(white**2, axis=1), np.nan)
    return white, nis, dof, int(bad.sum())


def _windows(time: Array, nis: Array, dof: Array, size: int, alpha: float) -> Array:
    """Ratio of every window over the ends of its band."""
    starts = range(0, max(1, len(nis) - size // 2), size)
    rows = []
    for begin in starts:
        last = len(nis) if begin + size + size // 2 > len(nis) else begin + size
        total = dof[begin:last].sum()
        ratio = nis[begin:last].sum() / total
        ends = [quantile(p, total) / total for p in _ends(alpha / len(starts))]
        rows.append((time[begin], time[last - 1], ratio / ends[1], ratio / ends[0]))
    return np.array(rows)


def _ends(alpha: float) -> tuple[float, float]:
    return alpha / 2, 1 - alpha / 2


def _errors(log: Log, tail: float) -> dict[str, Any]:
    """NEES, its mean over n, and a band for as many independent errors as the run is worth."""
    assert log.error is not None
    values = nees(log.error, log.P)
    used = values[np.isfinite(values)]
    if not used.size:
        return {"nees": values}
    n = log.error.shape[1]
    d = used - used.mean()
    r = np.array([d[k:] @ d[: len(d) - k] for k in range(1, len(d) // 2)]) / (float(d @ d) or 1.0)
    positive = r[: np.argmax(r < 0.05)] if (r < 0.05).any() else r
    independent = max(1.0, len(used) / (1 + 2 * positive.sum()))
    low, high = (quantile(p, n * independent) / (n * independent) for p in (tail, 1 - tail))
    return {
        "nees": values,
        "nees_ratio": float(used.mean() / n),
        "nees_low": float(low),
        "nees_high": float(high),
    }


def moment(time: float, d: Diagnosis) -> str:
    """A time of the log, to a thousandth of its span: it has no unit, and a window is longer.

    Parameters
    ----------
    time : float
        In the log's unit.
    d : Diagnosis
        Of that log.

    Returns
    -------
    str
    """
    span = float(d.time[-1]) - float(d.time[0])
    digits = max(0, math.ceil(3 - math.log10(span))) if 0 < span < math.inf else 6
    return f"{round(time, digits) + 0.0:.15g}"


def _findings(d: Diagnosis) -> Iterator[str]:
    if d.indefinite:
        yield f"S is not positive definite at {d.indefinite} updates"
    if not d.low <= d.ratio <= d.high:
        way = "too sure" if d.ratio > d.high else "not sure enough"
        yield f"the filter is {way}: NIS {d.ratio:.2f} times what it should be"
    if d.stopped is not None:
        side = "above" if d.stopped == d.above else "below"
        yield f"the first window outside its band begins at time {moment(d.stopped, d)}, {side} it"
        if d.above is not None and d.above != d.stopped:
            yield f"the first window above its band, too sure, begins at time {moment(d.above, d)}"
    for c in d.channels:
        if c.biased:
            yield f"channel {c.number} is biased by {c.bias:.2f} deviations"
        if c.coloured:
            apart = "with the one before" if c.lag == 1 else f"at {c.lag} updates apart"
            yield f"channel {c.number} is not white: correlation {c.at_lag:.2f} {apart}"
    if d.nees_ratio is not None and d.nees_low is not None and d.nees_high is not None:
        wrong = f"NEES {d.nees_ratio:.2f} times what it should be"
        if d.nees_ratio > d.nees_high:
            yield f"the errors are larger than claimed: {wrong}"
        elif d.nees_ratio < d.nees_low:
            yield f"the errors are smaller than claimed: {wrong}"
