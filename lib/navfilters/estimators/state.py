"""What a filter knows after a step."""

from math import log, pi
from typing import Any, NamedTuple

from navfilters.numerics.small_matrices import cholesky, is_positive_definite
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
        w, y = list[Array](), xp.where(gone, 0.0, y)
        for i in range(y.shape[-1]):
            w.append((y[..., i] - sum(L[..., i, j] * w[j] for j in range(i))) / L[..., i, i])
        measured = xp.sum(~gone, axis=-1)
        logarithms = xp.sum(xp.log(xp.linalg.diagonal(L)), axis=-1)
        return -sum(x * x for x in w) / 2 - logarithms - measured * (log(2 * pi) / 2)

    @property
    def healthy(self) -> Array:
        """Whether the mean is finite and the covariance has a Cholesky factor, (...)."""
        mean, cov = self.estimate
        xp = mean.__array_namespace__()
        return xp.all(xp.isfinite(mean), axis=-1) & is_positive_definite(cov)
