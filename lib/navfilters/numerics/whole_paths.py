"""All steps of a body's path at once, where steps are many and bodies few."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from navfilters.numerics.loops import is_jax
from navfilters.types import Array

AT_A_TIME = 4000
"""States worked on at a time: enough to amortise a call, few enough for the cache."""

FEW = 60
"""Fewer steps at a time than these do not pay for the sweeps."""

BRIEF = 1e-6
"""The length of a step that shows the derivative, in steps."""

SWEEPS = 12
"""After so many without a fixed point the steps are taken one by one."""


def whole_path(
    increment: Callable[[Any, Array, float], Array], x: Array, h: float, count: int, longest: int
) -> Array:
    """The states x_{k+1} = x_k + increment(x_k); under JAX one by one.

    Parameters
    ----------
    increment : callable
        (steps, states, h): what a step of length h from each state adds to it, (k, ..., 6), for the
        steps of the slice.
    x : array (..., 6)
        First position, m, and velocity, m/s.
    h : float
        Length of a step, s.
    count : int
        Number of steps.
    longest : int
        Steps that are tried at once at most: about a tenth of a radian of an orbit.

    Returns
    -------
    array (count + 1, ..., 6)
        To the last bit what taking the steps one by one gives.

    Notes
    -----
    A guess of many states goes through all their increments at once, and the sums of these are a
    better guess: each sweep divides its error by thousands. A sweep that returns what it was given
    has found the states that follow from each other.
    """
    if is_jax(x.__array_namespace__()):
        return in_steps(increment, x, h, count)
    # Components first in memory, so that the loops run over steps and members.
    states = np.moveaxis(np.empty((6, count + 1, *x.shape[:-1]), x.dtype), 0, -1)
    states[0] = x
    window = max(1, min(longest, count, AT_A_TIME // max(1, x[..., 0].size)))
    for first in range(0, count, window):
        steps = range(first, min(first + window, count))
        part = states[first : steps.stop + 1]
        if window >= FEW and _swept(partial(_of_part, increment, steps), part, h):
            continue
        for k in steps:
            states[k + 1] = states[k] + increment(slice(k, k + 1), states[k : k + 1], h)[0]
    return states


def in_steps(
    increment: Callable[[Any, Array, float], Array], x: Array, h: float, count: int
) -> Array:
    """The same one by one, under any array namespace.

    Parameters
    ----------
    increment, x, h, count
        As of :func:`whole_path`; increment is called with the number of one step and its state.

    Returns
    -------
    array (count + 1, ..., 6)
    """
    states = [x]
    for k in range(count):
        states.append(states[-1] + increment(k, states[-1], h))
    return x.__array_namespace__().stack(states)


def _swept(increment: Callable[[slice, Array, float], Array], part: Array, h: float) -> bool:
    """Fill the states behind the first one; False if they did not come to rest."""
    _guess(increment, part, h)
    done = 0
    for _ in range(SWEEPS):
        rest = part[done:]
        r, v = rest[..., :3], rest[..., 3:]
        before = rest.copy(order="K")
        more = increment(slice(done, None), rest[:-1], h)
        np.cumsum(np.concatenate([v[:1], more[..., 3:]]), axis=0, out=v)
        # h times the velocity is in a step's change of position: that of this sweep already.
        more = more[..., :3] + h * (v[:-1] - before[:-1, ..., 3:])
        np.cumsum(np.concatenate([r[:1], more]), axis=0, out=r)
        moved = rest != before
        moved &= (rest == rest) | (before == before)  # a NaN rests
        moved = moved.any(axis=tuple(range(1, rest.ndim)))
        if not moved.any():
            return True
        done += int(moved.argmax())  # what follows from states at rest is right
    return False


def _of_part(increment: Callable[..., Any], steps: range, some: slice, x: Array, h: float) -> Array:
    return increment(slice(steps[some].start, steps[some].stop), x, h)


def _guess(increment: Callable[[slice, Array, float], Array], part: Array, h: float) -> None:
    """One step over all, and between its ends the quintic with their r, v and a."""
    count = len(part) - 1
    T = count * h
    s = (np.arange(1, count + 1) / count).reshape(-1, *(1,) * (part.ndim - 1))
    start = part[:1]
    first = slice(0, 1)
    end = start + increment(first, start, T)
    # A short step adds its length times the derivative.
    a, a_end = (increment(first, x, BRIEF * h)[..., 3:] / (BRIEF * h) for x in (start, end))
    r, v = start[..., :3], start[..., 3:]
    dr = end[..., :3] - r - T * v - (T * T / 2) * a
    dv = T * (end[..., 3:] - v - T * a)
    da = (T * T) * (a_end - a)
    c3, c4, c5 = 10 * dr - 4 * dv + da / 2, 7 * dv - 15 * dr - da, 6 * dr - 3 * dv + da / 2
    part[1:, ..., :3] = r + s * (T * v + s * ((T * T / 2) * a + s * (c3 + s * (c4 + s * c5))))
    part[1:, ..., 3:] = v + s * (T * a + (s / T) * (3 * c3 + s * (4 * c4 + s * (5 * c5))))
