"""The fixed point of Perea et al. with the noise that its filters are told of."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from navfilters.models import RangeBearing
from navfilters.papers.perea2007.exact_posterior import ExactPosterior, cartesian
from navfilters.papers.perea2007.experiment import position_error
from navfilters.runs.consistency import nees, nis
from navfilters.runs.sweeping import sweep
from navfilters.types import Array, Gaussian

UPDATES = (1, 3, 10, 30, 100, 300, 1000)
"""After how many updates a filter is looked at."""

BLOCK = 500
"""Runs whose histories are held at a time."""

EDGE = 5.991464547107979
"""The square of the Mahalanobis distance within which a Gaussian of the plane has 95 %."""


class Belief(NamedTuple):
    """What a filter believes, and what it was surprised by last.

    Parameters
    ----------
    mean : array (..., 2)
    cov : array (..., 2, 2)
    innovation : array (..., 2), optional
    S : array (..., 2, 2), optional
    """

    mean: Array
    cov: Array
    innovation: Array = None
    S: Array = None


def belief(state: Any) -> Belief:
    """Of a filter's state: a record for ``run`` and ``sweep``.

    Parameters
    ----------
    state : FilterState

    Returns
    -------
    Belief
    """
    estimate = state.estimate
    return Belief(estimate.mean, estimate.cov, state.innovation, state.S)


def measurements(x_true: Any, model: RangeBearing, steps: int, runs: int, seed: Any = 0) -> Array:
    """Ranges and bearings with noise.

    Parameters
    ----------
    x_true : array-like (2,) or (runs, 2)
        The point, units.
    model : RangeBearing
        Whose R is diagonal.
    steps : int
        How many each run has.
    runs : int
    seed : int or sequence of int

    Returns
    -------
    array (steps, runs, 2)
        Not wrapped.
    """
    noise = np.random.default_rng(seed).standard_normal((runs, steps, 2)).swapaxes(0, 1)
    deviation = np.sqrt(np.diagonal(model.R, axis1=-2, axis2=-1))
    return model.h(np.asarray(x_true, float)) + deviation * noise


def follow(
    estimator: Any,
    prior: Gaussian,
    z: Array,
    model: RangeBearing,
    updates: Sequence[int] = UPDATES,
    *,
    done: Callable[[int], Any] = bool,
) -> Belief:
    """A filter over many runs, looked at after some of its updates.

    Parameters
    ----------
    estimator : Filter
    prior : Gaussian
        mean (2,) or (runs, 2), with its cov.
    z : array (steps, runs, 2)
    model : RangeBearing
        Without batch axes.
    updates : sequence of int
        The last is at most the number of steps.
    done : callable
        Is told the number of runs that were finished.

    Returns
    -------
    Belief
        Arrays (len(updates), runs, ...). Not finite where a filter could not go on.
    """
    runs = z.shape[1]
    start = Gaussian(
        np.broadcast_to(prior.mean, (runs, 2)), np.broadcast_to(prior.cov, (runs, 2, 2))
    )
    kept = []
    for first in range(0, runs, BLOCK):
        part = slice(first, first + BLOCK)
        block = sweep(
            estimator,
            Gaussian(start.mean[part], start.cov[part]),
            z[: updates[-1], part],
            model,
            z_per_step=True,
            record=belief,
            workers=1,
            progress=False,
        ).record
        kept.append([leaf[list(updates)] for leaf in block])
        done(len(block.mean[0]))
    return Belief(*(np.concatenate(leaf, axis=1) for leaf in zip(*kept, strict=True)))


def batch(
    prior: Gaussian, z: Array, model: RangeBearing, updates: Sequence[int] = UPDATES
) -> Belief:
    """Least squares over all measurements at once, and the inverse of the information there.

    Parameters
    ----------
    prior, z, model, updates
        As of :func:`follow`. R is diagonal.

    Returns
    -------
    Belief
        Where the prior and all measurements fit best, by Gauss-Newton: linearised at the end only.
    """
    x, cov = [], []
    for n in updates:
        z_mean = np.mean(z[:n], axis=0)
        at, weight, information = (
            cartesian(z_mean),
            np.linalg.inv(prior.cov),
            n * np.linalg.inv(model.R),
        )
        for _ in range(8):
            H = model.jacobian(at)
            pull = H.mT @ information
            P = np.linalg.inv(weight + pull @ H)
            slope = pull @ (z_mean - model.h(at))[..., None]
            slope = slope + weight @ (prior.mean - at)[..., None]
            at = at + (P @ slope)[..., 0]
        x.append(at)
        cov.append(P)
    return Belief(np.stack(x), np.stack(cov))


def exact(
    prior: Gaussian | None,
    z: Array,
    model: RangeBearing,
    updates: Sequence[int] = UPDATES,
    **options: Any,
) -> list[ExactPosterior]:
    """The exact posterior after each of some numbers of updates.

    Parameters
    ----------
    prior, z, model, updates
        As of :func:`follow`; the prior as of ``ExactPosterior``.
    **options
        Those of its ``ExactPosterior``.

    Returns
    -------
    list of ExactPosterior
        With the runs as batch axis.
    """
    return [ExactPosterior(np.mean(z[:n], axis=0), n, model.R, prior, **options) for n in updates]


class Score(NamedTuple):
    """How good and how honest a belief is, in each run: arrays (..., runs).

    Parameters
    ----------
    error : array
        Distance from the truth, units.
    nees : array
        Normalised square of the error in the plane; 2 on average, and above 5.99 in 5 %, if
        Gaussian and honest. NaN where the covariance is not positive definite.
    nees_measured : array
        The same of range and bearing, of which the covariance is H P H^T at the estimate.
    nis : array
        Normalised square of the last innovation.
    lost : bool array
        Whether the error is more than three times as long as the filter expects.
    """

    error: Array
    nees: Array
    nees_measured: Array
    nis: Array
    lost: Array


def score(of: Belief, x_true: Any, model: RangeBearing) -> Score:
    """How good and how honest a belief is.

    Parameters
    ----------
    of : Belief
    x_true : array-like (2,) or (runs, 2)
        Units.
    model : RangeBearing

    Returns
    -------
    Score

    Notes
    -----
    A filter is lost by the definition of perea2007, section I: a large error beside a small
    covariance. Here, more than three times the root of the trace, which is the length of the error
    that it expects; a covariance that is not positive definite expects nothing, and is lost.
    """
    x_true = np.asarray(x_true, float)
    error = position_error(of.mean, x_true)
    with np.errstate(all="ignore"):
        H = model.jacobian(of.mean)
        measured = RangeBearing(model.R, wrap=True).residual(model.h(x_true), model.h(of.mean))
        q = nees(x_true - of.mean, of.cov)
        q_measured = nees(measured, H @ of.cov @ H.mT)
        expected = np.sqrt(np.trace(of.cov, axis1=-2, axis2=-1))
        lost = ~((error <= 3 * expected) & np.isfinite(q))
        surprise = nis(of.innovation, of.S) if of.S is not None else np.full_like(q, np.nan)
    return Score(error, q, q_measured, surprise, lost)


def bound(x_true: Any, model: RangeBearing, updates: Sequence[int] = UPDATES) -> Array:
    """Root mean square error that no unbiased estimate goes below, units, (len(updates),).

    Parameters
    ----------
    x_true : array-like (2,)
    model : RangeBearing
        Whose R is diagonal.
    updates : sequence of int

    Returns
    -------
    array (len(updates),)
        The bound of Cramer and Rao, without a prior.
    """
    r = float(np.hypot(*x_true))
    return np.sqrt((model.R[0, 0] + r**2 * model.R[1, 1]) / np.asarray(updates))
