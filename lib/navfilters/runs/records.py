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


def stacked(rows: list[Any]) -> Any:
    """Rows of one structure with the step in front, part by part.

    Parameters
    ----------
    rows : list
        Of arrays, numbers, None, or tuples of them. What is None at first and an array later is
        NaN at first; batch axes may grow from row to row.

    Returns
    -------
    As a row, of ndarrays (len(rows), ...).
    """
    last = rows[-1]
    if last is None:
        return None
    if isinstance(last, tuple):
        parts = [
            stacked([None if row is None else row[i] for row in rows]) for i in range(len(last))
        ]
        return type(last)(*parts) if hasattr(last, "_fields") else tuple(parts)
    shape = np.broadcast_shapes(*(np.shape(row) for row in rows if row is not None))
    blank = np.nan if np.asarray(last).dtype.kind in "fc" else 0
    return np.stack([np.broadcast_to(blank if row is None else row, shape) for row in rows])
