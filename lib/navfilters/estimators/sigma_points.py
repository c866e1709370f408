"""Where an unscented filter samples its prior, and how it weighs the samples."""

from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, Literal

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.in_floats import POINTS, in_floats
from navfilters.numerics.matrix_roots import semidefinite_root, symmetric_root
from navfilters.numerics.small_matrices import outer_sum
from navfilters.types import Array, Gaussian


@dataclass(frozen=True)
class SigmaPoints:
    """Where an unscented filter samples its prior, and how it weighs the samples.

    Parameters
    ----------
    alpha : float or array (...)
        Spread, larger than 0. An array is one setting per member of the batch.
    beta : float or array (...)
        Added to the central covariance weight; 2 is right for a Gaussian.
    kappa : float or array (...), optional
        Second spread parameter, larger than -n. By default 3 - n, n being the state's size.
    root : {"cholesky", "symmetric"}
        The matrix square root whose columns become the sigma points.

    Raises
    ------
    ValueError
        An unknown root; alpha, beta or kappa not finite numbers; alpha not positive.

    References
    ----------
    perea2007, Eq. (21), which leaves all four open; the names are those of its reference 12.
    """

    alpha: Array = 1.0
    beta: Array = 2.0
    kappa: Array | None = None
    root: Literal["cholesky", "symmetric"] = "cholesky"

    def __post_init__(self) -> None:
        if self.root not in ROOTS:
            raise ValueError(f"root must be one of {list(ROOTS)}; found {self.root!r}")
        for name in ("alpha", "beta") if self.kappa is None else ("alpha", "beta", "kappa"):
            value = validation.real_array(name, getattr(self, name), "")
            if name == "alpha" and (value <= 0).any():
                raise ValueError(f"alpha must be positive; found {value.min()}")

    def weights(self, n: int, xp: Any = None) -> tuple[Array, Array, Array, Array]:
        """Scaling and weights for a state of size n.

        Parameters
        ----------
        n : int
            Size of the state.
        xp : array namespace, optional
            Of the results; NumPy by default.

        Returns
        -------
        tuple of array (...)
            (gamma, W0_m, W0_c, W_i): the scale of the offsets, the central point's weight in means
            and in covariances, and the weight of each of the 2 n other points.
        """
        if xp in (None, np) and {type(self.alpha), type(self.beta), type(self.kappa)} <= NUMBERS:
            return _weights(self, n)
        return self._weights(n, np if xp is None else xp)

    def _weights(self, n: int, xp: Any) -> tuple[Array, Array, Array, Array]:
        given = 3.0 - n if self.kappa is None else self.kappa
        if not validation.traced(given) and np.any(n + np.asarray(given) <= 0):
            raise ValueError(
                f"kappa must be larger than {-n} for a state of size {n}; found {given}"
            )
        alpha, beta, kappa = (xp.asarray(v, dtype=float) for v in (self.alpha, self.beta, given))
        scale = alpha**2 * (n + kappa)  # n + lambda
        W0_m = 1 - n / scale
        return xp.sqrt(scale), W0_m, W0_m + 1 - alpha**2 + beta, 0.5 / scale


ROOTS = ("cholesky", "symmetric")
NUMBERS = {float, int, type(None)}


@lru_cache
def _weights(points: SigmaPoints, n: int) -> tuple[Array, Array, Array, Array]:
    """Those of plain numbers, which a filter asks for twice an update."""
    return points._weights(n, np)


def root_of(cov: Array, kind: str) -> tuple[Array, Array | None]:
    """The root of a covariance whose columns become the points, and what it knows exactly.

    A state or a combination without variance has no points of its own. A covariance that is
    positive definite has the root that it always had, to the last bit.
    """
    S, exact = semidefinite_root(cov)
    if kind == "symmetric":
        S = symmetric_root(cov, None if exact is None else is_singular(exact))
    return S, exact


def is_singular(exact: Array) -> Array:
    xp = exact.__array_namespace__()
    return xp.any(xp.linalg.diagonal(exact) == 0, axis=-1)


def sigma_points(prior: Gaussian, points: SigmaPoints) -> Array:
    """The 2 n + 1 sigma points of a prior: its mean, then mean + and mean - each scaled column.

    Parameters
    ----------
    prior : Gaussian
        mean (..., n), cov (..., n, n).
    points : SigmaPoints
        Scaling and square root.

    Returns
    -------
    array (2 n + 1, ..., n)
        The points in *front* of the batch axes, so that a model's own batch axes still line up.
        NaN, except the mean, where cov has no square root: where it is not positive semidefinite.

    References
    ----------
    perea2007, Eq. (21).
    """
    return prior.mean + offsets(prior, points, root_of(prior.cov, points.root)[0])


def offsets(prior: Gaussian, points: SigmaPoints, root: Array) -> Array:
    """What the points have that the mean has not, with all the batch axes of both."""
    gamma, *_ = points.weights(root.shape[-1], root.__array_namespace__())
    if gamma.ndim:
        validation.batch(points=gamma.shape, prior=root.shape[:-2])
    return _columns(prior.mean, gamma[..., None, None], root)


@in_floats
def _columns(mean: Array, gamma: Array, root: Array) -> Array:
    """Nothing, then each column of gamma root, then minus each of them."""
    xp, S = root.__array_namespace__(), gamma * root
    batch = xp.broadcast_shapes(S.shape[:-2], mean.shape[:-1])
    k = len(batch) + 1
    columns = xp.permute_dims(xp.broadcast_to(S, (*batch, *S.shape[-2:])), (k, *range(k)))
    return xp.concat([xp.zeros_like(columns[:1]), columns, -columns], axis=0)


@partial(in_floats, longest=POINTS)
def spread(dZ: Array, noise: Array, W0_c: Array, W_i: Array) -> Array:
    """noise + sum W_c dZ dZ^T over the points, (..., m, m); weights (..., 1, 1)."""
    return noise + W0_c * outer_sum(dZ[:1], dZ[:1]) + W_i * outer_sum(dZ[1:], dZ[1:])


@partial(in_floats, longest=POINTS)
def spreads(dX: Array, dZ: Array, noise: Array, W0_c: Array, W_i: Array) -> tuple[Array, Array]:
    """The same, and sum W_c dX dZ^T, (..., n, m): dX is zero at the first point."""
    return spread(dZ, noise, W0_c, W_i), W_i * outer_sum(dX[1:], dZ[1:])


def behind(X: Array, missing: int) -> Array:
    """Points with so many axes of length one behind that of the points."""
    return X.__array_namespace__().reshape(X, (X.shape[0], *(1,) * missing, *X.shape[1:]))
