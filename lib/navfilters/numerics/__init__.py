"""Numerics: small matrices, derivatives, integration, and checks of what is given."""

from navfilters.numerics.complex_step import complex_step
from navfilters.numerics.matrix_roots import semidefinite_root, symmetric_root
from navfilters.numerics.runge_kutta import runge_kutta
from navfilters.numerics.small_matrices import (
    cholesky,
    is_positive_definite,
    right_divide,
    spectral_norm,
)

__all__ = [
    "cholesky",
    "complex_step",
    "is_positive_definite",
    "right_divide",
    "runge_kutta",
    "semidefinite_root",
    "spectral_norm",
    "symmetric_root",
]
