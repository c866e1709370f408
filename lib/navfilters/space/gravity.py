"""The pull of an oblate Earth: acceleration and gradient."""

from dataclasses import dataclass

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.analytic import dot
from navfilters.numerics.loops import is_jax
from navfilters.types import Array


@dataclass(frozen=True)
class Gravity:
    """A central body and its oblateness.

    Parameters
    ----------
    mu : float
        Gravitational constant, m^3/s^2.
    radius : float
        Equatorial radius R_e, m.
    J2 : float
        Second zonal coefficient; 0 leaves two bodies.

    Raises
    ------
    ValueError
        mu or radius not positive, or anything not finite.

    References
    ----------
    xiong2009, Eq. (36); the text gives no values, these are WGS-84's.
    """

    mu: float = 3.986004418e14
    radius: float = 6378137.0
    J2: float = 1.08262668e-3

    def __post_init__(self) -> None:
        for name in ("mu", "radius", "J2"):
            value = validation.real_array(name, getattr(self, name), "")
            if value.ndim or (name != "J2" and value <= 0):
                needed = "a number" if name == "J2" else "a positive number"
                raise ValueError(f"{name} must be {needed}; found {getattr(self, name)}")

    def acceleration(self, r: Array) -> Array:
        """-mu/r^3 (r (1 + k (1 - 5 z^2/r^2)) + 2 k z e_z),   k = 3/2 J2 (R_e/r)^2.

        Parameters
        ----------
        r : array (..., 3)
            Position from the body's centre, m; the third axis is its axis of symmetry.

        Returns
        -------
        array (..., 3)
            m/s^2. Not finite at the centre.

        References
        ----------
        xiong2009, Eq. (36), rows 4 to 6.
        """
        xp = r.__array_namespace__()
        x, y, z = r[..., 0], r[..., 1], r[..., 2]
        z2 = z * z
        in_vectors = is_jax(xp)  # compiled derivatives by elements are up to eight times as slow
        s = 1 / (dot(r, r) if in_vectors else x * x + y * y + z2)
        of_sphere = (-self.mu * s) * xp.sqrt(s)
        of_J2 = (self.of_J2 * s) * of_sphere
        along = of_sphere + of_J2 * (1 - (5 * s) * z2)
        if in_vectors:
            up = xp.asarray([0.0, 0.0, 2.0], dtype=r.dtype)
            return r * (along[..., None] + of_J2[..., None] * up)
        pull = np.empty_like(r)  # in memory as r is
        np.multiply(x, along, out=pull[..., 0])
        np.multiply(y, along, out=pull[..., 1])
        along += 2 * of_J2
        np.multiply(z, along, out=pull[..., 2])
        return pull

    def gradient(self, r: Array) -> Array:
        """Derivative of the acceleration with respect to position: the gravity gradient.

        Parameters
        ----------
        r : array (..., 3)
            Position, m, as for the acceleration.

        Returns
        -------
        array (..., 3, 3)
            s^-2, symmetric and, the potential being harmonic, without trace.

        References
        ----------
        xiong2009, the F of Eq. (4) for Eq. (36).
        """
        xp, batch = r.__array_namespace__(), r.shape[:-1]
        rows = self.gradient_elements(r[..., 0], r[..., 1], r[..., 2])
        G = xp.stack([element for row in rows for element in row], axis=-1)
        return xp.reshape(G, (*batch, 3, 3))

    def gradient_elements(self, x: Array, y: Array, z: Array) -> list[list[Array]]:
        """The gradient by rows of its elements, for who puts them elsewhere.

        Parameters
        ----------
        x, y, z : array (...)
            Position, m.

        Returns
        -------
        list of list of array (...)
            s^-2.

        References
        ----------
        xiong2009, as for the gradient.
        """
        s = 1 / (x * x + y * y + z * z)
        to_one = x.__array_namespace__().sqrt(s)
        u, v, c = x * to_one, y * to_one, z * to_one  # unit vector
        size, k = self.mu * s * to_one, self.of_J2 * s
        of_u = size * (3 + k * (5 - 35 * c * c))
        of_x, of_y, of_z = of_u * u, of_u * v, of_u * c
        across, tilt = size * k, 10 * c
        up_x, up_y, up_z = across * (tilt * u), across * (tilt * v), across * (tilt * c - 1)
        same = size * (k * (5 * c * c - 1) - 1)
        return [
            [of_x * u + same, of_x * v, of_x * c + up_x],
            [of_y * u, of_y * v + same, of_y * c + up_y],
            [of_z * u + up_x, of_z * v + up_y, of_z * c + same + (up_z + up_z)],
        ]

    @property
    def fastest(self) -> float:
        """Angular rate of a circular orbit at the body's radius, rad/s."""
        return float(np.sqrt(self.mu / self.radius**3))

    @property
    def of_J2(self) -> float:
        """3/2 J2 R_e^2, m^2."""
        return 1.5 * self.J2 * self.radius**2


EARTH = Gravity()
