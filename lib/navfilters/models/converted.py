"""Range and bearing taken to the plane, without bias."""

from dataclasses import dataclass

from navfilters.numerics import validation
from navfilters.numerics.small_matrices import matrix, vector
from navfilters.types import Array, Gaussian


@dataclass(frozen=True, eq=False)
class ConvertedRangeBearing:
    """A point's place by its measured range and bearing: linear, with a noise that depends on it.

    z_c = exp(s / 2) (r cos b, r sin b), s the variance of b: the noise turns the point, on average
    by exp(-s / 2) inwards, which the factor undoes.

    Parameters
    ----------
    R : array (..., 2, 2)
        Covariance of range and bearing, diagonal, definite: units squared, radians squared.

    Raises
    ------
    ValueError
        Naming the argument, the value found and what is needed.

    Notes
    -----
    z is range and bearing, as of ``RangeBearing``. Where one of them is missing both are. The state
    begins with the place; more components, such as velocities, may follow.

    References
    ----------
    bordonaro2014: the noise at the prediction and not at the measurement, with whose error it would
    be correlated.
    """

    R: Array

    def __post_init__(self) -> None:
        R = validation.covariance("R", self.R, 2, definite=True)
        if R[..., 0, 1].any():
            raise ValueError(f"R must be diagonal; found a covariance of {R[..., 0, 1].max():.3g}")
        object.__setattr__(self, "R", R)

    def given(self, z: Array) -> tuple[Array, "ConvertedRangeBearing"]:
        """The converted measurement, (..., 2) in units, and this model."""
        xp = z.__array_namespace__()
        s = xp.asarray(self.R)[..., 1, 1]
        r, b = xp.exp(s / 2) * z[..., 0], z[..., 1]
        return vector([r * xp.cos(b), r * xp.sin(b)]), self

    def h(self, x: Array) -> Array:
        """The place, (..., 2)."""
        return x[..., :2]

    def jacobian(self, x: Array) -> Array:
        """(..., 2, n): the identity, and zeros."""
        xp = x.__array_namespace__()
        return xp.zeros((*x.shape[:-1], 2, x.shape[-1])) + xp.eye(2, x.shape[-1])

    def noise(self, x: Array) -> Array:
        """Covariance of z_c for a point at x, exactly: (..., 2, 2)."""
        return self._of(x[..., :2, None] * x[..., None, :2])

    def expected_noise(self, prior: Gaussian) -> Array:
        """Its expectation over a predicted state, (..., 2, 2).

        Parameters
        ----------
        prior : Gaussian

        Returns
        -------
        array (..., 2, 2)

        Notes
        -----
        The noise is linear in the second moments of the place, but for q below, whose part in it is
        that of the range's variance in the squared range.
        """
        x = prior.mean
        return self._of(x[..., :2, None] * x[..., None, :2] + prior.cov[..., :2, :2])

    def _of(self, M: Array) -> Array:
        """((1 + q) cosh s - 1) M + (1 + q) sinh s (I tr M - M), q = R_r / tr M, M = E p p^T."""
        xp = M.__array_namespace__()
        R = xp.asarray(self.R)
        r, s = R[..., 0, 0], R[..., 1, 1]
        xx, xy, yy = M[..., 0, 0], M[..., 0, 1], M[..., 1, 1]
        q = r / (xx + yy)
        along, across = (1 + q) * xp.cosh(s) - 1, (1 + q) * xp.sinh(s)
        off = (along - across) * xy
        return matrix([[along * xx + across * yy, off], [off, along * yy + across * xx]])
