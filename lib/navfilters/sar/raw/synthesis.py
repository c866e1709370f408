"""The echoes of a whole scene at once, in the frequency domain."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy import fft

from navfilters.sar.in_parts import blocks as parts
from navfilters.sar.in_parts import in_threads
from navfilters.sar.raw.block_spectra import (
    ROWS,
    _Bright,
    _Dispersion,
    _Ground,
    _Transfer,
    _transfers,
)
from navfilters.sar.raw.echoes_of_points import Echoes, _half_aperture, _pulse_spectrum
from navfilters.sar.raw.flight import Flight
from navfilters.sar.raw.radar import Radar, Window
from navfilters.types import Array

COLUMNS = 32  # of a matrix that are transformed at once: a few MB


class Raster(NamedTuple):
    """Scatterers at the pulses and range samples of a window, and beyond its edges.

    Parameters
    ----------
    amplitude : array (lines, cells) of complex
        With the phase of the range.
    height : array (lines, cells)
        m.
    line, cell : int
        Of the first scatterer, counted from the window's first pulse and sample.
    """

    amplitude: Array
    height: Array
    line: int
    cell: int


def synthesize(
    radar: Radar,
    flight: Flight,
    window: Window,
    echoes: Echoes | None = None,
    raster: Raster | None = None,
    *,
    mean_height: float = 0.0,
    blocks: int = 4,
    layer: float = 150.0,
) -> Array:
    """Echoes of points and of a raster of scatterers, without noise.

    In each of a few blocks of range the echo of one point in the middle is computed exactly and
    transformed, H(f_t, f_R). A scatterer elsewhere in the block has that spectrum, delayed, times
    the phase by which its range and height change the spectrum in azimuth.

    Parameters
    ----------
    radar : Radar
    flight : Flight
    window : Window
    echoes : Echoes, optional
    raster : Raster, optional
    mean_height : float
        Of the ground, m.
    blocks : int
        Of range.
    layer : float
        Scatterers of the raster are split between layers of height so far apart, m.

    Returns
    -------
    ndarray (pulses, ranges) of complex64

    Raises
    ------
    ValueError
        Neither points nor a raster.

    Notes
    -----
    Neglected are the change of migration within a block (0.006 samples at the edge of one of four
    in an image) and that of the history's shape along the track (0.07 m/s of effective velocity in
    a second), and an aperture's edges between two pulses. Against ``point_echo`` through an ideal
    receiver the error is 1 % of the amplitude: see the tests. A receiver without a filter would let
    in another 3 % of a chirp with sharp edges.
    """
    lines, cells = _span(radar, window, echoes, raster)
    half = _half_aperture(radar, flight, window)
    n = max(lines[1] + half, window.pulses) - min(lines[0] - half, 0)
    m = max(cells[1] + radar.chirp_samples + 32, window.ranges) - min(cells[0], 0)
    n, m = fft.next_fast_len(n), fft.next_fast_len(m)
    f, f_R = fft.fftfreq(n, 1 / radar.prf), fft.fftfreq(m, 1 / radar.sampling)
    t_mid = window.first_time + sum(lines) / (2 * radar.prf)
    dR = radar.range_spacing
    R_mid = window.near_range + sum(cells) / 2 * dR
    change = _Dispersion.of(radar, flight, t_mid, R_mid, mean_height, f)
    layers = None if raster is None else _layers(raster, change, mean_height, layer, n)
    ground, bright, transfers = list[_Ground](), list[_Bright](), list[list[_Transfer]]()
    edges = np.linspace(*cells, blocks + 1).round().astype(int)
    for low, high in pairwise(edges):
        R_b = window.near_range + (low + high) / 2 * dR
        transfers.append(_transfers(radar, flight, t_mid, R_b, mean_height, half, n, f_R))
        if raster is not None and layers is not None:
            inside = np.arange(max(low, raster.cell), min(high, raster.cell + layers.shape[1]))
            offset = window.near_range + inside * dR - R_b
            mine = slice(max(low - raster.cell, 0), max(high - raster.cell, 0))
            ground.append(_Ground(layers[:, mine], change, offset, inside % m))
        if echoes is not None:
            cell = (echoes.slant_range - window.near_range) / dR
            seen = Echoes(*(a[(cell >= low) & (cell < high)] for a in echoes))
            bright.append(_Bright.of(radar, change, window, seen, f, f_R, R_b, mean_height))
    pulse, in_range = _pulse_spectrum(radar, m), np.empty((n, window.ranges), np.complex64)

    def add_up(rows: slice) -> None:
        total = np.zeros((rows.stop - rows.start, m), np.complex64)
        H = np.empty_like(total)
        for b, transfer in enumerate(transfers):
            part = ground[b].spectra(rows, m) if ground else np.zeros_like(total)
            if bright:
                bright[b].add(rows, part)
            for columns, spectra, weights in transfer:
                np.matmul(spectra[rows], weights, out=H[:, columns])
            part *= H
            total += part
        total *= pulse
        in_range[rows] = fft.ifft(total, axis=1, overwrite_x=True)[:, : window.ranges]

    in_threads(add_up, parts(n, ROWS))
    received = np.empty((window.pulses, window.ranges), np.complex64)

    def to_time(columns: slice) -> None:
        received[:, columns] = fft.ifft(in_range[:, columns], axis=0)[: window.pulses]

    in_threads(to_time, parts(window.ranges, COLUMNS))
    return received


def _span(
    radar: Radar, window: Window, echoes: Echoes | None, raster: Raster | None
) -> tuple[tuple[int, int], tuple[int, int]]:
    """Lines and cells of all scatterers, each from and to, counted from the window's first."""
    lines, cells = [], []
    if raster is not None:
        rows, columns = raster.amplitude.shape
        lines += [raster.line, raster.line + rows]
        cells += [raster.cell, raster.cell + columns]
    if echoes is not None and len(echoes.time):
        line = (echoes.time - window.first_time) * radar.prf
        cell = (echoes.slant_range - window.near_range) / radar.range_spacing
        lines += [int(np.floor(line.min())), int(np.floor(line.max())) + 1]
        cells += [int(np.floor(cell.min())), int(np.floor(cell.max())) + 1]
    if not lines:
        raise ValueError("echoes or raster must hold scatterers; found none in either")
    return (min(lines), max(lines)), (min(cells), max(cells))


def _layers(raster: Raster, change: _Dispersion, mean_height: float, layer: float, n: int) -> Array:
    """Azimuth spectra (n, cells) of a raster, turned by what the heights change."""
    lines, cells = raster.amplitude.shape
    level = (raster.height - mean_height) / layer
    total = np.zeros((n, cells), np.complex64)
    rows = (raster.line + np.arange(lines)) % n

    def add(columns: slice) -> None:
        here, amplitude = level[:, columns], raster.amplitude[:, columns]
        for k in range(int(np.floor(here.min())), int(np.ceil(here.max())) + 1):
            share = np.maximum(1 - np.abs(here - k), 0).astype(np.float32)
            if not share.any():
                continue
            padded = np.zeros((n, share.shape[1]), np.complex64)
            padded[rows] = amplitude * share
            turned = np.exp(1j * (k * layer) * change.by_height).astype(np.complex64)
            total[:, columns] += fft.fft(padded, axis=0, overwrite_x=True) * turned[:, None]

    in_threads(add, parts(cells, COLUMNS))
    return total
