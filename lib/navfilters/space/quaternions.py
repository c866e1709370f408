"""Attitude quaternions in Shuster's convention: scalar last, passive.

A quaternion q_a^b turns no vector: it changes the axes in which one is expressed, from a to b, by
T(q_a^b). Products compose as the matrices do, from right to left:

    T(p (x) q) = T(p) T(q),   q_a^c = q_b^c (x) q_a^b

Hamilton's product, which SciPy's ``Rotation`` has, is the same with the operands exchanged, and the
matrix of a ``Rotation``, which is active, is the transpose: T(q) = Rotation.from_quat(q)^T.
"""

from navfilters.numerics.analytic import absolute, atan2, dot
from navfilters.numerics.doors import takes
from navfilters.types import Array


@takes(v="3")
def cross_matrix(v: Array) -> Array:
    """[v x], with [v x] u = v x u.

    Parameters
    ----------
    v : array (..., 3)

    Returns
    -------
    array (..., 3, 3)
        In the units of v.

    References
    ----------
    pogorelsky2020, Eq. (7).
    """
    xp = v.__array_namespace__()
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    o = xp.zeros_like(x)
    elements = xp.stack([o, -z, y, z, o, -x, -y, x, o], axis=-1)
    return xp.reshape(elements, (*x.shape, 3, 3))


@takes(p="4", q="4")
def product(p: Array, q: Array) -> Array:
    """p (x) q: first q, then p.

    Parameters
    ----------
    p, q : array (..., 4)
        Quaternions, scalar last.

    Returns
    -------
    array (..., 4)

    References
    ----------
    pogorelsky2020, Eq. (5).
    """
    xp = p.__array_namespace__()
    a, b, c, d = (p[..., i] for i in range(4))
    x, y, z, w = (q[..., i] for i in range(4))
    parts = [
        d * x + w * a - (b * z - c * y),
        d * y + w * b - (c * x - a * z),
        d * z + w * c - (a * y - b * x),
        d * w - (a * x + b * y + c * z),
    ]
    return xp.stack(parts, axis=-1)


@takes(q="4")
def conjugate(q: Array) -> Array:
    """The opposite rotation.

    Parameters
    ----------
    q : array (..., 4)
        Quaternion, scalar last.

    Returns
    -------
    array (..., 4)
        The inverse, if q has length one.
    """
    xp = q.__array_namespace__()
    return xp.concat([-q[..., :3], q[..., 3:]], axis=-1)


@takes(q="4")
def normalized(q: Array) -> Array:
    """The quaternion of length one in the direction of q.

    Parameters
    ----------
    q : array (..., 4)

    Returns
    -------
    array (..., 4)
        Not finite for the zero quaternion.
    """
    xp = q.__array_namespace__()
    return q / xp.sqrt(dot(q, q))[..., None]


@takes(q="4")
def matrix(q: Array) -> Array:
    """T(q), the direction cosines that take components from the first to the second frame of q.

    T(q) = (q_s^2 - q_v . q_v) I + 2 q_v q_v^T - 2 q_s [q_v x]

    Parameters
    ----------
    q : array (..., 4)
        Unit quaternion, scalar last.

    Returns
    -------
    array (..., 3, 3)

    References
    ----------
    pogorelsky2020, Eq. (6), where q_s in the last term is printed as a vector.
    """
    xp = q.__array_namespace__()
    x, y, z, s = (q[..., i] for i in range(4))
    same = s * s - dot(q[..., :3], q[..., :3])
    xy, yz, zx = 2 * (x * y), 2 * (y * z), 2 * (z * x)
    a, b, c = 2 * s * x, 2 * s * y, 2 * s * z
    elements = [
        *(same + 2 * (x * x), xy + c, zx - b),
        *(xy - c, same + 2 * (y * y), yz + a),
        *(zx + b, yz - a, same + 2 * (z * z)),
    ]
    return xp.reshape(xp.stack(elements, axis=-1), (*x.shape, 3, 3))


@takes(theta="3")
def from_rotation_vector(theta: Array) -> Array:
    """The quaternion of a rotation about the direction of theta, by its length.

    dq = (theta / a sin(a / 2), cos(a / 2)),   a = norm(theta),   T(dq) = I - [theta x] + ...

    Parameters
    ----------
    theta : array (..., 3)
        rad.

    Returns
    -------
    array (..., 4)
        Of length one.

    Notes
    -----
    The sine is divided by the angle as sinc, which is 1 at zero: nothing is lost for small angles.
    At zero the two series stand, so that first and second derivatives are there what they are.

    References
    ----------
    pogorelsky2020, Eqs. (25) and (37), which is 0/0 as printed for no rotation.
    """
    xp = theta.__array_namespace__()
    square = dot(theta, theta)[..., None]
    turns = square.real > 0
    angle = xp.sqrt(xp.where(turns, square, 1.0))  # a root at 0 has no derivative
    ratio = xp.where(turns, xp.sin(angle / 2) / angle, 0.5 - square / 48)
    cosine = xp.where(turns, xp.cos(angle / 2), 1.0 - square / 8)
    return xp.concat([ratio * theta, cosine], axis=-1)


@takes(q="4")
def rotation_vector(q: Array) -> Array:
    """The rotation vector of a quaternion, of length 0 to pi; q and -q have the same.

    Parameters
    ----------
    q : array (..., 4)
        Unit quaternion, scalar last.

    Returns
    -------
    array (..., 3)
        rad.

    Notes
    -----
    The angle is 2 atan2(norm(q_v), abs(q_s)): an arccosine would lose half of the digits near zero.
    """
    xp = q.__array_namespace__()
    v, s = q[..., :3], q[..., 3:]
    square = dot(v, v)[..., None]
    turned = square.real > 0
    sine = xp.sqrt(xp.where(turned, square, 1.0))
    ratio = xp.where(turned, 2 * atan2(sine, absolute(s)) / sine, 2.0)
    return xp.where(s.real < 0, -ratio, ratio) * v
