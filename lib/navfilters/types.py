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
    H : array (..., m, n), optional
        With P_xz = P H^T and P_zz = H P H^T + R: the update can be Joseph's.
    R : array (..., m, m), optional
        What P_zz has beside H P H^T.
    exact : array (..., n, n), optional
        T of :func:`navfilters.numerics.matrix_roots.semidefinite_root` of a prior that knows some
        combination of states exactly, for the update to keep.

    References
    ----------
    perea2007, section II: the first three are the quantities in which its filters differ.
    """

    z_hat: Array
    P_zz: Array
    P_xz: Array
    H: Array | None = None
    R: Array | None = None
    exact: Array | None = None


class MeasurementModel(Protocol):
    """z = h(x) + v with v ~ N(0, R); see ``navfilters.models`` for the members.

    R and h are needed. Where ``jacobian`` or ``hessian`` is not given, it is made by complex step:
    then h must be analytic. A model may also have

    - ``residual(z, z_hat)``, z minus z_hat where that is not a difference, as of angles;
    - ``retract(x, dx)`` and ``difference(x, y)``, where the state x is no vector: cov is that of
      dx, truth minus estimate;
    - ``noise(x)``, where the noise depends on the state, in the place of R;
    - ``at(k)``, the model of step k, from 0, where it differs from step to step;
    - ``given(z)``, the pair (measurement, model) where h depends on what was measured;
    - ``check(prior, steps)``, in the place of the checks that a run makes before any step, and
      ``examine(states)``, to look once more where it ends.
    """

    @property
    def R(self) -> Array:
        """Measurement noise covariance, (..., m, m), with all batch axes that the model has."""

    def h(self, x: Array) -> Array:
        """Measurement of the state x (..., n), without noise: (..., m)."""

    def jacobian(self, x: Array) -> Array:
        """H = dh/dx, (..., m, n)."""

    def hessian(self, x: Array) -> Array:
        """Second derivatives of each component of h, (..., m, n, n)."""


class Dynamics(Protocol):
    """x_k = f(x_{k-1}) + w with w ~ N(0, Q).

    Q and one of ``transition`` and ``f`` are needed. It may also have ``hessian``, ``retract``,
    ``difference``, ``at``, ``check`` and ``examine`` as a :class:`MeasurementModel` does, and

    - ``propagate(x, Q)``, the triple (f(x), F, W), where Q enters in another way than once at the
      end: W is what it amounts to, (..., n, n).
    """

    @property
    def Q(self) -> Array:
        """Process noise covariance, (..., n, n), with all batch axes that the model has."""

    def f(self, x: Array) -> Array:
        """The next state, without noise, (..., n)."""

    def transition(self, x: Array) -> tuple[Array, Array]:
        """f(x), (..., n), and its Jacobian F = df/dx, (..., n, n)."""
