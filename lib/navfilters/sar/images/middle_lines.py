"""A few lines of a long inverse transform, by gridding."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy import fft

from navfilters.sar.in_parts import blocks, in_threads
from navfilters.sar.phase_blocks import PIECE
from navfilters.types import Array

FINER = 2.0  # the coarse grid's frequencies lie closer than those of the lines by this
WIDTH = 8  # of the window, coarse frequencies: for that, as good as single precision
ROWS = 8  # coarse frequencies in a matrix product: with PIECE, BLAS starts no threads


class _Gridding(NamedTuple):
    """From frequencies to coarse ones: rows, what they are made of, weights; and what is left."""

    length: int
    rows: int
    parts: list[tuple[slice, slice, Array]]
    left: Array


def middle_lines(spectrum: Array, first: int, n: int, lines: int, columns: int) -> Array:
    """Lines about time 0 of the inverse transform of neighbouring frequencies.

    x[s] = 1/n sum_j spectrum[j] exp(2 pi i (first + j) s / n),   s = -(lines // 2), ...

    Parameters
    ----------
    spectrum : array (k, m) of complex64
        m a multiple of PIECE.
    first : int
        Of the frequencies, in units of 1/n.
    n : int
        Of the whole transform.
    lines, columns : int
        That are wanted of it; the first columns.

    Returns
    -------
    ndarray (lines, columns) of complex64
        As exact as a transform in single precision: 2e-7.

    Notes
    -----
    Frequencies are gathered on a grid that is as coarse as so few lines allow, by a window that
    lets in nothing of the lines beyond, and its transform is divided out.

    References
    ----------
    beatty2005: the Kaiser-Bessel window.
    """
    length, rows, parts, left = _gridding(n, len(spectrum), lines)
    pieces = spectrum.reshape(len(spectrum), -1, PIECE).swapaxes(0, 1)
    coarse = np.zeros((len(pieces), rows, PIECE), np.complex64)  # each piece stays in the cache

    def gather(some: slice) -> None:
        for here, there, weights in parts[some]:
            for_all = pieces[:, there].view(np.float32)
            np.matmul(weights, for_all, out=coarse[:, here].view(np.float32))

    in_threads(gather, blocks(len(parts), 8))
    coarse[:, : rows - length] += coarse[:, length:]
    before = lines // 2
    s = np.arange(lines) - before
    turned = np.exp(2j * np.pi * s * (first / n - WIDTH / 2 / length))
    scale = (left * turned).astype(np.complex64)[:, None]
    found = np.empty((lines, columns), np.complex64)

    def transform(some: slice) -> None:
        into = found[:, some]
        column = fft.ifft(coarse[some.start // PIECE, :length], axis=0)[:, : into.shape[1]]
        np.multiply(column[length - before :], scale[:before], out=into[:before])
        np.multiply(column[: lines - before], scale[before:], out=into[before:])

    in_threads(transform, blocks(columns, PIECE))
    return found


@lru_cache(maxsize=8)
def _gridding(n: int, k: int, lines: int) -> _Gridding:
    """The weights of k frequencies."""
    length = fft.next_fast_len(max(int(np.ceil(FINER * lines)), 2 * WIDTH))
    finer = length / lines
    beta = np.pi * np.sqrt((WIDTH / finer * (finer - 0.5)) ** 2 - 0.8)
    rows = max(int(np.ceil((k - 1) * length / n)) + WIDTH + 1, length)
    parts = list[tuple[slice, slice, Array]]()
    for here in blocks(rows, ROWS):
        low, high = here.start - WIDTH, here.stop - 1  # of the windows, in coarse frequencies
        there = slice(max(int(np.ceil(low * n / length)), 0), min(int(high * n / length) + 1, k))
        if there.start >= there.stop:
            break
        centre = np.arange(here.start, here.stop)[:, None] - WIDTH / 2
        u = np.arange(there.start, there.stop) * (length / n) - centre
        inside = 1 - (2 * u / WIDTH) ** 2
        window = np.where(inside >= 0, np.i0(beta * np.sqrt(np.maximum(inside, 0))), 0)
        parts.append((here, there, window.astype(np.float32)))
    s = np.arange(lines) - lines // 2
    root = np.sqrt(beta**2 - (np.pi * WIDTH * s / length) ** 2)
    return _Gridding(length, rows, parts, length / n * root / (WIDTH * np.sinh(root)))
