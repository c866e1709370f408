"""Orbits: all members of a batch by one integrator, with the steps that the stiffest needs."""

import numpy as np
from scipy.integrate import solve_ivp

from navfilters.tracking.forces import Forces
from navfilters.types import Array


def orbit(forces: Forces, start: Array, time: Array, rtol: float = 1e-12) -> Array:
    """States at times, by the Dormand-Prince method of eighth order.

    Parameters
    ----------
    forces : Forces
    start : array (..., 6)
        Position, m, and velocity, m/s, at the epoch; complex numbers pass through.
    time : array (N,)
        s after the epoch, in order.
    rtol : float
        Of each step; the absolute tolerances are a tenth of a millimetre and of 1e-7 m/s.

    Returns
    -------
    array (..., N, 6)

    Raises
    ------
    ArithmeticError
        Where the integrator gives up.
    """
    start = np.asarray(start)
    atol = np.broadcast_to([1e-4] * 3 + [1e-7] * 3, start.shape).ravel()

    def derivative(t: float, y: Array) -> Array:
        state = y.reshape(start.shape)
        r, v = state[..., :3], state[..., 3:]
        return np.concatenate([v, forces.acceleration(t, r, v)], axis=-1).ravel()

    flown = solve_ivp(
        derivative, (0.0, time[-1]), start.ravel(), "DOP853", time, rtol=rtol, atol=atol
    )
    if not flown.success:
        raise ArithmeticError(f"the orbit could not be integrated: {flown.message}")
    return np.moveaxis(flown.y.reshape(*start.shape, len(time)), -1, -2)
