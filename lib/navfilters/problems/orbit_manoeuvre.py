"""The orbit of Xiong et al., quiet and with the burns that its filters do not know."""

from dataclasses import replace
from functools import partial

import numpy as np

from navfilters.papers.xiong2009 import VARIANTS, Setup, truth
from navfilters.problems.problem import Draw, Problem, streams
from navfilters.types import Gaussian


def orbit(name: str, reading: str = "A", *, burns: bool = True, step: float = 20.0) -> Problem:
    """Stars and the Earth's centre, seen every 100 s for 20 000 s.

    Parameters
    ----------
    name : str
    reading : {"A", "B", "C", "D"}
        Of the noise: a key of ``VARIANTS``.
    burns : bool
        Whether the thruster fires.
    step : float
        Sub-step of the filter, s: a whole part of 100. The papers' chapters take 1, of which 20
        differ by millimetres here.

    Returns
    -------
    Problem
        Judged by the position over the last 2000 s, as the paper does.

    Raises
    ------
    ValueError
        A step that is no whole part of the interval.

    References
    ----------
    xiong2009, section 5.
    """
    setup = VARIANTS[reading] if burns else replace(VARIANTS[reading], burns=())
    steps = setup.duration // setup.interval
    substeps = setup.interval / step
    if not substeps.is_integer():
        raise ValueError(f"step must be a whole part of {setup.interval} s; found {step}")
    each_second = setup.orbit()
    dynamics = replace(
        each_second, Q=step * each_second.Q, step=step, substeps=round(substeps)
    )  # Q is that of a sub-step
    starts = setup.interval * np.arange(steps)
    burning = np.zeros(steps, bool)
    for start, end in setup.burns:
        burning |= (starts < end) & (starts + setup.interval > start)
    return Problem(
        name=name,
        draw=partial(_draw, setup),
        model=setup.sensor,
        steps=steps,
        judged=(0, 1, 2),
        unit="m",
        since=steps - setup.window // setup.interval,
        dynamics=dynamics,
        burning=burning if burns else None,
    )


def _draw(setup: Setup, runs: int, seed: int) -> Draw:
    rngs, states = streams(runs, seed), truth(setup).states[:: setup.interval]
    first = np.stack([rng.standard_normal(6) for rng in rngs])
    normal = np.stack([rng.standard_normal((len(states) - 1, 2)) for rng in rngs], axis=1)
    z = setup.sensor.h(states[1:])[:, None] + setup.sigma * normal
    cov = setup.prior.cov
    return Draw(Gaussian(states[0] - np.sqrt(np.diag(cov)) * first, cov), states[:, None], z)
