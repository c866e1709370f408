"""Numerics: small matrices, derivatives, integration, and checks of what is given."""

from navfilters.numerics import matrix_roots, small_matrices
from navfilters.numerics.complex_step import complex_step
from navfilters.numerics.doors import takes
from navfilters.numerics.runge_kutta import runge_kutta

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

# Every update calls these, as what they are inside: there is no door between the library's rooms.
_of_square = takes(A="n, n", symmetric=("A",))
cholesky = takes(A="n, n")(small_matrices.cholesky)
is_positive_definite = _of_square(small_matrices.is_positive_definite)
right_divide = takes(A="n, n", B="m, n")(small_matrices.right_divide)
semidefinite_root = takes(A="n, n")(matrix_roots.semidefinite_root)
spectral_norm = _of_square(small_matrices.spectral_norm)
symmetric_root = _of_square(matrix_roots.symmetric_root)
