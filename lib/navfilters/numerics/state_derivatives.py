"""Derivatives of a model's functions of the state, where it does not give them."""

from collections.abc import Callable

import numpy as np

from navfilters.numerics.complex_step import _by_complex_step
from navfilters.types import Array


def first_derivative(function: Callable[[Array], Array], x: Array, name: str) -> Array:
    """The Jacobian of an analytic function: by complex step, of a JAX array in forward mode.

    Parameters
    ----------
    function : callable
        (..., n) -> (..., *core)
    x : array (..., n)
    name : str
        What to call function in an error.

    Returns
    -------
    array (..., *core, n)

    Raises
    ------
    TypeError
        As of :func:`~navfilters.numerics.complex_step.complex_step`, but for the comparison with
        differences, which ``run`` and ``sweep`` make once.
    """
    if isinstance(x, np.ndarray):
        return _by_complex_step(function, x, 1e-30, name)
    import jax

    directions = np.broadcast_to(
        np.eye(x.shape[-1])[:, *(None,) * (x.ndim - 1)], (x.shape[-1], *x.shape)
    )
    # One program for all directions: a program for each takes n times, twice nested n^2 times, as
    # long to compile.
    along = jax.vmap(lambda d: jax.jvp(function, (x,), (d,))[1], out_axes=-1)
    return along(jax.numpy.asarray(directions))


def second_derivative(function: Callable[[Array], Array], x: Array, name: str) -> Array:
    """Second derivatives of an analytic function, as :func:`first_derivative`.

    Parameters
    ----------
    function : callable
        (..., n) -> (..., m)
    x : array (..., n)
    name : str

    Returns
    -------
    array (..., m, n, n)

    Notes
    -----
    Under NumPy, differences of sixth order of the Jacobian by complex step: to about 1e-10 of the
    largest. Their step is a hundredth of x, or, where such a step is seen to be too long, as of
    places far from the origin, the part of it that is best.
    """

    def of(y: Array) -> Array:
        return first_derivative(function, y, name)

    if not isinstance(x, np.ndarray):
        return first_derivative(of, x, name)
    x = x.astype(float, copy=False)
    middle = of(x)
    H = np.stack([_by_differences(of, x, middle, j) for j in range(x.shape[-1])], axis=-1)
    return (H + H.mT) / 2


SHORTER = range(0, 32, 4)
"""Binary digits by which the step of a difference is shortened, until it is short enough."""

SHARP = 1e-7
"""Relative difference of the fourth order from the sixth where a step is short enough: the sixth
is then right to 1e-10."""


def _by_differences(of: Callable[[Array], Array], x: Array, middle: Array, j: int) -> Array:
    """How a Jacobian changes with component j, each element by the step that suits it."""
    size = np.where(x[..., j] == 0, 1.0, np.abs(x[..., j]))
    longest = 2.0 ** np.round(np.log2(0.01 * size))
    best, bound = np.full(middle.shape, np.nan), np.full(middle.shape, np.inf)
    sharp = ~np.isfinite(middle)  # a member that has failed keeps nobody waiting
    for digits in SHORTER:
        length = longest * 2.0**-digits
        h = np.zeros_like(x)
        h[..., j] = length
        per_step = 1 / length[..., None, None]
        ahead, behind = ([of(x + i * h) for i in steps] for steps in ((1, 2, 3), (-1, -2, -3)))
        a, b, c = (p - q for p, q in zip(ahead, behind, strict=True))
        d, e, f = (p + q for p, q in zip(ahead, behind, strict=True))
        found = (a / (4 / 3) + b / (-20 / 3) + c / 60) * per_step
        gap = np.abs(found - (8 * a - b) / 12 * per_step)  # from the fourth order
        gap = gap + np.abs(f - 6 * e + 15 * d - 20 * middle) * per_step
        largest = np.max(np.abs(np.stack([middle, *ahead, *behind])), axis=0)
        rounding = 20 * np.finfo(float).eps * largest * per_step
        better = (gap + rounding < bound) & ~sharp  # others do not decide a member's last bits
        best, bound = np.where(better, found, best), np.where(better, gap + rounding, bound)
        sharp = sharp | (gap <= SHARP * np.abs(found) + rounding)
        if sharp.all():
            break
    return best
