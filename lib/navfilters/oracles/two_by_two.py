"""Matrices of two by two, written out in plain Python numbers."""

try:
    from mpmath import mp, mpf
except ImportError:
    raise ImportError("this oracle needs mpmath: pip install navfilters[book]") from None


# --- 2x2 algebra -------------------------------------------------------------------------------


def add(a, b, factor=1):
    """The matrix a + factor * b, entry by entry."""
    return tuple(u + factor * v for u, v in zip(a, b, strict=True))


def outer(b):
    """The symmetric matrix b b^T."""
    return b[0] * b[0], b[0] * b[1], b[1] * b[1]


def is_positive_definite(p):
    """Both leading minors are positive."""
    p11, p12, p22 = p
    return p11 > 0 and p11 * p22 - p12 * p12 > 0


def spectral_norm(p):
    """Largest absolute eigenvalue of a symmetric matrix: |mean| + radius."""
    p11, p12, p22 = p
    radius = mp.sqrt(((p11 - p22) / 2) ** 2 + p12 * p12)
    return abs((p11 + p22) / 2) + radius


def square_root(p, root):
    """The two columns of a square root of P, for Eq. (21).

    "cholesky" is the lower factor; "symmetric" is the principal root
    (P + s I) / sqrt(trace P + 2 s) with s = sqrt(det P).
    """
    p11, p12, p22 = p
    if root == "cholesky":
        l11 = mp.sqrt(p11)
        l21 = p12 / l11
        return (l11, l21), (mpf(0), mp.sqrt(p22 - l21 * l21))
    if root == "symmetric":
        s = mp.sqrt(p11 * p22 - p12 * p12)
        t = mp.sqrt(p11 + p22 + 2 * s)
        return ((p11 + s) / t, p12 / t), (p12 / t, (p22 + s) / t)
    raise ValueError(f"root is 'cholesky' or 'symmetric', not {root!r}")


def spread_through(h, p):
    """H P H^T and P H^T, for a general H and a symmetric P."""
    a, b, c, d = h
    p11, p12, p22 = p
    # P H^T: column i belongs to measurement i.
    xz11, xz12 = p11 * a + p12 * b, p11 * c + p12 * d
    xz21, xz22 = p12 * a + p22 * b, p12 * c + p22 * d
    hph = (a * xz11 + b * xz21, a * xz12 + b * xz22, c * xz12 + d * xz22)
    return hph, (xz11, xz12, xz21, xz22)


def full(p):
    """The general matrix of a symmetric one."""
    return p[0], p[1], p[1], p[2]


def symmetric(a):
    """The symmetric part of a general matrix."""
    return a[0], (a[1] + a[2]) / 2, a[3]


def transposed(a):
    """A^T of a general matrix."""
    return a[0], a[2], a[1], a[3]


def product(a, b):
    """A B of general matrices."""
    return (
        a[0] * b[0] + a[1] * b[2],
        a[0] * b[1] + a[1] * b[3],
        a[2] * b[0] + a[3] * b[2],
        a[2] * b[1] + a[3] * b[3],
    )


def applied(a, v):
    """A v of a general matrix and a vector."""
    return a[0] * v[0] + a[1] * v[1], a[2] * v[0] + a[3] * v[1]


def inverse(p):
    """P^-1 of a symmetric matrix."""
    p11, p12, p22 = p
    det = p11 * p22 - p12 * p12
    return p22 / det, -p12 / det, p11 / det


def general_inverse(a):
    """A^-1 of a general matrix."""
    det = a[0] * a[3] - a[1] * a[2]
    return a[3] / det, -a[1] / det, -a[2] / det, a[0] / det
