"""Later filters on the fixed point with noise.

``python -m navfilters.papers.perea2007.later_filters``: which of them believe no more than they
know; every correction with every kind of moments, with and without the circular bump.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from navfilters.estimators.correction import iterated, once, recalibrated, recursive
from navfilters.estimators.filter import Filter
from navfilters.estimators.moments import (
    cubature,
    gaussian_second_order,
    linearized,
    unscented,
)
from navfilters.estimators.variants import bump_circular, unchanged
from navfilters.models import RangeBearing
from navfilters.numerics.extras import command
from navfilters.papers.perea2007.experiment import Setup, isotropic
from navfilters.runs import records
from navfilters.runs.consistency import nees
from navfilters.runs.sweeping import sweep
from navfilters.types import Array, Moments

MOMENTS: dict[str, Callable[..., Moments]] = {
    "first order": linearized,
    "second order": gaussian_second_order,
    "cubature": cubature,
    "unscented": unscented,
}

CORRECTIONS = {
    "once": once,
    "iterated": iterated,
    "recursive": recursive,
    "recalibrated": recalibrated,
}

VARIANTS = {"unchanged": unchanged, "circular bump": bump_circular}

EDGE = 9.210340371976182
"""The NEES that one in a hundred of a chi-square variable with two degrees of freedom exceeds."""


class Experiment(NamedTuple):
    """What all filters are given.

    Parameters
    ----------
    start : array (runs, 2)
        First estimates, units.
    z : array (steps, runs, 2)
        Ranges, units, and bearings, rad.
    """

    start: Array
    z: Array

    def few(self, runs: int) -> "Experiment":
        """The first runs."""
        return Experiment(self.start[:runs], self.z[:, :runs])


class Runs(NamedTuple):
    """What a filter made of many runs, after some of its updates.

    Parameters
    ----------
    error : array (len(after), runs)
        Distance of the estimate from the truth, units; infinite where there is none.
    nees : array (len(after), runs)
    """

    error: Array
    nees: Array

    @property
    def outside(self) -> Array:
        """The share of the runs that are lost, or outside the ellipse of 99 %, (len(after),)."""
        return np.mean(~(self.nees <= EDGE), axis=-1)


def experiment(setup: Setup, runs: int, steps: int, seed: int = 0) -> Experiment:
    """Starts drawn as the filters believe them to be, and measurements with the noise of R.

    Parameters
    ----------
    setup : Setup
    runs, steps : int
    seed : int

    Returns
    -------
    Experiment
        Starts (runs, 2), measurements (steps, runs, 2).
    """
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal((steps, runs, 2)) * np.sqrt(np.diagonal(setup.model.R))
    start = setup.x_true + setup.sigma * rng.standard_normal((runs, 2))
    return Experiment(start, setup.z + noise)


def follow(
    estimator: Any,
    setup: Setup,
    given: Experiment,
    after: Sequence[int] = (1, 10, 100),
    *,
    progress: bool = False,
) -> Runs:
    """A filter through many runs; bearings are wrapped.

    Parameters
    ----------
    estimator : Filter
    setup : Setup
    given : Experiment
    after : sequence of int
        The numbers of updates to look after.
    progress : bool
        Whether there is a bar.

    Returns
    -------
    Runs
    """
    start, z = given
    history = sweep(
        estimator,
        isotropic(start, np.full(len(start), setup.sigma)),
        z[: max(after)],
        RangeBearing(setup.model.R),
        z_per_step=True,
        record=records.estimate,
        workers=None if progress else 1,
        progress=progress,
    ).record
    return judged(setup, history.mean[list(after)], history.cov[list(after)])


def judged(setup: Setup, mean: Array, cov: Array) -> Runs:
    """Estimates beside the truth.

    Parameters
    ----------
    setup : Setup
    mean : array (..., runs, 2)
    cov : array (..., runs, 2, 2)

    Returns
    -------
    Runs
        Distances in units, infinite where there is no number, and NEES, (..., runs).
    """
    error = np.array(setup.x_true) - mean
    distance = np.linalg.norm(error, axis=-1)
    return Runs(np.where(np.isfinite(distance), distance, np.inf), nees(error, cov))


def combinations() -> dict[tuple[str, str, str], Filter]:
    """Every correction, moments and variant; the recursive update as it is, of first order."""
    return {
        (how, what, kind): Filter(moments, variant, correction=correction)
        for how, correction in CORRECTIONS.items()
        for what, moments in MOMENTS.items()
        for kind, variant in VARIANTS.items()
        if how != "recursive" or what == "first order"
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the share of over-confident runs of every combination.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line by default.
    """
    parser = argparse.ArgumentParser(description="Honesty of the later filters with noise.")
    parser.add_argument("--runs", type=int, default=10000)
    parser.add_argument("--updates", type=int, default=1000)
    chosen = parser.parse_args(arguments)
    if chosen.runs < 1 or chosen.updates < 1:
        parser.error(
            f"--runs and --updates must be at least 1; found {chosen.runs}, {chosen.updates}"
        )
    setup = Setup()
    given = experiment(setup, chosen.runs, chosen.updates)
    for names, estimator in combinations().items():
        found = follow(estimator, setup, given, (chosen.updates,), progress=True)
        what, middle = ", ".join(names), np.median(found.error)
        sys.stdout.write(f"{what:40} outside {found.outside[0]:6.1%}, median {middle:.2g} units\n")


if __name__ == "__main__":
    command(main)
