"""Gravity of an uneven Earth: spherical harmonics of any degree, analytic in the position."""

from dataclasses import dataclass, field
from math import factorial

import numpy as np
from numpy.polynomial import Legendre, Polynomial

from navfilters.numerics.analytic import dot
from navfilters.types import Array


@dataclass(frozen=True, eq=False)
class Harmonics:
    """A gravity field by fully normalised coefficients.

    Parameters
    ----------
    C, S : array (degree + 1, degree + 1)
        By degree and order; C[0, 0] is 1.
    mu : float
        m^3/s^2; by default that of EGM96.
    radius : float
        Of reference, m.

    Raises
    ------
    ValueError
        Coefficients that are not square or not of one shape.
    """

    C: np.ndarray
    S: np.ndarray
    mu: float = 3.986004415e14
    radius: float = 6378136.3
    _table: np.ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        C, S = np.asarray(self.C, float), np.asarray(self.S, float)
        if C.ndim != 2 or C.shape[0] != C.shape[1] or C.shape != S.shape:
            raise ValueError(
                f"C and S must have shape (degree + 1, degree + 1); found {C.shape} and {S.shape}"
            )
        object.__setattr__(self, "_table", _table(C, S))

    @property
    def degree(self) -> int:
        """The last degree."""
        return len(self.C) - 1

    def acceleration(self, r: Array) -> Array:
        """Gradient of the potential, (..., 3), m/s^2.

        With the unit vector (s, t, u) of r, A_nm = d^m P_n(u)/du^m and s_m + i t_m = (s + i t)^m,
        the potential is mu/r sum (R/r)^n A_nm (C_nm s_m + S_nm t_m): a polynomial, and so are all
        sums over n of its derivatives.

        Parameters
        ----------
        r : array (..., 3)
            Fixed to the Earth, m.

        Returns
        -------
        array (..., 3)

        References
        ----------
        S. Pines, AIAA Journal 11, 1508 (1973).
        """
        distance = np.sqrt(dot(r, r))[..., None]
        unit = r / distance
        N, ratio = self.degree + 1, self.radius / distance
        products = ratio[..., None] ** np.arange(N)[:, None] * unit[..., 2:, None] ** np.arange(
            N + 1
        )
        sums = products.reshape(*r.shape[:-1], N * (N + 1)) @ self._table
        of_C, of_S, of_Cu, of_Su, of_Cr, of_Sr = (sums[..., N * i : N * (i + 1)] for i in range(6))
        s, t = powers(unit[..., 0], unit[..., 1], N)
        x = (of_C[..., 1:] * s[..., :-1] + of_S[..., 1:] * t[..., :-1]).sum(axis=-1)
        y = (of_S[..., 1:] * s[..., :-1] - of_C[..., 1:] * t[..., :-1]).sum(axis=-1)
        z = (of_Cu * s + of_Su * t).sum(axis=-1)
        along = (of_Cr * s + of_Sr * t).sum(axis=-1)
        total = np.stack([x, y, z], axis=-1) - along[..., None] * unit
        return self.mu / distance**2 * total


def powers(x: Array, y: Array, count: int) -> tuple[Array, Array]:
    """Real and imaginary parts of (x + i y)^m, m < count, for x and y that may be complex.

    Parameters
    ----------
    x, y : array (...)
    count : int

    Returns
    -------
    tuple of array (..., count)
    """
    if x.dtype.kind != "c":
        factors = np.ones((*x.shape, count), complex)
        factors[..., 1:] = (x + 1j * y)[..., None]
        both = np.cumprod(factors, axis=-1)
        return both.real, both.imag
    s, t = np.empty((2, *x.shape, count), x.dtype)
    s[..., 0], t[..., 0] = 1.0, 0.0
    for m in range(1, count):
        before, beside = s[..., m - 1], t[..., m - 1]
        s[..., m] = x * before - y * beside
        t[..., m] = x * beside + y * before
    return s, t


def _table(C: np.ndarray, S: np.ndarray) -> np.ndarray:
    """Coefficients of the sums over n, by (power of R/r, power of u) and (sum, order)."""
    N = len(C)
    table = np.zeros((N, N + 1, 6, N))

    def put(n: int, m: int, where: int, polynomial: Polynomial, factor: float) -> None:
        for i, coefficient in enumerate((C[n, m], S[n, m])):
            weight = coefficient * factor * _norm(n, m)
            table[n, : len(polynomial.coef), where + i, m] += weight * polynomial.coef

    legendre = [Legendre.basis(n).convert(kind=Polynomial) for n in range(N + 1)]
    for n in range(N):
        for m in range(n + 1):
            put(n, m, 0, legendre[n].deriv(m) if m else legendre[n], m)
            put(n, m, 2, legendre[n].deriv(m + 1), 1)
            put(n, m, 4, legendre[n + 1].deriv(m + 1), 1)
    return table.reshape(N * (N + 1), 6 * N)


def _norm(n: int, m: int) -> float:
    """What a fully normalised coefficient is multiplied by to be unnormalised."""
    return ((1 if m == 0 else 2) * (2 * n + 1) * factorial(n - m) / factorial(n + m)) ** 0.5
