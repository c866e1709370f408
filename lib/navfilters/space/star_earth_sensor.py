"""Angles between the direction of the Earth's centre and stars."""

from dataclasses import dataclass

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.analytic import atan2, dot
from navfilters.numerics.loops import is_jax
from navfilters.types import Array


@dataclass(frozen=True, eq=False)
class StarEarthSensor:
    """The angle between each star and the Earth's centre: y_i = arccos(-u_i . r / norm(r)) + v_i.

    Parameters
    ----------
    stars : array (m, 3)
        A vector towards each star, inertial; scaled to length one here.
    R : array (..., m, m)
        Covariance of the noise v, symmetric positive definite, rad^2.

    Raises
    ------
    ValueError
        A star without a direction; R of another size or not definite.

    Notes
    -----
    The arccosine loses half of the digits near 0 and pi, where the spacecraft lies in the line of
    star and Earth; atan2(norm(u x r), -u . r) keeps them. On that line the angle has no
    derivatives: they are not finite there. The velocity does not enter.

    References
    ----------
    xiong2009, Eqs. (37)-(38) and Fig. 1.
    """

    stars: Array
    R: Array

    def __post_init__(self) -> None:
        stars = validation.real_array("stars", self.stars, "m, 3")
        if stars.ndim != 2 or stars.shape[1] != 3:
            raise ValueError(f"stars must have shape (m, 3); found {stars.shape}")
        length = np.linalg.norm(stars, axis=1)
        if not (length > 0).all():
            raise ValueError(f"stars must be directions; found zero at index {length.argmin()}")
        R = validation.covariance("R", self.R, len(stars), definite=True)
        object.__setattr__(self, "stars", stars / length[:, None])
        object.__setattr__(self, "R", R)

    def h(self, x: Array) -> Array:
        """The angles, (..., m).

        Parameters
        ----------
        x : array (..., n)
            Inertial position, m, and what else the state has: velocity, m/s, at least.

        Returns
        -------
        array (..., m)
            Radians, 0 to pi.

        References
        ----------
        xiong2009, Eq. (38).
        """
        xp = x.__array_namespace__()
        r = x[..., None, :3]
        u = xp.asarray(self.stars)
        w = cross(u, r)
        return atan2(xp.sqrt(dot(w, w)), -dot(u, r))

    def jacobian(self, x: Array) -> Array:
        """H: across r and towards the star, 1 / norm(r) long; zero for all but the position.

        H_i = r x (u_i x r) / (norm(r)^2 norm(u_i x r))

        Parameters
        ----------
        x : array (..., n)

        Returns
        -------
        array (..., m, n)
            rad/m, then rad s/m and so on.
        """
        xp = x.__array_namespace__()
        _, towards, _, r, _ = self._axes(x)
        rest = xp.zeros_like(towards[..., :1]) * xp.ones(x.shape[-1] - 3)
        return xp.concat([towards / r, rest], axis=-1)

    def hessian(self, x: Array) -> Array:
        """Second derivatives of each angle, in the axes along r, towards the star, and normal n.

        -(e_r e_t^T + e_t e_r^T + cot(theta) e_n e_n^T) / norm(r)^2,   theta the angle from u to r

        Parameters
        ----------
        x : array (..., n)

        Returns
        -------
        array (..., m, n, n)
            rad/m^2 in the block of the position; zero elsewhere.
        """
        xp = x.__array_namespace__()
        along, towards, normal, r, cotangent = self._axes(x)
        pair = along[..., :, None] * towards[..., None, :]
        of_normal = normal[..., :, None] * normal[..., None, :]
        block = -(pair + pair.mT + cotangent[..., None] * of_normal) / (r * r)[..., None]
        E_r = xp.eye(x.shape[-1])[:3]
        return E_r.mT @ block @ E_r

    def _axes(self, x: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Unit vectors along r, towards the star and normal to both, norm(r) and cot(theta)."""
        xp = x.__array_namespace__()
        u = xp.asarray(self.stars)
        position = x[..., None, :3] + xp.zeros_like(u)
        r = xp.sqrt(dot(position, position))[..., None]
        along = position / r
        w = cross(u, along)
        sine = xp.sqrt(dot(w, w))[..., None]
        normal = w / sine
        cotangent = dot(u, along)[..., None] / sine
        return along, cross(along, normal), normal, r, cotangent


def cross(a: Array, b: Array) -> Array:
    """a x b of vectors (..., 3); under NumPy in half the time of its own, and the same."""
    xp = a.__array_namespace__()
    if is_jax(xp):
        return xp.linalg.cross(a, b)
    (a0, a1, a2), (b0, b1, b2) = ((v[..., 0], v[..., 1], v[..., 2]) for v in (a, b))
    return np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], axis=-1)
