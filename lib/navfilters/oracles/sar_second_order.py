"""The SAR filter's errors to second order, without a run: of the second program and nothing else.

Everything is taken along the true flight, by the differences of ``sar_trn``. A set-up is any object
with the fields of ``navfilters.papers.pogorelsky2020.Setup`` that are used.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from navfilters.oracles import sar_trn as again

STEPS = [100.0] * 3 + [1.0] * 3 + [1e-3] * 3
"""Of the differences: m, m/s, rad."""


class Interval(NamedTuple):
    """An interval of the true flight and the image at its end.

    Parameters
    ----------
    F, Q : array (9, 9)
        Transition and process noise.
    H : array (4, 9)
    H_f : array (4, 3)
        Derivative with respect to the pixel.
    bend : array (4, 9, 9)
        Second derivatives of the four rows.
    d : array (3,)
        From the spacecraft to the pixel, m.
    """

    F: np.ndarray
    Q: np.ndarray
    H: np.ndarray
    H_f: np.ndarray
    bend: np.ndarray
    d: np.ndarray


def intervals(images: int = 72) -> list[Interval]:
    """All intervals of the true flight.

    Parameters
    ----------
    images : int

    Returns
    -------
    list of Interval
    """
    states = zip(*again.truth(again.INTERVAL * np.arange(images + 1)), strict=True)
    return [_interval(*pair) for pair in pairwise(states)]


def _interval(before: Any, at: Any) -> Interval:
    r, v = at
    T, F = again.attitude(r, v), np.eye(9)
    pixel = again.ellipsoid_hit(r, T[2])

    def fly_on(e):
        flown = again.flow(before[0] + e[:3], before[1] + e[3:], [again.INTERVAL])
        return np.concatenate([*flown], axis=1)[0]

    def h(e):
        T_mu = again.misalignment(e[:, 6:])
        return again.measure(r + e[:, :3], v + e[:, 3:6], T_mu, pixel, T)

    def slope(e):
        return again.difference_at_once(lambda more: h(e + more), STEPS).ravel()

    F[:6, :6] = again.difference(fly_on, STEPS[:6])
    Q = again.predict(before[0], before[1], np.eye(3), np.zeros((9, 9)), again.INTERVAL)[3]
    bend = again.difference(slope, STEPS).reshape(4, 9, 9)
    H, H_f = again.jacobians(r, v, np.eye(3), pixel, T)
    return Interval(F, Q, H, H_f, (bend + bend.mT) / 2, pixel - r)


class Step(NamedTuple):
    """An interval and its update.

    Parameters
    ----------
    F, before : array (9, 9)
        Transition, and covariance before the update.
    H : array (4, 9)
    R : array (4, 4)
        R + B.
    K : array (9, 4)
    bend : array (4, 9, 9)
    d : array (3,)
    """

    F: np.ndarray
    before: np.ndarray
    H: np.ndarray
    R: np.ndarray
    K: np.ndarray
    bend: np.ndarray
    d: np.ndarray


def linear_filter(setup: Any, flown: Sequence[Interval]) -> tuple[list[Step], np.ndarray]:
    """The filter, linearised about the true flight.

    Parameters
    ----------
    setup : Setup
    flown : sequence of Interval

    Returns
    -------
    list of Step
    array (9, 9)
        Covariance after the last update.
    """
    steps, P, D = list[Step](), setup.P0, again.geolocation_covariance()
    noise = np.diag([0.0, 0.0, setup.sigma_range**2, setup.sigma_speed**2])
    for k, (F, Q, H, H_f, bend, d) in enumerate(flown):
        before, R = F @ P @ F.T + Q, noise + H_f @ D @ H_f.T
        b = setup.underweighting if k < setup.underweighted else 0.0
        HPH = H @ before @ H.T
        K = np.linalg.solve((1 + b) * HPH + R, H @ before).T
        A = np.eye(9) - K @ H
        P = A @ before @ A.T + K @ (b * HPH + R) @ K.T
        steps.append(Step(F, before, H, R, K, bend, d))
    return steps, P


def principal(P: np.ndarray, unit: Any = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Deviations and axes of a covariance, the tightest first.

    Parameters
    ----------
    P : array (..., n, n)
    unit : array (n,)
        What each component is counted in.

    Returns
    -------
    array (..., n)
    array (..., n, n)
        The axes are its columns.
    """
    w, V = np.linalg.eigh(P / np.multiply.outer(unit, unit))
    return np.sqrt(w), V


def bend(steps: Sequence[Step], P: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What one deviation along the weak direction adds to the error at the end, by the range alone.

    c_k = (I - K_k H_k) F_k c_{k-1} - K_k^(rho) g_k, with g_k = s_k^2 / 2 rho_k of the part s_k
    across the line of sight of the error before update k that goes with one deviation at the end.

    Parameters
    ----------
    steps : sequence of Step
    P : array (9, 9)
        Covariance at the end.

    Returns
    -------
    array (9,)
        c, the last of the c_k.
    array (k,)
        The gaps g_k, m.
    """
    row = np.concatenate([principal(P[:3, :3])[1][:, -1], np.zeros(6)])
    into, m = np.eye(9), list[np.ndarray]()
    for step in reversed(steps):
        into = into @ (np.eye(9) - step.K @ step.H)
        m.insert(0, step.before @ into.T @ row / np.sqrt(row @ P @ row))
        into = into @ step.F
    c, gaps = np.zeros(9), list[float]()
    for step, m_k in zip(steps, m, strict=True):
        rho_k = np.linalg.norm(step.d)
        s2 = m_k[:3] @ m_k[:3] - (m_k[:3] @ step.d / rho_k) ** 2
        gaps.append(s2 / (2 * rho_k))
        c = (np.eye(9) - step.K @ step.H) @ step.F @ c - step.K[:, 2] * gaps[-1]
    return c, np.array(gaps)


def second_order(
    setup: Any,
    flown: Sequence[Interval],
    *,
    true: Any = None,
    rows: Sequence[int] = (0, 1, 2, 3),
) -> tuple[float, float, float]:
    """The three sums of the expected NEES at the end: linear, shift and scatter.

    sum norm(l_i)^2, (tr A_i)^2 and 2 tr A_i^2, where component i of the final error in units of P
    is l_i^T xi - xi^T A_i xi of the unit normal numbers xi of a run.

    Parameters
    ----------
    setup : Setup
        Of the filter.
    flown : sequence of Interval
    true : Setup, optional
        Of the first errors, the walk and the range noise; the filter's by default.
    rows : sequence of int
        Which of the four measured rows are curved.

    Returns
    -------
    tuple of float
    """
    true = setup if true is None else true
    steps, P = linear_filter(setup, flown)
    first = np.sqrt(np.diag(setup.P0))
    size = 9 + 7 * len(steps)
    G, before = np.zeros((9, size)), list[np.ndarray]()
    G[:, :9] = np.sqrt(true.P0)
    for k, step in enumerate(steps):
        G, at = step.F @ G, 9 + 7 * k
        G[6:, at : at + 3] = np.sqrt(true.psd_mu * true.interval) * np.eye(3)
        before.append(G[:, : at + 3])
        R = step.R + np.diag([0, 0, true.sigma_range**2 - setup.sigma_range**2, 0])
        G = G - step.K @ step.H @ G
        G[:, at + 3 : at + 7] = -step.K @ np.linalg.cholesky(R)
    whiten = np.linalg.inv(np.linalg.cholesky(P / np.outer(first, first))) / first
    into, A, curved = whiten, np.zeros((9, size, size)), list(rows)
    for step, G_k in zip(reversed(steps), reversed(before), strict=True):
        gain, n = (into @ step.K)[:, curved], G_k.shape[1]
        half = np.einsum("ia,apq->ipq", gain, step.bend[curved]) / 2
        left = G_k.T @ half
        for column in range(0, n, 32):  # so few at once that BLAS starts no threads, which wait
            columns = slice(column, min(column + 32, n))
            A[:, :n, columns] += left @ G_k[:, columns]
        into = into @ (np.eye(9) - step.K @ step.H) @ step.F
    shift = np.trace(A, axis1=1, axis2=2)
    return np.sum((whiten @ G) ** 2), shift @ shift, 2 * np.sum(A * A)
