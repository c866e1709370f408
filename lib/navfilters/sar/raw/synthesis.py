"""The echoes of a whole scene at once, in the frequency domain."""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy import fft
from scipy.interpolate import CubicSpline

from navfilters.sar.in_parts import blocks as parts
from navfilters.sar.in_parts import in_threads
from navfilters.sar.raw.echoes_of_points import (
    Echoes,
    _half_aperture,
    _history,
    _pulse_spectrum,
    _unit,
)
from navfilters.sar.raw.flight import Flight
from navfilters.sar.raw.radar import LIGHT, Radar, Window
from navfilters.types import Array

ROWS = 64  # of a matrix that are transformed at once, 1 MB
COLUMNS = 32  # the same of columns: a few MB
PRODUCT = 2**16  # multiplications in a matrix product: so few that BLAS starts no threads


@dataclass(frozen=True, eq=False)
class _Dispersion:
    """How the azimuth spectrum's phase changes with range and height, at the Doppler frequencies.

    Parameters
    ----------
    by_range, by_height : array (n,)
        rad/m, without the phase -4 pi R / wavelength of the carrier.
    """

    by_range: Array
    by_height: Array

    @classmethod
    def of(
        cls, radar: Radar, flight: Flight, t: float, slant_range: float, height: float, f: Array
    ) -> "_Dispersion":
        half = 2000.0, 300.0  # differences over the extent of an image
        by: list[Array] = []
        for dR, dh in ((half[0], 0.0), (0.0, half[1])):
            less = _spectral_phase(radar, flight, t, slant_range - dR, height - dh, f)
            more = _spectral_phase(radar, flight, t, slant_range + dR, height + dh, f)
            by.append((more - less) / (2 * (dR + dh)))
        return cls(by[0], by[1])


def _spectral_phase(
    radar: Radar, flight: Flight, t: float, slant_range: float, height: float, f: Array
) -> Array:
    """By the principle of stationary phase: -4 pi (R - R_0) / wavelength - 2 pi f t at R'(t)."""
    p = flight.ground_point(t, slant_range, height)
    reach = radar.wavelength / radar.antenna * slant_range / np.linalg.norm(flight.velocity(t))
    s = np.linspace(-reach, reach, 513)  # twice the illuminated time
    ray, v = flight.position(t + s) - p, flight.velocity(t + s)
    distance = np.linalg.norm(ray, axis=-1)
    doppler = -2 / radar.wavelength * np.sum(ray * v, axis=-1) / distance
    phase = -4 * np.pi / radar.wavelength * (distance - slant_range) - 2 * np.pi * doppler * s
    spline = CubicSpline(doppler[::-1], phase[::-1])
    return spline(np.clip(f, doppler[-1], doppler[0]))


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
    total, part, points = (np.zeros((n, m), np.complex64) for _ in range(3))
    edges = np.linspace(*cells, blocks + 1).round().astype(int)
    for low, high in pairwise(edges):
        R_b = window.near_range + (low + high) / 2 * dR
        if raster is not None and layers is not None:
            inside = np.arange(max(low, raster.cell), min(high, raster.cell + layers.shape[1]))
            offset = window.near_range + inside * dR - R_b
            _raster_spectra(layers[:, inside - raster.cell], change, offset, inside % m, part)
        if echoes is not None:
            cell = (echoes.slant_range - window.near_range) / dR
            mine = Echoes(*(a[(cell >= low) & (cell < high)] for a in echoes))
            _point_spectra(radar, change, window, mine, f, f_R, R_b, mean_height, points)
            part = np.add(part, points, out=part) if raster is not None else points
        _add_transferred(total, part, radar, flight, t_mid, R_b, mean_height, half, f_R)
    total *= _pulse_spectrum(radar, m)
    return fft.ifft2(total, workers=2, overwrite_x=True)[: window.pulses, : window.ranges]


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


def _raster_spectra(
    layers: Array, change: _Dispersion, offset: Array, place: Array, out: Array
) -> None:
    """Spectra (n, m) of a raster's layers at these offsets in range, in these columns."""

    def transform(rows: slice) -> None:
        turned = _unit(np.outer(change.by_range[rows], offset).astype(np.float32))
        turned *= layers[rows]
        padded = np.zeros((len(turned), out.shape[1]), np.complex64)
        padded[:, place] = turned
        out[rows] = fft.fft(padded, axis=1, overwrite_x=True)

    in_threads(transform, parts(len(out), ROWS))


def _point_spectra(
    radar: Radar,
    change: _Dispersion,
    window: Window,
    echoes: Echoes,
    f: Array,
    f_R: Array,
    R_b: float,
    mean_height: float,
    out: Array,
) -> None:
    """Spectra (n, m) of points, each an outer product."""
    time = 2 * np.pi * (echoes.time - window.first_time)
    delay = 4 * np.pi / LIGHT * (echoes.slant_range - window.near_range)
    carrier = echoes.amplitude * np.exp(-4j * np.pi / radar.wavelength * echoes.slant_range)
    phase = np.outer(change.by_range, echoes.slant_range - R_b) - np.outer(f, time)
    phase += np.outer(change.by_height, echoes.height - mean_height)
    in_time = (np.exp(1j * phase) * carrier).astype(np.complex64)
    in_range = np.exp(-1j * np.outer(delay, f_R)).astype(np.complex64)

    def multiply(rows: slice) -> None:
        for columns in parts(len(f_R), COLUMNS):
            np.matmul(in_time[rows], in_range[:, columns], out=out[rows, columns])

    in_threads(multiply, parts(len(f), PRODUCT // (COLUMNS * (len(delay) + 1)) + 1))


def _add_transferred(
    total: Array,
    part: Array,
    radar: Radar,
    flight: Flight,
    t: float,
    slant_range: float,
    height: float,
    half: int,
    f_R: Array,
) -> None:
    """Add spectra times H(f_t, f_R): the exact echo's in azimuth, without that of the pulse."""
    k = np.arange(-half, half + 1)
    p = flight.ground_point(t, slant_range, height)
    distance, pattern = _history(radar, flight, p, t + k / radar.prf)
    migration = distance - slant_range
    carrier = pattern * np.exp(-4j * np.pi / radar.wavelength * migration)
    carrier, metres = carrier[:, None].astype(np.complex64), migration * (4 * np.pi / LIGHT)
    n, m = total.shape

    def add(history: Array, columns: slice) -> None:
        padded = np.zeros((n, history.shape[1]), np.complex64)
        padded[k % n] = history * carrier
        total[:, columns] += part[:, columns] * fft.fft(padded, axis=0, overwrite_x=True)

    def both(columns: slice) -> None:
        """The negative frequencies as well, whose phases are the positive ones' negatives."""
        history = _unit(-np.outer(metres, f_R[columns]).astype(np.float32))
        add(history, columns)
        first, last = max(columns.start, 1), min(columns.stop, (m + 1) // 2)
        if first < last:
            history = history[:, first - columns.start : last - columns.start]
            add(np.conj(history[:, ::-1]), slice(m - last + 1, m - first + 1))

    in_threads(both, parts(m // 2 + 1, COLUMNS))
