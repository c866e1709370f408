"""z = H x + v."""

from dataclasses import dataclass

import numpy as np

from navfilters.numerics import validation
from navfilters.types import Array


@dataclass(frozen=True, eq=False)
class Linear:
    """A linear measurement, z = H x + v with v ~ N(0, R).

    Parameters
    ----------
    H : array (..., m, n)
        Measurement matrix.
    R : array (..., m, m)
        Noise covariance, symmetric positive definite, in the measurement's units squared.

    Raises
    ------
    ValueError
        Naming the argument, the value found and what is needed.
    """

    H: Array
    R: Array

    def __post_init__(self) -> None:
        H = validation.real_array("H", self.H, "m, n")
        R = validation.covariance("R", self.R, H.shape[-2], definite=True)
        batch = validation.batch(H=H.shape[:-2], R=R.shape[:-2])
        object.__setattr__(self, "H", H)
        object.__setattr__(self, "R", np.broadcast_to(R, (*batch, *R.shape[-2:])))

    def h(self, x: Array) -> Array:
        """H x, (..., m).

        Parameters
        ----------
        x : array (..., n)

        Returns
        -------
        array (..., m)
        """
        return (self.H @ x[..., None])[..., 0]

    def jacobian(self, x: Array) -> Array:
        """H itself, whatever x.

        Parameters
        ----------
        x : array (..., n)

        Returns
        -------
        array (..., m, n)
        """
        return x.__array_namespace__().asarray(self.H)

    def hessian(self, x: Array) -> Array:
        """Zeros, (..., m, n, n).

        Parameters
        ----------
        x : array (..., n)

        Returns
        -------
        array (..., m, n, n)
        """
        m, n = np.shape(self.H)[-2:]
        return x.__array_namespace__().zeros((*x.shape[:-1], m, n, n))
