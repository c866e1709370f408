"""On a linear problem a filter must be the Kalman filter, whatever is measured and known."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from navfilters.crash.check import Case, distance
from navfilters.crash.subject import Subject
from navfilters.models import Linear
from navfilters.types import Array, Gaussian

ROUNDING = 1e-7
"""In deviations: filters that compute in doubles are nearer, and all real faults farther."""

SIZES = ((1, 1), (2, 1), (2, 2), (3, 2), (4, 3), (2, 3))
STEPS = 6


@dataclass(frozen=True, eq=False)
class Motion:
    """x_k = F x_{k-1} + w."""

    F: Array
    Q: Array

    def f(self, x: Array) -> Array:
        """F x, (..., n)."""
        return (self.F @ x[..., None])[..., 0]

    def transition(self, x: Array) -> tuple[Array, Array]:
        """F x and F."""
        return self.f(x), self.F


def _problem(n: int, m: int, seed: int) -> tuple[Gaussian, Array, Linear, Motion]:
    rng = np.random.default_rng([seed, n, m])

    def covariance(size: int) -> Array:
        A = rng.normal(size=(size, size))
        return A @ A.T + 0.3 * np.eye(size)

    H = rng.normal(size=(m, n))
    F = np.eye(n) + 0.3 * rng.normal(size=(n, n))
    prior = Gaussian(rng.normal(size=(2, n)), covariance(n) * np.array([1.0, 3.0])[:, None, None])
    z = 2 * rng.normal(size=(STEPS, 2, m))
    return prior, z, Linear(H, covariance(m)), Motion(F, 0.2 * covariance(n))


def kalman(prior: Gaussian, z: Array, H: Array, R: Array, motion: Motion | None) -> Gaussian:
    """The textbook's filter in the information form, member by member, NaN left out.

    Parameters
    ----------
    prior : Gaussian
        mean (members, n), cov (members, n, n), definite.
    z : array (steps, members, m)
    H, R : array (m, n), (m, m)
    motion : Motion, optional

    Returns
    -------
    Gaussian
        (steps + 1, members, ...).
    """
    means, covs = [prior.mean], [prior.cov]
    for seen in z:
        rows = [
            _informed(x, P, y, H, R, motion)
            for x, P, y in zip(means[-1], covs[-1], seen, strict=True)
        ]
        means.append(np.array([x for x, _ in rows]))
        covs.append(np.array([P for _, P in rows]))
    return Gaussian(np.array(means), np.array(covs))


def _informed(x: Array, P: Array, z: Array, H: Array, R: Array, motion: Motion | None) -> Any:
    if motion is not None:
        x, P = motion.F @ x, motion.F @ P @ motion.F.T + motion.Q
    kept = ~np.isnan(z)
    if not kept.any():
        return x, P
    weight = H[kept].T @ np.linalg.inv(R[np.ix_(kept, kept)])
    new = np.linalg.inv(np.linalg.inv(P) + weight @ H[kept])
    new = (new + new.T) / 2
    return x + new @ weight @ (z[kept] - H[kept] @ x), new


def linear_updates(subject: Subject) -> Iterator[Case]:
    """Several updates of states that stand still."""
    yield from _compared(subject, moving=False)


def linear_motion(subject: Subject) -> Iterator[Case]:
    """Prediction and update in turn."""
    yield from _compared(subject, moving=True)


def _compared(subject: Subject, moving: bool) -> Iterator[Case]:
    for n, m in SIZES:
        prior, z, model, motion = _problem(n, m, 1)
        dynamics = motion if moving else None
        found = subject.history(prior, z, model, dynamics=dynamics)
        wanted = kalman(prior, z, model.H, model.R, dynamics)
        yield Case(f"{n} states, {m} measured", "deviations off", distance(found, wanted), ROUNDING)


def not_measured(subject: Subject) -> Iterator[Case]:
    """Components, and whole measurements, that are NaN."""
    prior, z, model, motion = _problem(3, 2, 2)
    for name, rows in (("one component", (1, 0, 1)), ("everything", (2, slice(None)))):
        gone = z.copy()
        gone[rows] = np.nan
        found = subject.history(prior, gone, model, dynamics=motion)
        wanted = kalman(prior, gone, model.H, model.R, motion)
        yield Case(f"{name} missing once", "deviations off", distance(found, wanted), ROUNDING)


def known_exactly(subject: Subject) -> Iterator[Case]:
    """A state of which a component has no variance keeps it, and learns the others."""
    P = np.diag([4.0, 0.0, 1.0])
    prior = Gaussian(np.array([[1.0, 2.0, 3.0]]), P[None])
    H = np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 1.0]])
    z = np.array([[[5.0, 4.0]]])
    found = subject.history(prior, z, Linear(H, np.eye(2)))
    S = H @ P @ H.T + np.eye(2)
    K = np.linalg.solve(S, H @ P).T
    mean = prior.mean + (K @ (z[0, 0] - H @ prior.mean[0]))[None]
    wanted = Gaussian(mean, (P - K @ S @ K.T)[None])
    off = distance(Gaussian(found.mean[-1], found.cov[-1]), wanted)
    yield Case("the second of three states is exact", "deviations off", off, ROUNDING)


def ten_decades(subject: Subject) -> Iterator[Case]:
    """A prior of 1e5 beside a sensor of 1e-5, nearly the same twice: definite, and right."""
    H = np.array([[1.0, 1.0], [1.0, 1.001]])
    R, P = 1e-10 * np.eye(2), 1e10 * np.eye(2)
    prior = Gaussian(np.zeros((1, 2)), P[None])
    x = np.array([1.0, -2.0])
    found = subject.history(prior, (H @ x)[None, None], Linear(H, R))
    info = np.linalg.inv(P) + H.T @ np.linalg.inv(R) @ H
    wanted = np.linalg.inv(info)
    cov, deviation = found.cov[-1, 0], np.sqrt(np.diag(wanted))
    lowest = np.linalg.eigvalsh(cov / np.outer(deviation, deviation))[0]
    label = "a sensor ten decades sharper than the prior"
    yield Case(label, "negative eigenvalue", float(max(0.0, -lowest)), 0.0)
    off = np.abs(found.mean[-1, 0] - x) / deviation
    yield Case(label, "deviations from the truth", float(off.max()), 1.0)
    size = np.sqrt(np.abs(np.diag(cov))) / deviation
    with np.errstate(divide="ignore"):
        factor = float(max(size.max(), 1 / size.min()))
    yield Case(label, "factor of its deviations", factor, 2.0)
