"""The ellipse that an orbit would follow if there were two bodies from now on."""

from navfilters.numerics.analytic import dot
from navfilters.numerics.doors import takes
from navfilters.space.gravity import EARTH, Gravity
from navfilters.types import Array


@takes(x="6")
def perigee_apogee(x: Array, gravity: Gravity = EARTH) -> tuple[Array, Array]:
    """Heights of the osculating ellipse's perigee and apogee above the equatorial radius.

    Parameters
    ----------
    x : array (..., 6)
        Position, m, and velocity, m/s.
    gravity : Gravity
        Gives mu and the radius; J2 takes no part.

    Returns
    -------
    tuple of array (...)
        Metres.
    """
    xp = x.__array_namespace__()
    r, v = x[..., :3], x[..., 3:]
    distance = xp.sqrt(dot(r, r))
    v2, rv = dot(v, v), dot(r, v)
    a = 1 / (2 / distance - v2 / gravity.mu)
    ev = (v2 / gravity.mu - 1 / distance)[..., None] * r - (rv / gravity.mu)[..., None] * v
    e = xp.sqrt(dot(ev, ev))
    return a * (1 - e) - gravity.radius, a * (1 + e) - gravity.radius
