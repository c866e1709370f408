"""Gravity to degree 4 by its potential on the sphere, and a flight in it; imports only ``sar_trn``.

Legendre functions of SciPy, a numerical gradient, inertial axes.
"""

from math import factorial

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import lpmv

from navfilters.oracles import sar_trn as again

COEFFICIENTS = {
    (2, 1): (-0.186987635955e-9, 0.119528012031e-8),
    (2, 2): (0.243914352398e-5, -0.140016683654e-5),
    (3, 0): (0.957254173792e-6, 0.0),
    (3, 1): (0.202998882184e-5, 0.248513158716e-6),
    (3, 2): (0.904627768605e-6, -0.619025944205e-6),
    (3, 3): (0.721072657057e-6, 0.141435626958e-5),
    (4, 0): (0.539873863789e-6, 0.0),
    (4, 1): (-0.536321616971e-6, -0.473440265853e-6),
    (4, 2): (0.350694105785e-6, 0.662671572540e-6),
    (4, 3): (0.990771803829e-6, -0.200928369177e-6),
    (4, 4): (-0.188560802735e-6, 0.308853169333e-6),
}
"""Fully normalised C and S of EGM96 by degree and order, without those of two bodies and of J2."""


def potential(p: np.ndarray) -> float:
    """What these terms add to the potential at an Earth-fixed point, m^2/s^2.

    Parameters
    ----------
    p : array (3,)

    Returns
    -------
    float
    """
    d, longitude, total = np.sqrt(p @ p), np.arctan2(p[1], p[0]), 0.0
    for (n, m), (C, S) in COEFFICIENTS.items():
        norm = ((1 if m == 0 else 2) * (2 * n + 1) * factorial(n - m) / factorial(n + m)) ** 0.5
        wave = C * np.cos(m * longitude) + S * np.sin(m * longitude)
        total += (again.RE / d) ** n * (-1) ** m * norm * lpmv(m, n, p[2] / d) * wave
    return again.GM / d * total


def flight(times: np.ndarray) -> np.ndarray:
    """Earth-fixed positions and velocities, from the state of ``sar_trn``, (k, 6), m, m/s.

    Parameters
    ----------
    times : array (k,)
        Increasing, from 0, s.

    Returns
    -------
    array (k, 6)
    """

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        turn = again.spin(again.OMEGA * t)
        p = turn @ y[:3]
        pull = again.difference(lambda e: np.array([potential(p + e)]), [1e3] * 3)[0]
        return np.concatenate([y[3:], again.gravity(y[:3]) + turn.T @ pull])

    r, v = again.initial_state()
    w = np.array([0.0, 0.0, again.OMEGA])
    first = np.concatenate([r, v + np.cross(w, r)])
    y = solve_ivp(rate, (0.0, times[-1]), first, t_eval=times, rtol=1e-10, atol=1e-5).y.T
    turns = [again.spin(again.OMEGA * t) for t in times]
    fixed = [(T @ a[:3], T @ a[3:]) for T, a in zip(turns, y, strict=True)]
    return np.array([np.concatenate([r, v - np.cross(w, r)]) for r, v in fixed])
