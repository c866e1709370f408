"""The classical Runge-Kutta method of fourth order."""

from collections.abc import Callable

from navfilters.types import Array


def runge_kutta(derivative: Callable[[Array], Array], x: Array, h: float) -> Array:
    """One classical Runge-Kutta step of fourth order.

    Parameters
    ----------
    derivative : callable
        dx/dt of x, (..., n) -> (..., n).
    x : array (..., n)
        State at the start.
    h : float
        Length of the step, s.

    Returns
    -------
    array (..., n)
        State at the end.
    """
    k1 = derivative(x)
    k2 = derivative(x + (h / 2) * k1)
    k3 = derivative(x + (h / 2) * k2)
    k4 = derivative(x + h * k3)
    return x + (h / 6) * (k1 + 2 * (k2 + k3) + k4)
