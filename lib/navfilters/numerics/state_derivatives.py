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
    largest.
    """

    def of(y: Array) -> Array:
        return first_derivative(function, y, name)

    if not isinstance(x, np.ndarray):
        return first_derivative(of, x, name)
    columns = []
    for j in range(x.shape[-1]):
        h = np.zeros_like(x)
        h[..., j] = 2.0 ** np.round(
            np.log2(0.01 * np.where(x[..., j] == 0, 1.0, np.abs(x[..., j])))
        )
        pairs = [
            (of(x + i * h) - of(x - i * h)) / w for i, w in ((1, 4 / 3), (2, -20 / 3), (3, 60))
        ]
        columns.append(sum(pairs) / h[..., j, None, None])
    H = np.stack(columns, axis=-1)
    return (H + H.mT) / 2
