"""The lecture's case in discrete time: a shaken pendulum under a range finder."""

from functools import partial

import numpy as np

from navfilters.estimators.discrete import DiscreteSystem
from navfilters.papers.lecture16.pendulum import Setup
from navfilters.papers.lecture16.sampling import discretised
from navfilters.problems.problem import Draw, Problem, streams
from navfilters.types import Array, Gaussian

STEP = 0.05
"""Between two measurements, s."""


def pendulum(steps: int = 400, setup: Setup = Setup()) -> Problem:
    """A pendulum that moves as the filter believes, noise included.

    Parameters
    ----------
    steps : int
        Of 0.05 s.
    setup : Setup
        Of the chapter on the lecture; its first estimates are drawn here.

    Returns
    -------
    Problem
        Judged by the angle over the second half.

    References
    ----------
    lecture16, Eqs. (73)-(90).
    """
    system = discretised(setup.system, STEP)
    u = np.stack([setup.control(k * STEP) for k in range(steps)])
    return Problem(
        name="pendulum",
        draw=partial(_draw, setup, system, u),
        model=system.sensor,
        steps=steps,
        judged=(0,),
        unit="rad",
        since=steps // 2,
        dynamics=system.dynamics(u),
    )


def _draw(setup: Setup, system: DiscreteSystem, u: Array, runs: int, seed: int) -> Draw:
    rngs, steps = streams(runs, seed), len(u)
    first = np.stack([rng.standard_normal(2) for rng in rngs])
    normal = np.stack([rng.standard_normal((steps, 3)) for rng in rngs], axis=1)
    w = np.sqrt(np.diag(system.Q)) * normal[..., :2]
    v = np.sqrt(np.diag(system.R)) * normal[..., 2:]
    x = [np.broadcast_to([setup.released, 0.0], (runs, 2))]
    for k in range(steps):
        x.append(system.f(x[-1], u[k], w[k], k))
    truth = np.stack(x)
    z = np.stack([system.h(truth[k + 1], v[k], k + 1) for k in range(steps)])
    prior = Gaussian(truth[0] - np.array(setup.deviation) * first, setup.prior.cov)
    return Draw(prior, truth, z)
