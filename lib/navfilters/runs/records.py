"""What a run keeps of its states: functions of a state, for ``record``."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.small_matrices import is_positive_definite
from navfilters.types import Array, Gaussian


def estimate(state: Any) -> Gaussian:
    """The mean and the covariance: what ``run`` keeps by default."""
    return state.estimate


def definite(state: Any) -> Array:
    """Whether the covariance has a Cholesky factor, (...): see ``first_indefinite``."""
    return is_positive_definite(state.estimate.cov)


@dataclass(frozen=True, eq=False)
class Distance:
    """Distance of the estimate from a truth.

    Parameters
    ----------
    truth : array (..., k)
        The true values of the first k components of the state.

    Raises
    ------
    ValueError
        A truth that is no array of finite numbers, or has more components than the state.
    """

    truth: Array = field(metadata={"axes": 1})

    def __post_init__(self) -> None:
        object.__setattr__(self, "truth", validation.real_array("truth", self.truth, "k"))

    def __call__(self, state: Any) -> Array:
        """The distance, (...)."""
        mean = state.estimate.mean
        xp = mean.__array_namespace__()
        truth = xp.asarray(self.truth)
        if truth.shape[-1] > mean.shape[-1]:
            raise ValueError(
                f"truth must have shape (..., k) with k up to {mean.shape[-1]}; found {truth.shape}"
            )
        return xp.linalg.vector_norm(mean[..., : truth.shape[-1]] - truth, axis=-1)


def put(kept: Any, row: Any, i: int, count: int) -> Any:
    """A record with one more row, part by part; its arrays are made once, for all rows.

    Parameters
    ----------
    kept : array (count, ...), None, or tuples of them
        Of the rows before; None before the first.
    row : array, number, None, or tuples of them
        What is None at first and an array later is NaN at first; batch axes may grow.
    i : int
        Its number.
    count : int

    Returns
    -------
    As a row, of ndarrays (count, ...), filled to row i.
    """
    if isinstance(row, tuple):
        olds = (None,) * len(row) if kept is None else kept
        parts = [put(old, part, i, count) for old, part in zip(olds, row, strict=True)]
        return type(row)(*parts) if hasattr(row, "_fields") else tuple(parts)
    if row is None:
        return kept
    row = np.asarray(row)
    if kept is None:
        blank = np.nan if row.dtype.kind in "fc" else 0
        kept = np.empty((count, *row.shape), row.dtype)
        kept[:i] = blank
    elif kept.shape[1:] != row.shape or kept.dtype != row.dtype:
        shape = np.broadcast_shapes(kept.shape[1:], row.shape)
        grown = np.empty((count, *shape), np.result_type(kept, row))
        grown[:i] = kept[:i].reshape(i, *(1,) * (len(shape) + 1 - kept.ndim), *kept.shape[1:])
        kept = grown
    kept[i] = row
    return kept
