"""The spectra of the scatterers in a block of range, and what makes echoes of them."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebpts1, chebvander
from scipy import fft
from scipy.interpolate import CubicSpline

from navfilters.sar.in_parts import blocks as parts
from navfilters.sar.raw.echoes_of_points import Echoes, _history, _turned, _unit
from navfilters.sar.raw.flight import Flight
from navfilters.sar.raw.radar import LIGHT, Radar, Window
from navfilters.types import Array

ROWS = 64  # of a matrix that are transformed at once, 1 MB
PRODUCT = 2**15  # multiplications in a complex matrix product: so few that BLAS starts no threads
CHANGE = 1.2  # of the migration's phase from the middle of some columns to their end, rad, at most
NODES = 9  # of those columns that are transformed; 1e-7 between them, for that change


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


class _Ground(NamedTuple):
    """A raster's layers (n, cells) in a block, their offsets in range and their columns."""

    layers: Array
    change: _Dispersion
    offset: Array
    place: Array

    def spectra(self, rows: slice, m: int) -> Array:
        turned = _unit(np.outer(self.change.by_range[rows], self.offset).astype(np.float32))
        turned *= self.layers[rows]
        padded = np.zeros((len(turned), m), np.complex64)
        padded[:, self.place] = turned
        return fft.fft(padded, axis=1, overwrite_x=True)


class _Bright(NamedTuple):
    """The points of a block, whose spectra are outer products: (n, points) and (points, m)."""

    in_time: Array
    in_range: Array

    @classmethod
    def of(
        cls,
        radar: Radar,
        change: _Dispersion,
        window: Window,
        echoes: Echoes,
        f: Array,
        f_R: Array,
        R_b: float,
        mean_height: float,
    ) -> "_Bright":
        time = 2 * np.pi * (echoes.time - window.first_time)
        delay = 4 * np.pi / LIGHT * (echoes.slant_range - window.near_range)
        carrier = echoes.amplitude * np.exp(-4j * np.pi / radar.wavelength * echoes.slant_range)
        phase = np.outer(change.by_range, echoes.slant_range - R_b) - np.outer(f, time)
        phase += np.outer(change.by_height, echoes.height - mean_height)
        in_time = (_turned(phase) * carrier).astype(np.complex64)
        return cls(in_time, _turned(-np.outer(delay, f_R)).astype(np.complex64))

    def add(self, rows: slice, out: Array) -> None:
        here = self.in_time[rows]
        for columns in parts(out.shape[1], max(PRODUCT // max(here.size, 1), 1)):
            out[:, columns] += here @ self.in_range[:, columns]


class _Transfer(NamedTuple):
    """H(f_t, f_R) in some columns: spectra (n, NODES) @ weights (NODES, columns)."""

    columns: slice
    spectra: Array
    weights: Array


def _transfers(
    radar: Radar,
    flight: Flight,
    t: float,
    slant_range: float,
    height: float,
    half: int,
    n: int,
    f_R: Array,
) -> list[_Transfer]:
    """The exact echo's in azimuth, without that of the pulse.

    It is exact at a few frequencies in range, between which it is a polynomial of them, but for the
    phase of the middle of the migration.
    """
    k = np.arange(-half, half + 1)
    p = flight.ground_point(t, slant_range, height)
    distance, pattern = _history(radar, flight, p, t + k / radar.prf)
    migration = distance - slant_range
    carrier = pattern * np.exp(-4j * np.pi / radar.wavelength * migration)
    metres = migration * (4 * np.pi / LIGHT)
    middle, reach = (metres.max() + metres.min()) / 2, np.ptp(metres) / 2
    most = int(np.clip(2 * CHANGE / (reach * f_R[1]), 1, PRODUCT // (ROWS * NODES)))
    nodes, positive = chebpts1(NODES), (len(f_R) + 1) // 2
    to_nodes = np.linalg.inv(chebvander(nodes, NODES - 1))

    def exact(columns: slice) -> _Transfer:
        f = f_R[columns]
        centre, width = (f[0] + f[-1]) / 2, max(f[-1] - f[0], f_R[1]) / 2
        history = _unit(-np.outer(centre + width * nodes, metres - middle).astype(np.float32))
        padded = np.zeros((NODES, n), np.complex64)
        padded[:, k % n] = history * carrier.astype(np.complex64)
        weights = (chebvander((f - centre) / width, NODES - 1) @ to_nodes).T
        weights = (weights * np.exp(-1j * middle * f)).astype(np.complex64)
        spectra = fft.fft(padded, axis=1, overwrite_x=True).T
        return _Transfer(columns, np.ascontiguousarray(spectra), weights)

    negative = [slice(positive + c.start, positive + c.stop) for c in parts(len(f_R) // 2, most)]
    return [exact(columns) for columns in parts(positive, most) + negative]
