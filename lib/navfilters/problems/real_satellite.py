"""A real satellite that leaked, Eutelsat W3B by its stations: a force that no filter is told."""

from functools import lru_cache, partial

import numpy as np

from navfilters.problems.problem import Draw, Problem
from navfilters.tracking import Trial, flight, trial
from navfilters.types import Gaussian

DENSITY = 1e-12
"""Of the filter's white acceleration, m^2/s^3: in sixteen hours a quarter of a millimetre per
second, which is next to nothing; a filter may take more."""

SCALE = 1e4
"""Deviation of the first position, m."""


@lru_cache(maxsize=1)
def satellite() -> Problem:
    """Ranges, azimuths and elevations from five stations over sixteen hours, one number a step.

    Returns
    -------
    Problem
        Judged by the distance from the batch solution over the last quarter of the numbers. Runs
        differ in the first estimate alone; position and velocity are tested.

    Raises
    ------
    ImportError
        Without astropy.
    """
    tried = trial(flight())
    steps = len(tried.sequence.z)
    return Problem(
        name="satellite",
        draw=partial(_draw, tried),
        model=tried.sequence.model,
        steps=steps,
        judged=(0, 1, 2),
        unit="m",
        since=3 * steps // 4,
        dynamics=tried.sequence.noisy(DENSITY),
        tested=(0, 1, 2, 3, 4, 5),
        repeated=True,
    )


def _draw(tried: Trial, runs: int, seed: int) -> Draw:
    mean, cov = tried.starts(SCALE, runs, leak=False, seed=seed)
    truth = np.broadcast_to(tried.first, (len(tried.truth) + 1, 1, len(tried.first))).copy()
    truth[1:, 0, :9] = tried.truth
    z = np.broadcast_to(tried.sequence.z[:, None], (len(tried.truth), runs, 1))
    return Draw(Gaussian(mean, cov[0]), truth, z)
