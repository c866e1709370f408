"""The Earth's potential to the second zonal harmonic, in textbook form."""

MU, RE, J2 = 3.986004418e14, 6378137.0, 1.08262668e-3


def potential(r):
    """mu/r (1 - J2 (Re/r)^2 P2(sin latitude)), P2(s) = (3 s^2 - 1) / 2."""
    xp = r.__array_namespace__()
    d = xp.sqrt(xp.sum(r * r, axis=-1))
    legendre = (3 * (r[..., 2] / d) ** 2 - 1) / 2
    return MU / d * (1 - J2 * (RE / d) ** 2 * legendre)
