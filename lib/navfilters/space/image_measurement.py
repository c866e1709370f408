"""What a focused and geolocated SAR image says of the spacecraft that took it."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.analytic import dot
from navfilters.space.frames import antenna_axes
from navfilters.space.image_sensor import Pixel
from navfilters.space.navigation_state import NavigationState
from navfilters.space.pose import difference, retract
from navfilters.space.quaternions import cross_matrix, matrix
from navfilters.types import Array


class Measurement(NamedTuple):
    """What one image gives: from a focuser and a matcher, or simulated.

    Parameters
    ----------
    r_f : array (..., 3)
        Earth-fixed position of the image's centre pixel, m.
    slant_range : array (...)
        Distance from the antenna to that pixel, m.
    speed : array (...)
        In-track velocity that focused the image, m/s.

    Notes
    -----
    An image that could not be matched has NaN for whatever it lacks.

    References
    ----------
    pogorelsky2020, Eqs. (13), (14), (17), (18).
    """

    r_f: Array
    slant_range: Array
    speed: Array

    @classmethod
    def of(cls, z: Array) -> "Measurement":
        """The parts of a measurement z (..., 5)."""
        return cls(z[..., :3], z[..., 3], z[..., 4])

    @property
    def z(self) -> Array:
        """All of it, (..., 5)."""
        xp = self.r_f.__array_namespace__()
        numbers = (xp.asarray(number)[..., None] for number in (self.slant_range, self.speed))
        return xp.concat([self.r_f, *numbers], axis=-1)


@dataclass(frozen=True, eq=False)
class SarGeometry:
    """Two direction ratios and the slant range of a ground point, and the speed.

    y = (x_s / z_s, y_s / z_s, norm(r_f - r), norm(v)),
    (x_s, y_s, z_s) = T_mu T_b^s T_e^b (r_f - r)

    Parameters
    ----------
    look, squint : float
        Nominal direction of the beam, rad: see ``navfilters.space.frames.antenna_axes``.
    R : array (4, 4)
        Covariance of the noise of y, symmetric positive semidefinite: the ratios', m^2, m^2/s^2.
    D : array (3, 3)
        Covariance of the error of the pixel's position r_f, Earth-fixed, symmetric positive
        semidefinite, m^2.
    T_e_b : array (..., 3, 3)
        Attitude of the body when the image was taken, from the attitude determination system: see
        ``navfilters.space.frames.body_axes``. ``dataclasses.replace`` sets it for each image.

    Raises
    ------
    ValueError
        Naming the argument, the value found and what is needed.

    Notes
    -----
    The boresight meets the pixel by definition of the antenna frame, so the ratios are *measured*
    as zero, without noise: their error is the pixel's, which ``noise`` adds to R as B.

    Slips in the text: (15) lacks T_e^b, which (22) has; (27) applies T_mu T_b^s T_e^b to a vector
    that is in the antenna frame already; (28) calls the misalignment delta theta.

    References
    ----------
    pogorelsky2020, Eqs. (13)-(30).
    """

    look: float
    squint: float
    R: Array
    D: Array
    T_e_b: Array = None

    def __post_init__(self) -> None:
        for name in ("look", "squint"):
            value = validation.real_array(name, getattr(self, name), "")
            if value.ndim or abs(value) >= np.pi / 2:
                raise ValueError(
                    f"{name} must be an angle of less than pi/2 rad; found {getattr(self, name)}"
                )
        R = validation.covariance("R", self.R, 4, definite=False)
        D = validation.covariance("D", self.D, 3, definite=False)
        T = np.eye(3) if self.T_e_b is None else self.T_e_b
        T = validation.real_array("T_e_b", T, "3, 3")
        if T.shape[-2:] != (3, 3):
            raise ValueError(f"T_e_b must have shape (..., 3, 3); found {T.shape}")
        deviation = np.max(np.abs(T @ T.mT - np.eye(3)), initial=0.0)
        if deviation > 1e-9 or (np.linalg.det(T) < 0).any():
            raise ValueError(
                f"T_e_b must be a rotation; found T T^T that is {deviation:.3g} away from I"
                if deviation > 1e-9
                else "T_e_b must be a rotation; found a reflection"
            )
        for name, value in (("R", R), ("D", D), ("T_e_b", T)):
            object.__setattr__(self, name, value)

    @property
    def T_b_s(self) -> Array:
        """Nominal attitude of the antenna on the body, (3, 3). Eq. (15)."""
        return antenna_axes(self.look, self.squint)

    def boresight(self, q_mu: Array) -> Array:
        """Direction of the beam, Earth-fixed: the third axis of the antenna frame.

        Parameters
        ----------
        q_mu : array (..., 4)
            Misalignment of the antenna.

        Returns
        -------
        array (..., 3)
            Of length one.
        """
        return self._to_antenna(q_mu)[..., 2, :]

    def h(self, state: NavigationState, r_f: Array) -> Array:
        """The expected y.

        Parameters
        ----------
        state : NavigationState
        r_f : array (..., 3)
            Earth-fixed position of the pixel, m.

        Returns
        -------
        array (..., 4)
            Two ratios, m, m/s.

        References
        ----------
        pogorelsky2020, Eqs. (13)-(18).
        """
        xp = r_f.__array_namespace__()
        r_sf, v, T = self._together(state, r_f)
        in_antenna = _apply(T, r_sf)
        ratios = in_antenna[..., :2] / in_antenna[..., 2:]
        return xp.concat([ratios, _norm(r_sf), _norm(v)], axis=-1)

    def jacobian(self, state: NavigationState, r_f: Array) -> Array:
        """H: derivative of y with respect to the errors in position, velocity and misalignment.

        Parameters
        ----------
        state : NavigationState
        r_f : array (..., 3)
            Earth-fixed position of the pixel, m.

        Returns
        -------
        array (..., 4, 9)

        References
        ----------
        pogorelsky2020, Eqs. (19)-(28).
        """
        xp = r_f.__array_namespace__()
        r_sf, v, T = self._together(state, r_f)
        of_pixel, of_mu = _derivatives(r_sf, T)
        of_speed = (v / _norm(v))[..., None, :]  # Eq. (24)
        none = xp.zeros_like(of_pixel[..., :3, :])
        return xp.concat([-of_pixel, xp.concat([none, of_speed], axis=-2), of_mu], axis=-1)

    def pixel_jacobian(self, state: NavigationState, r_f: Array) -> Array:
        """Derivative of y with respect to the position of the pixel.

        Parameters
        ----------
        state : NavigationState
        r_f : array (..., 3)
            Earth-fixed position of the pixel, m.

        Returns
        -------
        array (..., 4, 3)
            The last row, the speed's, is zero.

        References
        ----------
        pogorelsky2020, Eq. (30).
        """
        r_sf, _, T = self._together(state, r_f)
        return _derivatives(r_sf, T)[0]

    def noise(self, state: NavigationState, r_f: Array) -> Array:
        """R + B with B = H_f D H_f^T: what the measurement adds to the innovation's covariance.

        Parameters
        ----------
        state : NavigationState
        r_f : array (..., 3)
            Earth-fixed position of the pixel, m.

        Returns
        -------
        array (..., 4, 4)

        References
        ----------
        pogorelsky2020, Eqs. (29), (33).
        """
        xp = r_f.__array_namespace__()
        H_f = self.pixel_jacobian(state, r_f)
        return xp.asarray(self.R) + H_f @ xp.asarray(self.D) @ H_f.mT

    def given(self, z: Array) -> tuple[Array, Pixel]:
        """What is compared with h, and the sensor that it makes: for a filter.

        Parameters
        ----------
        z : array (..., 5)
            ``Measurement.z``: pixel, slant range, speed. NaN in any of it is an image that could
            not be matched.

        Returns
        -------
        tuple of array (..., 4), Pixel
            The ratios are measured as zero.
        """
        measurement = Measurement.of(validation.core("z", validation.given("z", z), (5,)))
        xp = measurement.r_f.__array_namespace__()
        lost = xp.any(xp.isnan(z), axis=-1)[..., None]
        seen = xp.stack([measurement.slant_range, measurement.speed], axis=-1)
        y = xp.concat([xp.zeros_like(seen), seen], axis=-1)
        return xp.where(lost, xp.nan, y), Pixel(self, measurement.r_f)

    retract = staticmethod(retract)
    difference = staticmethod(difference)

    def _to_antenna(self, q_mu: Array) -> Array:
        """T_mu T_b^s T_e^b."""
        xp = q_mu.__array_namespace__()
        return matrix(q_mu) @ xp.asarray(self.T_b_s @ self.T_e_b)

    def _together(self, state: NavigationState, r_f: Array) -> tuple[Array, Array, Array]:
        """r_f - r, v and T_mu T_b^s T_e^b, with the same batch axes."""
        xp = r_f.__array_namespace__()
        r_sf, v, T = r_f - state.r, state.v, self._to_antenna(state.q_mu)
        batch = xp.broadcast_shapes(r_sf.shape[:-1], v.shape[:-1], T.shape[:-2])
        r_sf, v = (xp.broadcast_to(a, (*batch, 3)) for a in (r_sf, v))
        return r_sf, v, xp.broadcast_to(T, (*batch, 3, 3))


def _derivatives(r_sf: Array, T: Array) -> tuple[Array, Array]:
    """Of y by the pixel's position, (..., 4, 3), and by the misalignment, (..., 4, 3)."""
    xp = r_sf.__array_namespace__()
    s = _apply(T, r_sf)
    x, y, z, o = s[..., 0], s[..., 1], s[..., 2], xp.zeros_like(s[..., 2])
    rows = [[1 / z, o, -x / (z * z)], [o, 1 / z, -y / (z * z)]]
    of_s = xp.stack([xp.stack(row, axis=-1) for row in rows], axis=-2)  # Eq. (21)
    along = (r_sf / _norm(r_sf))[..., None, :]  # Eq. (23)
    of_pixel = xp.concat([of_s @ T, along, xp.zeros_like(along)], axis=-2)  # Eqs. (22), (30)
    of_mu = of_s @ cross_matrix(s)  # Eqs. (25)-(27)
    return of_pixel, xp.concat([of_mu, xp.zeros_like(of_mu)], axis=-2)


def _apply(T: Array, v: Array) -> Array:
    return (T @ v[..., None])[..., 0]


def _norm(v: Array) -> Array:
    """|v|, (..., 1)."""
    xp = v.__array_namespace__()
    return xp.sqrt(dot(v, v))[..., None]
