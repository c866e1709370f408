"""The ten filters on the noisy fix, beside what is best: a table."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from navfilters.papers.perea2007.experiment import FILTERS, Setup
from navfilters.papers.perea2007.noisy_fix import (
    BLOCK,
    EDGE,
    UPDATES,
    Belief,
    Score,
    batch,
    bound,
    exact,
    follow,
    measurements,
    score,
)
from navfilters.types import Array

EXACT, BATCH = "exact moments", "least squares"
"""What the references are called: the posterior's own mean and covariance, and ``batch``."""


def everyone(
    z: Array, setup: Setup, updates: Sequence[int] = UPDATES, *, done: Callable[[int], Any] = bool
) -> dict[str, Belief]:
    """What the references and the ten filters believe.

    Parameters
    ----------
    z : array (steps, runs, 2)
    setup : Setup
    updates : sequence of int
    done : callable
        Is told the number of runs that a filter has finished.

    Returns
    -------
    dict of str to Belief
        Arrays (len(updates), runs, ...).
    """
    moments = [posterior.moments for posterior in exact(setup.prior, z, setup.model, updates)]
    found = {
        EXACT: Belief(*(np.stack(leaf) for leaf in zip(*moments, strict=True))),
        BATCH: batch(setup.prior, z, setup.model, updates),
    }
    for name, estimator in FILTERS.items():
        found[name] = follow(estimator, setup.prior, z, setup.model, updates, done=done)
    return found


def simulate(runs: int, setup: Setup, *, done: Callable[[int], Any] = bool) -> dict[str, Score]:
    """Scores of all of them over many runs.

    Parameters
    ----------
    runs : int
    setup : Setup
    done : callable
        As of :func:`everyone`.

    Returns
    -------
    dict of str to Score
        Arrays (len(UPDATES), runs).
    """
    parts: dict[str, list[Score]] = {}
    for first in range(0, runs, BLOCK):
        size = min(BLOCK, runs - first)
        z = measurements(setup.x_true, setup.model, setup.steps, size, seed=[0, first])
        for name, belief in everyone(z, setup, done=done).items():
            parts.setdefault(name, []).append(score(belief, setup.x_true, setup.model))
    return {
        name: Score(*(np.concatenate(leaf, axis=-1) for leaf in zip(*part, strict=True)))
        for name, part in parts.items()
    }


COLUMNS = (
    "filter",
    "rms / bound",
    "median",
    "95 %",
    "NEES, plane",
    "NEES, measured",
    "outside, plane",
    "outside, measured",
    "NIS",
    "lost",
)
"""Of :func:`rows`."""


def rows(
    scores: Mapping[str, Score], setup: Setup, updates: int = UPDATES[-1]
) -> list[tuple[str, ...]]:
    """Errors over the bound, median NEES, shares outside, NIS and shares lost.

    Parameters
    ----------
    scores : mapping of str to Score
        Arrays (len(UPDATES), runs).
    setup : Setup
    updates : int
        One of ``UPDATES``.

    Returns
    -------
    list of tuple of str
        One for each, as ``COLUMNS`` says. "Plane" and "measured" say in which coordinates; "–" is
        what cannot be told.
    """
    i = UPDATES.index(updates)
    limit = bound(setup.x_true, setup.model)[i]
    found = []
    for name, one in scores.items():
        e = one.error[i] / limit
        numbers = [np.sqrt(np.mean(e**2)), np.median(e), np.quantile(e, 0.95)]
        sound = np.isfinite(one.nees[i])
        numbers += [np.median(q[i][sound]) for q in (one.nees, one.nees_measured) if sound.any()]
        outside = [np.mean(~(q[i] < EDGE)) for q in (one.nees, one.nees_measured)]
        text = [f"{value:.2g}" for value in numbers] + ["–"] * (5 - len(numbers))
        text += [f"{share:.0%}" for share in outside]
        text += [f"{np.mean(one.nis[i]):.2g}" if np.isfinite(one.nis[i]).all() else "–"]
        found.append((name, *text, f"{np.mean(one.lost[i]):.0%}"))
    return found


def table(scores: Mapping[str, Score], setup: Setup, updates: int = UPDATES[-1]) -> str:
    """The same for a terminal.

    Parameters
    ----------
    scores, setup, updates
        As of :func:`rows`.

    Returns
    -------
    str
        A line for each.
    """
    lines = [
        f"after {updates:<10}error over the bound       median NEES    outside own 95 %    mean",
        f"{'':13}     rms  median    95 %    plane measured    plane measured     NIS   lost",
    ]
    widths = (8, 8, 8, 9, 9, 9, 9, 8, 7)
    for name, *text in rows(scores, setup, updates):
        lines.append(f"{name:13}" + "".join(t.rjust(w) for t, w in zip(text, widths, strict=True)))
    return "\n".join(lines)
