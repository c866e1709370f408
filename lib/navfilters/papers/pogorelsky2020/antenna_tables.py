"""What the antenna does, what the plane of zero Doppler does, and the cures, as a table."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from navfilters.papers.pogorelsky2020.experiment import of_case
from navfilters.papers.pogorelsky2020.final_nees import nees_line
from navfilters.papers.pogorelsky2020.without_antenna import MEASURED, Trial, fly, fly_with_offsets
from navfilters.runs.consistency import nees
from navfilters.types import Array

CHUNK = 100
"""Runs that are flown at a time."""


class Row(NamedTuple):
    """A line of the table."""

    label: str
    trial: Trial
    updates: int = 72
    sigma: float | None = None
    """First deviation, m, of a delay among the states."""
    bump: tuple[float, int] | None = None
    """Another underweighting, in how many updates."""


def antenna_table(
    case: str = "TC-1",
    runs: int = 200,
    seed: int = 0,
    progress: Callable[[Iterable[Any]], Iterable[Any]] = iter,
) -> str:
    """Predicted deviations of the position, and the NEES of all nine, of each trial.

    Parameters
    ----------
    case : {"TC-1", "TC-2"}
    runs : int
        At least 2.
    seed : int
    progress : callable
        Wraps the iterable of what flies in one batch.

    Returns
    -------
    str
    """
    head = f"{'':34}{'x':>6}{'y':>6}{'z':>6}{'weak (m)':>10}   NEES, share above 21.67"
    lines = {}
    together = groupby(sorted(_rows(), key=_flight), key=_flight)
    for rows in progress([list(rows) for _, rows in together]):
        chunks = [list(range(i, min(i + CHUNK, runs))) for i in range(0, runs, CHUNK)]
        parts = [_flown(case, rows, chunk, seed) for chunk in chunks]
        errors, covs = (np.concatenate(part, axis=1) for part in zip(*parts, strict=True))
        for row, e, P in zip(rows, errors, covs, strict=True):
            d = np.sqrt(np.diagonal(P, axis1=1, axis2=2).mean(axis=0))[:3]
            weak = np.sqrt(np.linalg.eigvalsh(P[:, :3, :3])[:, -1]).mean()
            shown = "".join(f"{s:6.0f}" for s in d)
            lines[row.label] = f"{row.label:34}{shown}{weak:10.0f}   {nees_line(nees(e, P))}"
    return "\n".join([head, *(lines[row.label] for row in _rows())])


def _rows() -> Iterator[Row]:
    """In the order of the table."""
    for updates in (3, 72):
        for measured in MEASURED:
            yield Row(f"{measured}, {updates} images", Trial(measured), updates)
    for clock in (1e-3, 1e-2, 1e-1, 1.0):
        yield Row(f"plane, clock {1e3 * clock:g} ms", Trial(clock=clock))
    for measured in MEASURED:
        if measured != "antenna":
            yield Row(f"{measured}, 1 ms late", Trial(measured, late=1e-3))
        for arcseconds, told in ((5, False), (20, False), (20, True)):
            name = f"{measured}, {arcseconds} arcsec{', told' if told else ''}"
            yield Row(name, Trial(measured, pointing=arcseconds, told=told))
        air = Trial(measured, delay=3.08)
        yield Row(f"{measured}, delay of 3.08 m", air)
        yield Row(f"{measured}, delay a state", air, sigma=3.0)
    for sigma in (0.3, 1.0, 3.0):
        yield Row(f"antenna, tenth state {sigma} m", Trial("antenna"), sigma=sigma)
    for updates in (10, 72):
        for bump in (0.2, 0.5, 1.0, 2.0):
            name = f"antenna, bump {bump} in {updates}"
            yield Row(name, Trial("antenna"), bump=(bump, updates))


def _flight(row: Row) -> tuple[Any, ...]:
    """Rows of which this is equal fly in one batch."""
    return row.updates, row.sigma is not None, row.bump or ()


def _flown(case: str, rows: list[Row], runs: list[int], seed: int) -> tuple[Array, Array]:
    """Last errors (rows, runs, 9), and what the filter believed of them."""
    setup, (_, _, updates, sigma, bump) = of_case(case), rows[0]
    if bump is not None:
        setup = replace(setup, underweighting=bump[0], underweighted=bump[1])
    trials = [row.trial for row in rows]
    if sigma is None:
        found = fly(setup, trials, updates, runs, seed)
        return found.errors[updates], found.covariances[updates]
    delays = np.array([row.sigma for row in rows])
    e, P = fly_with_offsets(setup, trials, {"delay": delays}, runs, seed)
    return e[-1, ..., :9], P[-1, ..., :9, :9]
