"""The bound of Cramer and Rao for the flight of Xiong et al."""

from dataclasses import replace
from typing import Literal

import numpy as np

from navfilters.numerics.small_matrices import right_divide
from navfilters.papers.xiong2009.experiment import Setup, _variant
from navfilters.papers.xiong2009.true_flight import truth
from navfilters.space.thrust import COASTING
from navfilters.types import Array


def cramer_rao_bound(
    variant: str | Setup = "A",
    *,
    thrust: Literal["known", "unknown", "strength"] = "known",
    process_noise: bool = True,
    acceleration: float | None = None,
) -> Array:
    """Smallest deviation of each position component of an unbiased estimate, at each second.

    J_t = (F J_{t-1}^-1 F^T + Q)^-1 + H^T R^-1 H   along the true flight,
    the first estimate with its P0 counted as one more measurement

    Parameters
    ----------
    variant : str or Setup
        A key of ``VARIANTS``, or a set-up of one noise.
    thrust : {"known", "unknown", "strength"}
        Unknown: in each sampling interval with fire its acceleration is another unknown constant
        vector, appended to the state. Strength: it is along the velocity, and only its strength is
        unknown, the same in all burns.
    process_noise : bool
        Without, the limit of the experiment, whose truth has none; with the filters' Q, the limit
        for an orbit that is disturbed as the filters believe.
    acceleration : float, optional
        Deviation of each component of the unknown acceleration, m/s^2, up to 1000. By default the
        true thrust's strength.

    Returns
    -------
    array (duration + 1, 3)
        Metres. ``root_mean_square`` of its window bounds the RMS over seeds of an RMS error.

    Raises
    ------
    ValueError
        An unknown variant or thrust, or an acceleration out of range.
    """
    setup = _variant(variant)
    if thrust not in ("known", "unknown", "strength"):
        raise ValueError(
            f"thrust must be one of ['known', 'strength', 'unknown']; found {thrust!r}"
        )
    flight, sensor = truth(setup), setup.sensor
    a = flight.thrust.magnitude if acceleration is None else acceleration
    if not 0 <= a <= 1000:  # beyond, doubles do not carry P
        raise ValueError(f"acceleration must be 0 to 1000 m/s^2; found {acceleration}")
    orbit = replace(setup, step=1.0).orbit(COASTING if thrust == "unknown" else flight.thrust)
    burning = flight.thrust.strength(np.arange(setup.duration) + 0.5) > 0
    F = np.zeros((setup.duration, 9, 9)) + np.eye(9)
    F[:, :6, :6] = orbit.transitions(flight.states)
    unknown = burning & (thrust == "unknown")
    F[:, :6, 6:] = unknown[:, None, None] * np.concatenate([np.eye(3) / 2, np.eye(3)])
    if thrust == "strength":
        v = flight.states[:-1, 3:] + flight.states[1:, 3:]
        u = v / np.linalg.norm(v, axis=1, keepdims=True)
        F[:, :6, 6] = burning[:, None] * np.concatenate([u / 2, u], axis=1)
    Q = np.pad(orbit.Q if process_noise else np.zeros((6, 6)), (0, 3))
    Phi, W = _since_start(F.reshape(-1, setup.interval, 9, 9), Q)
    H = np.pad(
        sensor.jacobian(flight.states[setup.interval :: setup.interval]), [(0, 0)] * 2 + [(0, 3)]
    )
    P = np.zeros((9, 9))
    P[:6, :6] = setup.prior.cov
    P[6, 6] = a**2
    path = [P[None]]
    for k in range(len(H)):
        if thrust == "unknown":
            P[6:], P[:, 6:] = 0, 0  # another acceleration, and nothing known of it
            P[6:, 6:] = a**2 * np.eye(3)
        path.append(Phi[k] @ P @ Phi[k].mT + W[k])
        P_xz = path[-1][-1] @ H[k].T
        K = right_divide(P_xz, H[k] @ P_xz + sensor.R)
        keep = np.eye(9) - K @ H[k]
        P = keep @ path[-1][-1] @ keep.T + K @ sensor.R @ K.T  # Joseph: P may span 20 decades
        path[-1][-1] = P
    return np.sqrt(np.diagonal(np.concatenate(path), axis1=1, axis2=2)[:, :3])


def _since_start(F: Array, Q: Array) -> tuple[Array, Array]:
    """Transition and accumulated noise from each interval's start to each of its seconds."""
    Phi, W = [F[:, 0]], [Q + np.zeros_like(F[:, 0])]
    for step in np.moveaxis(F[:, 1:], 1, 0):
        Phi.append(step @ Phi[-1])
        W.append(step @ W[-1] @ step.mT + Q)
    return np.stack(Phi, axis=1), np.stack(W, axis=1)
