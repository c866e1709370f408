"""The two values that travel through every filter, and what a filter asks of a model.

Both are named tuples, so that JAX sees them as pytrees without being imported here, and so that
``mean, cov = history`` unpacks.
"""

from typing import Any, NamedTuple, Protocol

Array = Any  # any array of the Python array-API standard: NumPy, JAX


class Gaussian(NamedTuple):
    """A mean and a covariance: all that a Kalman-type filter knows of the state.

    Parameters
    ----------
    mean : array (..., n)
        State estimate, in the state's units. Leading axes are batch axes.
    cov : array (..., n, n)
        Covariance of the estimate.

    References
    ----------
    perea2007, Eqs. (1)-(4): x_hat and P_xx.
    """

    mean: Array
    cov: Array


class Moments(NamedTuple):
    """What a filter predicts of its measurement before it sees it.

    Parameters
    ----------
    z_hat : array (..., m)
        Expected measurement.
    P_zz : array (..., m, m)
        Covariance of the innovation, measurement noise included.
    P_xz : array (..., n, m)
        Covariance between state and measurement.

    References
    ----------
    perea2007, section II: the three quantities in which its filters differ.
    """

    z_hat: Array
    P_zz: Array
    P_xz: Array


class ExactMoments(Moments):
    """The moments of a prior that knows something exactly, for the update to keep.

    Still a tuple of three: it unpacks as :class:`Moments` does.

    Attributes
    ----------
    exact : array (..., n, n) or None
        T of :func:`navfilters.numerics.matrix_roots.semidefinite_root` of the prior's covariance.
    """

    exact: Array = None

    @classmethod
    def of(cls, moments: Moments, exact: Array) -> "ExactMoments":
        """The same moments with what their prior knows.

        Parameters
        ----------
        moments : Moments
        exact : array (..., n, n)

        Returns
        -------
        ExactMoments
        """
        made = cls(*moments)
        made.exact = exact
        return made

    def _replace(self, **changes: Array) -> "ExactMoments":
        return self.of(Moments(*self)._replace(**changes), self.exact)


class MeasurementModel(Protocol):
    """z = h(x) + v with v ~ N(0, R); see ``navfilters.models`` for the members."""

    @property
    def R(self) -> Array:
        """Measurement noise covariance, (..., m, m), with all batch axes that the model has."""

    def h(self, x: Array) -> Array:
        """Measurement of the state x (..., n), without noise: (..., m)."""

    def jacobian(self, x: Array) -> Array:
        """H = dh/dx, (..., m, n)."""

    def hessian(self, x: Array) -> Array:
        """Second derivatives of each component of h, (..., m, n, n)."""
