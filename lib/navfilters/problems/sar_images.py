"""Navigation by SAR images of known terrain, open loop: the two test cases of Pogorelsky et al."""

from functools import partial

import numpy as np

from navfilters.papers.pogorelsky2020 import CASES, Setup, simulate_images, truth
from navfilters.problems.problem import Draw, Problem
from navfilters.space.image_sensor import SarPass
from navfilters.space.pose import retract
from navfilters.types import Gaussian


def images(name: str, case: str = "TC-1", updates: int = 72) -> Problem:
    """A pass with so many images, and a coast to 41.67 s if there are fewer than five.

    Parameters
    ----------
    name : str
    case : {"TC-1", "TC-2"}
        A key of ``CASES``.
    updates : int
        72 in 600 s.

    Returns
    -------
    Problem
        Judged by the position at the end. Its filter linearises a state with an attitude: the
        paper's MEKF, without its underweighting, is this problem's EKF.

    References
    ----------
    pogorelsky2020, Table 4 and Figs. 8 to 11.
    """
    setup = CASES[case]
    steps = max(updates, setup.shortest)
    return Problem(
        name=name,
        draw=partial(_draw, setup, updates),
        model=SarPass(setup.geometry, truth(setup, steps).T_e_b[1:]),
        steps=steps,
        judged=(0, 1, 2),
        unit="m",
        since=steps,
        dynamics=setup.dynamics,
    )


def _draw(setup: Setup, updates: int, runs: int, seed: int) -> Draw:
    flight = truth(setup, max(updates, setup.shortest))
    seen = simulate_images(setup, runs, seed, flight=flight)
    true = np.stack(
        [np.broadcast_to(seen.true_state(k).x, (runs, 10)) for k in range(len(flight.times))]
    )
    z = np.full((len(true) - 1, runs, 5), np.nan)
    for k in range(updates):
        z[k] = seen(k + 1, seen.true_state(k + 1)).z  # a focused image would need the state
    error = np.sqrt(np.diag(setup.P0)) * seen.noise.first
    return Draw(Gaussian(retract(true[0], -error), setup.P0), true, z)
