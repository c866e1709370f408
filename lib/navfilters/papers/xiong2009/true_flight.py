"""The true flight through the manoeuvres of Xiong et al."""

from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from navfilters.papers.xiong2009.experiment import VARIANTS, Setup
from navfilters.space.gravity import Gravity
from navfilters.space.inertial_orbit import Orbit
from navfilters.space.osculating_ellipse import perigee_apogee
from navfilters.space.thrust import Thrust
from navfilters.types import Array


class Truth(NamedTuple):
    """The true flight: thrust, and states (duration + 1, 6) at whole seconds, m and m/s."""

    thrust: Thrust
    states: Array


def truth(setup: Setup = VARIANTS["A"]) -> Truth:
    """The flight that reaches the stated perigee, by DOP853 at 1e-12, arc by arc.

    Parameters
    ----------
    setup : Setup
        Without burns there is no thrust.

    Returns
    -------
    Truth
        Computed once for each orbit; do not write into it.

    Raises
    ------
    ValueError
        Burns that are not within the run, or a perigee that no thrust up to 12.8 m/s^2 reaches.

    References
    ----------
    xiong2009, section 5. "Height of the perigee raised from 500 km to 2000 km" is read as that of
    the osculating ellipse when the last burn ends; the thrust is along the velocity.
    """
    burns = tuple((start, end) for start, end in setup.burns)
    if burns and not (burns[0][0] >= 0 and burns[-1][1] <= setup.duration):
        raise ValueError(f"burns must be within 0 to {setup.duration} s; found {burns}")
    x0 = tuple(setup.x0.tolist())
    magnitude = setup.thrust if burns else 0.0
    if magnitude is None:
        magnitude = _solved_thrust(setup.gravity, x0, burns, setup.perigee)
    return _truth(setup.gravity, x0, Thrust(magnitude, burns), setup.duration)


@lru_cache(maxsize=16)
def _truth(gravity: Gravity, x0: tuple[Any, ...], thrust: Thrust, duration: int) -> Truth:
    states = _fly(gravity, np.array(x0), thrust, np.arange(duration + 1.0))
    states.setflags(write=False)
    return Truth(thrust, states)


@lru_cache(maxsize=16)
def _solved_thrust(
    gravity: Gravity, x0: tuple[Any, ...], burns: tuple[Any, ...], perigee: float
) -> float:
    """The strength with which the last burn ends at the perigee, m/s^2."""
    start, end = burns[0][0], burns[-1][1]
    before = _fly(gravity, np.array(x0), Thrust(0.0, ()), np.array([0.0, start]))[-1]

    def excess(magnitude: float) -> float:
        x = _fly(gravity, before, Thrust(magnitude, burns), np.array([start, end]))[-1]
        return float(perigee_apogee(x, gravity)[0]) - perigee

    high = 0.1
    while excess(high) < 0 and high < 10:
        high *= 2
    if excess(0.0) > 0 or excess(high) < 0:
        raise ValueError(f"perigee must be reached by a thrust of 0 to {high}; found {perigee}")
    return brentq(excess, 0.0, high, xtol=1e-14)


def _fly(gravity: Gravity, x: Array, thrust: Thrust, times: Array) -> Array:
    """States at the given times, the first of which is that of x; one integration for each arc."""
    orbit, first, last = Orbit(gravity), times[0], times[-1]
    inside = [t for t in np.ravel(thrust.arcs) if first < t < last]
    edges = np.unique([first, *inside, last])
    states = np.empty((len(times), 6))
    for a, b in pairwise(edges):
        strength = thrust.strength((a + b) / 2)
        here = (times >= a) & (times <= b)
        flight = solve_ivp(
            lambda _, x, strength=strength: orbit.derivative(x, strength),
            (a, b),
            x,
            method="DOP853",
            rtol=1e-12,
            atol=1e-9,
            dense_output=True,
        )
        if here.any():
            states[here] = flight.sol(times[here]).T
        x = flight.y[:, -1]
    return states
