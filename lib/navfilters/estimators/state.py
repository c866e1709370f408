"""What a filter knows after a step."""

from math import log, pi
from typing import Any, NamedTuple

import numpy as np

from navfilters.estimators.rule import Rule, zeros
from navfilters.numerics import validation
from navfilters.numerics.small_matrices import cholesky, is_positive_definite, whitened_square
from navfilters.types import Array, Gaussian


class FilterState(NamedTuple):
    """A filter's estimate, and what it was made from.

    Parameters
    ----------
    estimate : Gaussian
        mean (..., n), cov (..., n, n). Where the state is no vector, mean is the state and cov is
        that of its error, truth minus estimate.
    missed : int array (...)
        Updates so far at which nothing was measured.
    memory : named tuple of arrays, optional
        That of the filter's rule.
    innovation : array (..., m), optional
        Measured minus expected at the last update; NaN where it was not measured. None before it.
    S : array (..., m, m), optional
        The covariance that the filter gave it.
    """

    estimate: Gaussian
    missed: Array
    memory: Any = None
    innovation: Array | None = None
    S: Array | None = None

    @property
    def log_likelihood(self) -> Array | None:
        """Log-density of the last innovation, (...): 0 where nothing was measured; None before."""
        y, S = self.innovation, self.S
        if y is None:
            return None
        xp = y.__array_namespace__()
        gone = xp.isnan(y) & ~xp.isnan(xp.linalg.diagonal(S))
        either = gone[..., :, None] | gone[..., None, :]
        L = cholesky(xp.where(either, xp.eye(y.shape[-1]), S))
        square = whitened_square(L, xp.where(gone, 0.0, y))
        measured = xp.sum(~gone, axis=-1)
        logarithms = xp.sum(xp.log(xp.linalg.diagonal(L)), axis=-1)
        return -square / 2 - logarithms - measured * (log(2 * pi) / 2)

    @property
    def healthy(self) -> Array:
        """Whether the mean is finite and the covariance has a Cholesky factor, (...)."""
        mean, cov = self.estimate
        xp = mean.__array_namespace__()
        return xp.all(xp.isfinite(mean), axis=-1) & is_positive_definite(cov)


def given_prior(prior: Gaussian) -> Gaussian:
    """A prior whose arrays are of a kind that products keep."""
    mean, cov = prior.mean, prior.cov
    if type(mean) is type(cov) is np.ndarray and mean.dtype.char == cov.dtype.char == "d":
        return prior
    return Gaussian(validation.given("prior.mean", mean), validation.given("prior.cov", cov))


def first_state(prior: Gaussian, rule: Rule | None = None) -> FilterState:
    """The state before any step, of a filter with this rule."""
    prior = given_prior(prior)
    n = prior.cov.shape[-1:] if prior.cov.ndim else (0,)
    if prior.mean.ndim == 0:
        raise ValueError("prior.mean must have shape (..., n); found ()")
    validation.core("prior.cov", prior.cov, n + n)
    return FilterState(prior, zeros(prior), None if rule is None else rule.init(prior))


def missed(state: FilterState, gone: Array | None) -> Array:
    """The counter of updates at which nothing was measured."""
    if gone is None:
        return state.missed
    return state.missed + gone.__array_namespace__().all(gone, axis=-1)


def kept(gone: Array | None, before: Gaussian, after: Gaussian) -> Gaussian:
    """The estimate as it was in the members of which nothing was measured."""
    if gone is None:
        return after
    return keep_estimate(gone.__array_namespace__().all(gone, axis=-1), before, after)


def keep_estimate(some: Array, before: Gaussian, after: Gaussian) -> Gaussian:
    """``before`` in some members, ``after`` in the others, which may have more batch axes."""
    xp = some.__array_namespace__()
    return Gaussian(
        xp.where(some[..., None], before.mean, after.mean),
        xp.where(some[..., None, None], before.cov, after.cov),
    )


def keep(some: Array, before: Any, after: Any) -> Any:
    """The same of any arrays, part by part; ``some`` has all their batch axes."""
    if after is None:
        return None
    if isinstance(after, tuple):
        olds = (None,) * len(after) if before is None else before
        parts = [keep(some, old, new) for old, new in zip(olds, after, strict=True)]
        return type(after)(*parts) if hasattr(after, "_fields") else tuple(parts)
    xp = after.__array_namespace__()
    where = some[(..., *(None,) * (after.ndim - some.ndim))]
    return xp.where(where, xp.nan if before is None else before, after)
