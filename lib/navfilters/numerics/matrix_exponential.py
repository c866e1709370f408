"""The matrix exponential of a stack, for NumPy and JAX alike."""

from navfilters.types import Array


def expm(A: Array) -> Array:
    """Matrix exponential, by Taylor's series to degree 14 of A / 2^s, squared s times.

    Each member has its own s, with norm(A) / 2^s at most 1/2.

    Parameters
    ----------
    A : array (..., n, n)

    Returns
    -------
    array (..., n, n)
        NaN where a norm exceeds 1024: doubles overflow there.
    """
    xp = A.__array_namespace__()
    identity = xp.eye(A.shape[-1])
    norm = xp.max(xp.sum(xp.abs(A), axis=-1), axis=-1)
    usable = norm <= 1024.0  # and not NaN
    halvings = xp.ceil(xp.log2(xp.where(usable & (norm > 0.5), norm, 0.5) / 0.5))[..., None, None]
    scaled = xp.where(usable[..., None, None], A, xp.nan) / 2**halvings
    E = identity + scaled / 14
    for j in range(13, 0, -1):
        E = identity + scaled @ E / j
    for j in range(11):
        E = xp.where(j < halvings, E @ E, E)
    return E
