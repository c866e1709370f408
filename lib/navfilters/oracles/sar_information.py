"""What the SAR images tell in all, in one information matrix: no recursion, no gain, no filter.

The error at the end is a linear function of independent unit normal numbers: nine of the first
estimate, and nine of each interval's process noise. Each image measures another such function. So
the covariance at the end is B (I + sum_k A_k^T R_k^-1 A_k)^-1 B^T. Everything is taken along the
true flight, by the differences of ``sar_trn``; nothing of ours is imported but that.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from navfilters.oracles import sar_trn as again

STEPS = [100.0] * 3 + [1.0] * 3 + [1e-3] * 3 + [100.0] * 3
"""Of the differences by state and pixel: m, m/s, rad, m."""


class Image(NamedTuple):
    """An interval of the true flight and the image at its end.

    Parameters
    ----------
    F, Q : array (9, 9)
        Transition and process noise.
    H : array (5, 9)
        Of two ratios, the distance of the pixel ahead of the plane of zero Doppler, its range, and
        the speed.
    H_f : array (5, 3)
        Derivative with respect to the pixel.
    sweep : float
        How fast that distance falls, m/s.
    """

    F: np.ndarray
    Q: np.ndarray
    H: np.ndarray
    H_f: np.ndarray
    sweep: float


def all_images(flown: Sequence[Any]) -> list[Image]:
    """The images of the true flight, differentiated.

    Parameters
    ----------
    flown : sequence of Interval
        Of ``sar_second_order.intervals``, for F and Q.

    Returns
    -------
    list of Image
    """
    h, found = 0.5, list[Image]()
    middle = again.INTERVAL * np.arange(1, len(flown) + 1)
    times = np.stack([middle - h, middle, middle + h], axis=1).ravel()
    rs, vs = (a.reshape(len(flown), 3, 3) for a in again.truth(times))
    for interval, r, v in zip(flown, rs, vs, strict=True):
        T = again.attitude(r[1], v[1])
        pixel = again.ellipsoid_hit(r[1], T[2])
        J = again.difference(lambda e, a=(r[1], v[1], T, pixel): _rows(*a, e), STEPS)
        ahead = np.sum((pixel - r) * v, axis=1) / np.sqrt(np.sum(v * v, axis=1))
        sweep = (ahead[0] - ahead[2]) / (2 * h)
        found.append(Image(interval.F, interval.Q, J[:, :9], J[:, 9:], sweep))
    return found


def _rows(r, v, T, pixel, e):
    v, d = v + e[3:6], pixel + e[9:] - r - e[:3]
    s, speed = again.misalignment(e[6:9]) @ T @ d, np.sqrt(v @ v)
    return np.array([s[0] / s[2], s[1] / s[2], d @ v / speed, np.sqrt(d @ d), speed])


def covariance(setup: Any, images: Sequence[Image], *arguments: Any, **errors: Any) -> np.ndarray:
    """Covariance of the error at the end, given all images at once.

    Parameters
    ----------
    setup, images, rows, clock, offset, pointing
        As of :func:`all_at_once`.

    Returns
    -------
    array (9, 9)
    """
    return all_at_once(setup, images, *arguments, **errors)[0]


def all_at_once(
    setup: Any,
    images: Sequence[Image],
    rows: Sequence[int] = (0, 1, 3, 4),
    *,
    clock: float = 0.0,
    offset: float = 0.0,
    pointing: float = 0.0,
    untold: Any = (0.0, 0.0, 0.0, 0.0, 0.0),
    bias: Any = (0.0, 0.0, 0.0, 0.0, 0.0),
    drift: Any = None,
) -> tuple[np.ndarray, float]:
    """Covariance at the end, and the expected NEES where the images err more than is said.

    Parameters
    ----------
    setup : Setup
        Any object with P0, sigma_range and sigma_speed.
    images : sequence of Image
    rows : sequence of int
        Which of the five are measured.
    clock : float
        Deviation of the error of each image's time, s.
    offset : float
        Deviation of an error of the time that is the same in all images, s.
    pointing : float
        Deviation of white errors of the two ratios.
    untold : array (5,)
        Deviations of more white errors, which are not in the covariance.
    bias : array (5,)
        Errors that are the same in all images, and not in it either.
    drift : array (k, 6), optional
        Where the true flight is at each image, less where the filter's forces would have led it.

    Returns
    -------
    array (9, 9)
    float
    """
    rows, D = list(rows), again.geolocation_covariance()
    size = 9 * (1 + len(images)) + 1  # the last one is the offset's
    B, information = np.zeros((9, size)), np.eye(size)
    more, pulled = np.zeros((size, size)), np.zeros(size)
    B[:, :9] = np.sqrt(setup.P0)
    for k, seen in enumerate(images):
        at, scale = 9 * (k + 1), np.sqrt(np.diag(seen.Q))
        B = seen.F @ B
        B[:, at : at + 9] = scale[:, None] * np.linalg.cholesky(seen.Q / np.outer(scale, scale))
        A = seen.H @ B
        A[2, -1] = seen.sweep * offset
        own = [pointing, pointing, seen.sweep * clock, setup.sigma_range, setup.sigma_speed]
        R = np.diag(np.square(own)) + seen.H_f @ D @ seen.H_f.T
        A, R = A[rows], R[np.ix_(rows, rows)]
        weight = np.linalg.solve(R, A).T
        information += weight @ A
        more += weight * np.square(untold)[rows] @ weight.T
        wrong_rows = np.asarray(bias, float)
        if drift is not None:
            wrong_rows = wrong_rows + seen.H[:, :6] @ drift[k]
        pulled += weight @ wrong_rows[rows]
    through = np.linalg.solve(information, B.T).T
    P, away = B @ through.T, through @ pulled
    if drift is not None:
        away[:6] -= drift[-1]
    wrong, unit = through @ more @ through.T + np.outer(away, away), np.sqrt(np.diag(P))
    scale = np.outer(unit, unit)
    return P, 9 + float(np.trace(np.linalg.solve(P / scale, wrong / scale)))
