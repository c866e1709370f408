"""Functions that are analytic where their namesakes are not, so that complex_step passes through.

``vecdot`` conjugates its first argument, ``abs`` forgets the phase, ``hypot`` and ``atan2`` take no
complex numbers. For real arrays each of these *is* its namesake, to the last bit. Comparisons
look at real parts: write ``x.real > 0``.
"""

from navfilters.types import Array


def dot(a: Array, b: Array) -> Array:
    """sum_i a_i b_i over the last axis; a is not conjugated.

    Parameters
    ----------
    a, b : array (..., n)

    Returns
    -------
    array (...)
    """
    xp = a.__array_namespace__()
    return xp.linalg.vecdot(xp.conj(a) if _is_complex(a) else a, b)


def absolute(x: Array) -> Array:
    """x or -x, whichever has a real part that is not negative.

    Parameters
    ----------
    x : array (...)

    Returns
    -------
    array (...)
    """
    xp = x.__array_namespace__()
    return xp.where(x.real < 0, -x, x) if _is_complex(x) else xp.abs(x)


def hypot(x: Array, y: Array) -> Array:
    """sqrt(x^2 + y^2).

    Parameters
    ----------
    x, y : array (...)

    Returns
    -------
    array (...)
    """
    xp = x.__array_namespace__()
    return xp.sqrt(x * x + y * y) if _is_complex(x, y) else xp.hypot(x, y)


def atan2(y: Array, x: Array) -> Array:
    """The angle of (x, y), by the quadrant of the real parts.

    Parameters
    ----------
    y, x : array (...)

    Returns
    -------
    array (...)
        rad.
    """
    xp = x.__array_namespace__()
    if not _is_complex(x, y):
        return xp.atan2(y, x)
    flat = xp.abs(x.real) >= xp.abs(y.real)
    below, above = xp.where(flat, x, y), xp.where(flat, y, -x)  # the slope is at most 1
    quarters = xp.atan2(y.real, x.real) - xp.atan(above.real / below.real)
    return xp.atan(above / below) + quarters


def _is_complex(*arrays: Array) -> bool:
    return "c" in [a.dtype.kind for a in arrays]
