"""The true flight of Pogorelsky et al."""

from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from navfilters.numerics import validation
from navfilters.papers.pogorelsky2020.experiment import CASES, NOMINAL, Setup
from navfilters.space.frames import (
    body_axes,
    east_north_up,
    ellipsoid_intersection,
    geodetic_to_ecef,
)
from navfilters.types import Array


class Truth(NamedTuple):
    """The true flight at the start and after each interval, the same in every run.

    Parameters
    ----------
    times : array (k + 1,)
        Seconds.
    x : array (k + 1, 6)
        Earth-fixed position, m, and velocity, m/s.
    T_e_b : array (k + 1, 3, 3)
        Attitude of the body, which the filter knows.
    """

    times: Array
    x: Array
    T_e_b: Array


def initial_state(setup: Setup = CASES["TC-1"]) -> Array:
    """Where a circular orbit is when the boresight meets the target.

    The inertial axes are the Earth-fixed ones at this moment: v = v_i - w x r. The argument of
    latitude and the node are solved for.

    Parameters
    ----------
    setup : Setup

    Returns
    -------
    array (6,)
        Earth-fixed position, m, and velocity, m/s.

    Raises
    ------
    ValueError
        A target that no such pass sees.

    References
    ----------
    pogorelsky2020, Table 2. The text gives no state.
    """
    ground = geodetic_to_ecef(*setup.target)
    axes, geometry = east_north_up(*setup.target), setup.geometry
    latitude, longitude = np.deg2rad(setup.target)
    start = latitude if setup.ascending else np.pi - latitude

    def miss(angles: Array) -> Array:
        x = _circular(setup, *angles)
        beam = replace(geometry, T_e_b=_attitude(setup, x)).boresight(NOMINAL)
        return (axes @ (ellipsoid_intersection(x[:3], beam) - ground))[:2]

    overhead = _circular(setup, start, 0.0)
    node = longitude - np.arctan2(overhead[1], overhead[0])
    try:
        found = root(miss, [start, node], tol=1e-13)
    except ValueError:
        found = None  # a beam that misses the Earth
    if found is None or np.abs(found.fun).max() > 1e-3:
        raise ValueError(
            "target must be seen from a circular orbit of altitude, inclination and look angle "
            f"{setup.altitude} m, {setup.inclination} and {setup.look} deg; found {setup.target}"
        )
    return _circular(setup, *found.x)


def _circular(setup: Setup, argument: float, node: float) -> Array:
    """Earth-fixed state on the circular orbit, inertial axes being Earth-fixed."""
    radius, i = setup.gravity.radius + setup.altitude, np.deg2rad(setup.inclination)
    speed = np.sqrt(setup.gravity.mu / radius)
    cos, sin = np.cos, np.sin
    to_node = np.array([cos(node), sin(node), 0.0])
    across = np.array([-sin(node) * cos(i), cos(node) * cos(i), sin(i)])
    r = radius * (cos(argument) * to_node + sin(argument) * across)
    v = speed * (cos(argument) * across - sin(argument) * to_node)
    return np.concatenate([r, v + setup.rate * np.array([r[1], -r[0], 0.0])])


def _attitude(setup: Setup, x: Array) -> Array:
    """T_e^b from states (..., 6), along the velocity that the set-up names."""
    r, v = x[..., :3], x[..., 3:]
    if setup.attitude == "inertial":
        turning = np.stack([-r[..., 1], r[..., 0], np.zeros_like(r[..., 0])], axis=-1)
        v = v + setup.rate * turning
    return body_axes(r, v)


@lru_cache(maxsize=32)
def truth(setup: Setup = CASES["TC-1"], intervals: int = 72) -> Truth:
    """The flight from the start, by Runge-Kutta.

    Parameters
    ----------
    setup : Setup
    intervals : int
        At least 1.

    Returns
    -------
    Truth
        Computed once for each set-up; its arrays are read-only.

    Raises
    ------
    ValueError
        A target that is not seen, or fewer than one interval.

    References
    ----------
    pogorelsky2020, sections "Closed-loop trajectory" and "Open-loop trajectory".
    """
    validation.whole_number("intervals", intervals, 1)
    orbit = replace(setup, integrator="rk4").orbit
    flown = max(intervals, setup.shortest)
    x = orbit.path(initial_state(setup), flown * setup.steps)[:: setup.steps]
    T_e_b = _attitude(setup, x)
    if setup.attitude == "constant rate":
        turned = Rotation.from_matrix(T_e_b[setup.shortest] @ T_e_b[0].T).as_rotvec()
        steps = np.arange(flown + 1)[:, None] / setup.shortest
        T_e_b = Rotation.from_rotvec(steps * turned).as_matrix() @ T_e_b[0]
    flight = (setup.interval * np.arange(flown + 1.0), x, T_e_b)
    for array in flight:
        array.setflags(write=False)
    return Truth(*(array[: intervals + 1] for array in flight))
