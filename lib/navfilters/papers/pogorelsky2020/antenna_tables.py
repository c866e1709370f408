"""What the antenna does, what the plane of zero Doppler does, and the cures, as a table."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from navfilters.papers.pogorelsky2020.experiment import Setup, of_case
from navfilters.papers.pogorelsky2020.final_nees import nees_line
from navfilters.papers.pogorelsky2020.without_antenna import MEASURED, Trial, fly, fly_with_offsets
from navfilters.runs.consistency import nees
from navfilters.types import Array

CHUNK = 100
"""Runs that are flown at a time."""

Job = tuple[str, Callable[[list[int], int], tuple[Array, Array]]]


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
        Wraps the iterable of trials.

    Returns
    -------
    str
    """
    head = f"{'':34}{'x':>6}{'y':>6}{'z':>6}{'weak (m)':>10}   NEES, share above 21.67"
    lines = [head]
    for label, job in progress(list(_jobs(case))):
        parts = [job(list(range(i, min(i + CHUNK, runs))), seed) for i in range(0, runs, CHUNK)]
        e, P = (np.concatenate(part) for part in zip(*parts, strict=True))
        d = np.sqrt(np.diagonal(P, axis1=1, axis2=2).mean(axis=0))[:3]
        weak = np.sqrt(np.linalg.eigvalsh(P[:, :3, :3])[:, -1]).mean()
        shown = "".join(f"{s:6.0f}" for s in d)
        lines.append(f"{label:34}{shown}{weak:10.0f}   {nees_line(nees(e, P))}")
    return "\n".join(lines)


def _jobs(case: str) -> Iterator[Job]:
    trials = {measured: Trial(measured) for measured in MEASURED}
    for updates in (3, 72):
        for measured, trial in trials.items():
            yield f"{measured}, {updates} images", partial(_flown, case, trial, updates)
    for clock in (1e-3, 1e-2, 1e-1, 1.0):
        yield f"plane, clock {1e3 * clock:g} ms", partial(_flown, case, Trial(clock=clock), 72)
    for measured in MEASURED:
        late = Trial(measured, late=1e-3)
        if measured != "antenna":
            yield f"{measured}, 1 ms late", partial(_flown, case, late, 72)
        for arcseconds, told in ((5, False), (20, False), (20, True)):
            name = f"{measured}, {arcseconds} arcsec{', told' if told else ''}"
            trial = Trial(measured, pointing=arcseconds, told=told)
            yield name, partial(_flown, case, trial, 72)
        air = Trial(measured, delay=3.08)
        yield f"{measured}, delay of 3.08 m", partial(_flown, case, air, 72)
        yield f"{measured}, delay a state", partial(_with_delay, case, air, 3.0)
    for sigma in (0.3, 1.0, 3.0):
        name = f"antenna, tenth state {sigma} m"
        yield name, partial(_with_delay, case, Trial("antenna"), sigma)
    for updates in (10, 72):
        for bump in (0.2, 0.5, 1.0, 2.0):
            setup = replace(of_case(case), underweighting=bump, underweighted=updates)
            name = f"antenna, bump {bump} in {updates}"
            yield name, partial(_flown, setup, Trial("antenna"), 72)


def _flown(
    case: str | Setup, trial: Trial, updates: int, runs: list[int], seed: int
) -> tuple[Array, Array]:
    found = fly(case, [trial], updates, runs, seed)
    return found.errors[updates, 0], found.covariances[updates, 0]


def _with_delay(
    case: str | Setup, trial: Trial, sigma: float, runs: list[int], seed: int
) -> tuple[Array, Array]:
    e, P = fly_with_offsets(case, [trial], {"delay": sigma}, runs, seed)
    return e[-1, 0, :, :9], P[-1, 0, :, :9, :9]
