"""What the angles are where the errors of the Earth sensor are those of one direction."""

from collections.abc import Iterable

import numpy as np

from navfilters.papers.xiong2009.experiment import ARCSECOND, VARIANTS, Setup
from navfilters.papers.xiong2009.true_flight import truth
from navfilters.types import Array


def one_direction(
    setup: Setup = VARIANTS["A"],
    seeds: Iterable[int] = range(20),
    bias: tuple[float, float] = (0.0, 0.0),
) -> Array:
    """Angles between the stars and a direction of the Earth's centre that is off as a whole.

    Parameters
    ----------
    setup : Setup
        Of one noise: ``earth_noise`` is the deviation of each of two components of the direction,
        ``star_noise`` that of each angle.
    seeds : iterable of int
        Each has its own stream, ``numpy.random.default_rng(seed)``.
    bias : (float, float)
        A constant error of the direction, degrees: in the orbit's plane, positive where it puts the
        spacecraft ahead, and across it.

    Returns
    -------
    array (updates, seeds, m)
        Radians.

    Notes
    -----
    A direction that is off by a small angle is that from a place so far beside the true one, and is
    computed so: the position moves by the angle times its length. With R of the set-up the filter
    knows the size of each angle's error and not that the two are correlated.
    """
    states = truth(setup).states[setup.interval :: setup.interval]
    r, v = states[:, :3], states[:, 3:]
    normal = np.cross(r, v)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    across = np.linalg.norm(r, axis=1, keepdims=True) * normal
    along = np.cross(normal, r)
    size = len(states), 2 + len(setup.stars)
    draws = np.stack([np.random.default_rng(seed).standard_normal(size) for seed in seeds], axis=1)
    off = np.deg2rad(bias + float(setup.earth_noise) * draws[..., :2])
    place = r[:, None] + off[..., :1] * along[:, None] + off[..., 1:] * across[:, None]
    seen = setup.sensor.h(np.concatenate([place, 0 * place], axis=-1))
    return seen + float(setup.star_noise) * ARCSECOND * draws[..., 2:]
