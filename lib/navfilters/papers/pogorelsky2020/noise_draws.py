"""The random numbers of the experiment of Pogorelsky et al."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from navfilters.papers.pogorelsky2020.experiment import NOMINAL, Setup
from navfilters.space.navigation_state import NavigationState
from navfilters.space.pose import retract
from navfilters.space.quaternions import from_rotation_vector, normalized, product
from navfilters.types import Array, Gaussian


class Noise(NamedTuple):
    """Standard normal numbers behind each run.

    Parameters
    ----------
    first : array (runs, 9)
        Of the first estimate's errors.
    pixel : array (runs, k, 3)
        Of the pixel's position: east, north, up at the target.
    slant_range, speed : array (runs, k)
        Of the measured range and velocity.
    walk : array (runs, k, 3)
        Of the true misalignment's steps.
    """

    first: Array
    pixel: Array
    slant_range: Array
    speed: Array
    walk: Array


def noise(runs: int | Sequence[int] = 100, intervals: int = 72, seed: int = 0) -> Noise:
    """The random numbers of a Monte Carlo experiment, before they are scaled.

    Parameters
    ----------
    runs : int or sequence of int
        How many runs, or which: run i has the stream ``numpy.random.default_rng([seed, i])``,
        whatever the others are, and a longer flight begins with the numbers of a shorter one.
    intervals : int
    seed : int

    Returns
    -------
    Noise

    Raises
    ------
    ValueError
        No runs, or numbers that are not integers of at least 0.
    """
    indices = range(runs) if isinstance(runs, int | np.integer) else runs
    try:
        streams = [np.random.default_rng([seed, i]) for i in indices]
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"runs and seed must be integers of at least 0; found {runs!r} and {seed!r} ({error})"
        ) from None
    if not streams:
        raise ValueError(f"runs must be at least one; found {runs!r}")
    first = np.stack([stream.standard_normal(9) for stream in streams])
    later = np.stack([stream.standard_normal((intervals, 8)) for stream in streams])
    return Noise(first, later[..., :3], later[..., 3], later[..., 4], later[..., 5:])


def misalignment(setup: Setup, walk: Array) -> Array:
    """The true misalignment at the start, where there is none, and after each interval.

    Parameters
    ----------
    setup : Setup
    walk : array (runs, k, 3)
        Standard normal: ``Noise.walk``.

    Returns
    -------
    array (runs, k + 1, 4)
        Quaternions.

    References
    ----------
    pogorelsky2020, section "MEKF parameters": the process noise of the misalignment accounts for
    noise "in the true data"; whether the true antenna moves open-loop is not stated.
    """
    step = np.sqrt(setup.psd_mu * setup.interval) if setup.walk else 0.0
    q = [np.broadcast_to(NOMINAL, (*walk.shape[:-2], 4))]
    for k in range(walk.shape[-2]):
        turned = product(from_rotation_vector(step * walk[..., k, :]), q[-1])
        q.append(normalized(turned))
    return np.stack(q, axis=-2)


def first_estimate(setup: Setup, true: NavigationState, drawn: Array) -> Gaussian:
    """The truth without a drawn error, so that truth minus estimate is that error exactly."""
    error = np.sqrt(np.diag(setup.P0)) * drawn
    return Gaussian(retract(true.x, -error), np.broadcast_to(setup.P0, (len(drawn), 9, 9)))
