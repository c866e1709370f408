"""The classical Runge-Kutta method of fourth order, and Euler's."""

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
    return x + runge_kutta_increment(derivative, x, h)


def runge_kutta_increment(derivative: Callable[[Array], Array], x: Array, h: float) -> Array:
    """What such a step adds to x.

    Parameters
    ----------
    derivative, x, h
        As of :func:`runge_kutta`.

    Returns
    -------
    array (..., n)
    """
    k1 = derivative(x)
    k2 = derivative(x + (h / 2) * k1)
    k3 = derivative(x + (h / 2) * k2)
    k4 = derivative(x + h * k3)
    return (h / 6) * (k1 + 2 * (k2 + k3) + k4)


def euler_increment(derivative: Callable[[Array], Array], x: Array, h: float) -> Array:
    """What a step of Euler's method adds to x.

    Parameters
    ----------
    derivative, x, h
        As of :func:`runge_kutta`.

    Returns
    -------
    array (..., n)
    """
    return h * derivative(x)
