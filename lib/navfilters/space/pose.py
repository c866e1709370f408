"""Position, velocity and attitude as one state on a manifold, x = (r, v, q), and its errors."""

from navfilters.numerics.doors import takes
from navfilters.space.quaternions import (
    conjugate,
    from_rotation_vector,
    normalized,
    product,
    rotation_vector,
)
from navfilters.types import Array


@takes(x="10", dx="9")
def retract(x: Array, dx: Array) -> Array:
    """The state that differs by an error: r + dr, v + dv, dq(dmu) (x) q.

    Parameters
    ----------
    x : array (..., 10)
        Position, m, velocity, m/s, and a unit quaternion, scalar last.
    dx : array (..., 9)
        Errors of position, m, and velocity, m/s, and a rotation vector, rad.

    Returns
    -------
    array (..., 10)
        With a quaternion of length one.

    References
    ----------
    pogorelsky2020, Eqs. (36) and (37).
    """
    xp = x.__array_namespace__()
    q = normalized(product(from_rotation_vector(dx[..., 6:]), x[..., 6:]))
    return xp.concat([x[..., :6] + dx[..., :6], q], axis=-1)


@takes(x="10", y="10")
def difference(x: Array, y: Array) -> Array:
    """The error dx with which retract(y, dx) is x.

    Parameters
    ----------
    x, y : array (..., 10)
        As in :func:`retract`.

    Returns
    -------
    array (..., 9)
        Its rotation vector is at most pi long: q and -q are the same attitude.
    """
    xp = x.__array_namespace__()
    turn = rotation_vector(product(x[..., 6:], conjugate(y[..., 6:])))
    return xp.concat([x[..., :6] - y[..., :6], turn], axis=-1)
