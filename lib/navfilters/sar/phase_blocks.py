"""Phase factors of a spectrum by blocks of lines, which fit the cache."""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.polynomial.chebyshev import chebpts1, chebvander
from scipy import fft

from navfilters.types import Array

Phase = Callable[[Array, Array], Array]
"""Of Doppler frequencies (n, 1), Hz, and places or frequencies in range (m,): (n, m), rad."""

CACHED = 2**17  # complex numbers in a block, 1 MB
LINES = 512  # in a block, at most: see PIECE
BLOCKS = 8  # at least, so that a phase that is quadratic in frequency is nearly straight in each
CHANGE = 2.0  # of a phase across a block, rad, at most
NODES = 6  # lines of a block at which a phase is exact; 4e-5 rad between them, for that change
PIECE = 32  # columns in a matrix product: so small that BLAS starts no threads, which would wait


def lines_at_once(f: Array, *phases: tuple[Phase, Array]) -> int:
    """How many lines make a block across which no phase changes by more than CHANGE.

    Parameters
    ----------
    f : array (n,)
        Doppler frequencies, evenly spaced and in order, Hz.
    *phases : tuple of Phase and array (m,)
        Each with its places. It is zero in their middle and steepest at their ends; the first has
        the most places.

    Returns
    -------
    int
        At least 1.
    """
    steepest = CHANGE / LINES
    for phase, x in phases:
        ends = phase(f[:, None], np.array([x.min(), x.max()]))
        steepest = max(steepest, np.abs(np.diff(ends, axis=0)).max(initial=0.0))
    return max(int(min(CHANGE / steepest, CACHED / len(phases[0][1]), len(f) / BLOCKS)), 1)


def phasor(phase: Phase, f: Array, x: Array) -> Array:
    """exp(i phase), exact at a few lines, between which each column is a polynomial of frequency.

    A matrix product of a few rows costs a fraction of all the sines and cosines.

    Parameters
    ----------
    phase : Phase
    f : array (n,)
        Of the lines of a block, evenly spaced, Hz.
    x : array (m,)
        A multiple of PIECE.

    Returns
    -------
    array (n, m) of complex64
    """
    nodes, weights = _interpolation(len(f))
    exact = unit(phase((f[0] + f[-1] + (f[-1] - f[0]) * nodes)[:, None] / 2, x))
    z = np.empty((len(f), len(x)), np.complex64)

    def pieces(rows: Array) -> Array:
        return rows.view(np.float32).reshape(len(rows), -1, 2 * PIECE).swapaxes(0, 1)

    np.matmul(weights, pieces(exact), out=pieces(z))
    return z


@lru_cache
def _interpolation(n: int) -> tuple[Array, Array]:
    """Nodes in (-1, 1), and what they weigh at n evenly spaced places, (n, NODES)."""
    nodes = chebpts1(NODES)
    places = chebvander(np.linspace(-1, 1, n), NODES - 1)
    return nodes, (places @ np.linalg.inv(chebvander(nodes, NODES - 1))).astype(np.float32)


def unit(phase: Array) -> Array:
    """exp(i phase) in single precision, of a phase that is reduced in double precision.

    Parameters
    ----------
    phase : array (...)
        rad.

    Returns
    -------
    array (...) of complex64
    """
    turn = 2 * np.pi
    reduced = (phase - turn * np.rint(phase / turn)).astype(np.float32)
    z = np.empty(phase.shape, np.complex64)
    np.cos(reduced, out=z.real)
    np.sin(reduced, out=z.imag)
    return z


def fast_length(least: int) -> int:
    """Of an FFT in range, in whole pieces.

    Parameters
    ----------
    least : int

    Returns
    -------
    int
    """
    return PIECE * fft.next_fast_len(-(-least // PIECE))
