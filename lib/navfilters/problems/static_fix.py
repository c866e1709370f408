"""The static fix of Perea et al.: range and bearing of a point that does not move."""

from functools import partial

import numpy as np

from navfilters.models import RangeBearing
from navfilters.papers.perea2007 import Setup
from navfilters.problems.problem import Draw, Problem, streams
from navfilters.types import Gaussian


def static_fix(noisy: bool, steps: int = Setup.steps, setup: Setup = Setup()) -> Problem:
    """The paper's truth, seen from first estimates that are as wrong as they say; angles wrapped.

    Parameters
    ----------
    noisy : bool
        Whether the measurements have the noise that R says; the paper's are perfect.
    steps : int
        Number of updates.
    setup : Setup
        Of the paper.

    Returns
    -------
    Problem
        Judged by the distance after the last update.

    References
    ----------
    perea2007, section III.
    """
    return Problem(
        name="fix, noisy" if noisy else "fix, perfect",
        draw=partial(_draw, setup, steps, noisy),
        model=RangeBearing(setup.model.R),
        steps=steps,
        judged=(0, 1),
        unit="units",
        since=steps,
    )


def _draw(setup: Setup, steps: int, noisy: bool, runs: int, seed: int) -> Draw:
    true, rngs = np.array(setup.x_true), streams(runs, seed)
    start = true - setup.sigma * np.stack([rng.standard_normal(2) for rng in rngs])
    z = np.broadcast_to(setup.z, (steps, runs, 2))
    if noisy:
        noise = np.stack([rng.standard_normal((steps, 2)) for rng in rngs], axis=1)
        z = z + np.sqrt(np.diag(setup.model.R)) * noise
    truth = np.broadcast_to(true, (steps + 1, 1, 2))
    return Draw(Gaussian(start, setup.prior.cov), truth, z)
