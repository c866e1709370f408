"""What n noisy ranges and bearings really tell about a fixed point: the exact posterior.

For Gaussian noise and a point that does not move, the mean range and the mean bearing are all that
matters of n measurements, and h is one to one. The posterior is a Gaussian in range and bearing,
bent into an arc, times the prior: a sum over a fine lattice of polar coordinates.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from navfilters.numerics import validation
from navfilters.types import Array, Gaussian

REACH = 8.0
"""How far the lattice goes from its centre, in deviations: e^-32 of the height."""

NEWTON_STEPS = 20


@dataclass(frozen=True, eq=False)
class ExactPosterior:
    """The posterior of a fixed point after n measurements of range and bearing.

    Parameters
    ----------
    z_mean : array (..., 2)
        Mean of the measured ranges, units, and of the bearings, rad.
    updates : int or int array (...)
        n, how many were averaged.
    R : array (..., 2, 2)
        Covariance of the noise of one: units squared, radians squared.
    prior : Gaussian, optional
        mean (..., 2), cov (..., 2, 2); by default flat over the plane.
    step : float
        Spacing of the lattice, in deviations. Moments have all their digits at 1/2; probabilities
        of a region have an error of some per cent of the probability beside its edge.

    Attributes
    ----------
    polar : array (..., k, 2)
        The points of the lattice: range and bearing.
    weights : array (..., k)
        Their probabilities.

    Raises
    ------
    ValueError
        Arguments of a wrong shape or kind; mean bearings with a deviation of more than a fifth of a
        radian, for which half a turn is not far away; a prior and measurements that contradict each
        other so much that the posterior is not in one piece around its mode.

    Notes
    -----
    Bearings are on the real line around the measured mean: what is half a turn or more away has no
    probability. The lattice is centred on the mode and aligned with the curvature there, so that it
    does not matter how thin the posterior is; the rule of equal weights converges faster than any
    power of the spacing.
    """

    z_mean: Array
    updates: Array
    R: Array
    prior: Gaussian | None = None
    step: float = 0.5
    polar: Array = field(init=False, repr=False)
    weights: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        z = validation.real_array("z_mean", self.z_mean, "2")
        validation.core("z_mean", z, (2,))
        n = validation.real_array("updates", self.updates, "")
        if not (n >= 1).all():
            raise ValueError(f"updates must be at least 1; found {np.min(n)}")
        R = validation.covariance("R", self.R, 2, definite=True)
        widest = float(np.max(np.sqrt(R[..., 1, 1] / n)))
        if widest > 0.2:
            raise ValueError(
                "the mean bearing must have a deviation of at most 0.2 rad, from R and updates; "
                f"found {widest:.3g}"
            )
        step = validation.number("step", self.step)
        if not 0 < step <= 1:
            raise ValueError(f"step must be above 0 and at most 1; found {step}")
        prior = None if self.prior is None else validation.gaussian("prior", self.prior)
        for name, value in (("z_mean", z), ("updates", n), ("R", R), ("prior", prior)):
            object.__setattr__(self, name, value)
        polar, weights = self._lattice(step)
        object.__setattr__(self, "polar", polar)
        object.__setattr__(self, "weights", weights)

    @property
    def points(self) -> Array:
        """The points of the lattice in Cartesian coordinates, (..., k, 2), units."""
        return cartesian(self.polar)

    @property
    def moments(self) -> Gaussian:
        """Exact mean (..., 2) and covariance (..., 2, 2): the best that a Gaussian can say."""
        x, w = self.points, self.weights[..., None]
        mean = np.sum(w * x, axis=-2)
        away = x - mean[..., None, :]
        return Gaussian(mean, np.swapaxes(w * away, -1, -2) @ away)

    def log_density(self, polar: Array) -> Array:
        """Logarithm of the density per unit of range and radian of bearing, up to a constant.

        Parameters
        ----------
        polar : array (..., k, 2)
            Range and bearing.

        Returns
        -------
        array (..., k)
            That per unit of area is smaller by the logarithm of the range.
        """
        polar = np.asarray(polar, float)
        away = polar - self.z_mean[..., None, :]
        per_step = np.linalg.inv(self.R)[..., None, :, :]
        misfit = self.updates[..., None] * _square(per_step, away)
        if self.prior is not None:
            from_prior = cartesian(polar) - self.prior.mean[..., None, :]
            misfit = misfit + _square(np.linalg.inv(self.prior.cov)[..., None, :, :], from_prior)
        r = polar[..., 0]
        inside = (r > 0) & (np.abs(away[..., 1]) < np.pi)
        return np.where(inside, np.log(np.where(r > 0, r, 1.0)) - misfit / 2, -np.inf)

    def ellipse(self, estimate: Gaussian, square: float) -> Array:
        """The exact probability of an estimate's own ellipse.

        Parameters
        ----------
        estimate : Gaussian
            mean (..., 2), cov (..., 2, 2).
        square : float
            Of the Mahalanobis distance at its edge: 5.99 for what should hold 95 %.

        Returns
        -------
        array (...)
            0 where the covariance is not positive definite.
        """
        away = self.points - np.asarray(estimate.mean)[..., None, :]
        a, b, c = (estimate.cov[..., i, j] for i, j in ((0, 0), (0, 1), (1, 1)))
        det = a * c - b * b
        with np.errstate(invalid="ignore"):
            sound = (a > 0) & (det > 0)
            x, y = away[..., 0], away[..., 1]
            a, b, c, d = (v[..., None] for v in (a, b, c, det))
            depth = square * d - (c * x * x - 2 * b * x * y + a * y * y)
        return np.where(sound, self._within(np.where(sound[..., None], depth, 0.0)), 0.0)

    def level(self, x: Array, *, polar: bool = False) -> Array:
        """The probability of the smallest region of highest density that holds a point.

        Parameters
        ----------
        x : array (..., 2)
            The point, units.
        polar : bool
            Whether density and region are those of range and bearing, not of the plane.

        Returns
        -------
        array (...)
            Uniform between 0 and 1 over truths drawn from the posterior.
        """
        x = np.asarray(x, float)
        bearing = np.arctan2(x[..., 1], x[..., 0])
        turns = np.round((bearing - self.z_mean[..., 1]) / (2 * np.pi))
        bearing = bearing - 2 * np.pi * turns
        r = np.broadcast_to(np.hypot(x[..., 0], x[..., 1]), bearing.shape)
        at = np.stack([r, bearing], axis=-1)
        here, there = self.log_density(at[..., None, :]), self.log_density(self.polar)
        if not polar:
            here, there = here - np.log(at[..., None, 0]), there - np.log(self.polar[..., 0])
        return self._within(there - here)

    def _within(self, depth: Array) -> Array:
        """Probability of where a function of the lattice (..., k) is positive.

        Cells on the edge count by the share of them that is inside, as if it were straight there.
        """
        side = round(depth.shape[-1] ** 0.5)
        plane = np.maximum(depth, -1e9).reshape(*depth.shape[:-1], side, side)
        across = np.zeros_like(plane)
        for axis in (-2, -1):
            change = np.abs(np.diff(plane, axis=axis))
            ends = [(0, 0)] * plane.ndim
            for one in ((1, 0), (0, 1)):
                ends[axis] = one
                across += np.pad(change, ends, mode="edge") / 2
        share = np.clip(0.5 + plane / np.maximum(across, np.finfo(float).tiny), 0.0, 1.0)
        return np.sum(self.weights * share.reshape(depth.shape), axis=-1)

    def _lattice(self, step: float) -> tuple[Array, Array]:
        centre, cov = self._mode()
        side = np.arange(-REACH, REACH + step / 2, step)
        nodes = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
        polar = centre[..., None, :] + nodes @ np.swapaxes(np.linalg.cholesky(cov), -1, -2)
        log_p = self.log_density(polar)
        p = np.exp(log_p - np.max(log_p, axis=-1, keepdims=True))
        weights = p / np.sum(p, axis=-1, keepdims=True)
        edge = np.max(np.abs(nodes), axis=-1) > REACH - step / 2
        if not np.max(np.sum(weights[..., edge], axis=-1)) < 1e-9:
            raise ValueError(
                "prior and measurements must agree: the posterior reaches the edge of the lattice "
                "around its mode"
            )
        return polar, weights

    def _mode(self) -> tuple[Array, Array]:
        """Where prior and data agree best, by Gauss-Newton in polar coordinates, and how well."""
        information = np.asarray(self.updates)[..., None, None] * np.linalg.inv(self.R)
        if self.prior is None:
            shape = np.broadcast_shapes(self.z_mean.shape[:-1], information.shape[:-2])
            centre = np.broadcast_to(self.z_mean, (*shape, 2))
            return centre, np.broadcast_to(np.linalg.inv(information), (*shape, 2, 2))
        weight, polar = np.linalg.inv(self.prior.cov), self.z_mean
        for _ in range(NEWTON_STEPS):
            r, c, s = polar[..., 0], np.cos(polar[..., 1]), np.sin(polar[..., 1])
            J = np.stack([np.stack([c, -r * s], -1), np.stack([s, r * c], -1)], -2)
            pull = np.swapaxes(J, -1, -2) @ weight
            curvature = information + pull @ J
            slope = information @ (self.z_mean - polar)[..., None]
            slope = slope + pull @ (self.prior.mean - cartesian(polar))[..., None]
            polar = polar + np.linalg.solve(curvature, slope)[..., 0]
        return polar, np.linalg.inv(curvature)


def cartesian(polar: Array) -> Array:
    """Positions of ranges and bearings.

    Parameters
    ----------
    polar : array (..., 2)
        Range, units, and bearing, rad.

    Returns
    -------
    array (..., 2)
        Units.
    """
    r, theta = polar[..., 0], polar[..., 1]
    return np.stack([r * np.cos(theta), r * np.sin(theta)], axis=-1)


def _square(weight: Any, away: Any) -> Any:
    """away^T weight away for a symmetric 2 x 2 weight."""
    x, y = away[..., 0], away[..., 1]
    return weight[..., 0, 0] * x * x + 2 * weight[..., 0, 1] * x * y + weight[..., 1, 1] * y * y
