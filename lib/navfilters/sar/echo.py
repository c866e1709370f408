"""Raw stripmap data of a scene, from the true flight.

The echo of one point is known exactly (:func:`point_echo`); summed over a scene it would take 1e11
pulses. :func:`synthesize` sums in the frequency domain instead. The range histories are those of
the flight itself, integrated and not taken to be hyperbolas; the focuser shares neither a
function nor a constant with this module. The platform stands still while a pulse travels, and the
elevation pattern of the antenna, the atmosphere and the quantization of the data are left out.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.polynomial import polyvander
from scipy import fft
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from navfilters import validation
from navfilters.frames import east_north_up, ecef_to_geodetic, geodetic_to_ecef
from navfilters.models.earth_fixed import runge_kutta
from navfilters.sar.scene import Scene, View
from navfilters.types import Array

LIGHT = 299792458.0
"""Speed of light, m/s."""


@dataclass(frozen=True)
class Radar:
    """A stripmap radar; by default PALSAR's fine beam.

    Parameters
    ----------
    wavelength : float
        m.
    bandwidth : float
        Of the chirp, Hz.
    pulse_length : float
        s.
    sampling : float
        Complex samples in a second, Hz.
    prf : float
        Pulses in a second, Hz.
    antenna : float
        Length along the flight, m.
    squint : float
        Angle by which the beam looks ahead of the plane across the flight, deg: an antenna that is
        not where it should be. The pattern in elevation is left out, so no other angle matters.
    nesz : float
        Reflectivity that the thermal noise equals, dB of the scene's unit.
    falling : bool
        Whether the chirp's frequency falls, as PALSAR's does.
    flat_beam : bool
        Whether the antenna is uniform over the illuminated angle, for tests against theory.

    Raises
    ------
    ValueError
        Naming the argument, the value found and what is needed.

    Notes
    -----
    Nothing is received from angles beyond +-wavelength / (2 antenna), where a uniform antenna's
    power has fallen by 3.9 dB one way: there are no azimuth ambiguities.

    References
    ----------
    pogorelsky2020, section "Closed-loop trajectory and SAR data": ALOS PALSAR, without parameters.
    """

    wavelength: float = 0.2360571
    bandwidth: float = 28e6
    pulse_length: float = 27e-6
    sampling: float = 32e6
    prf: float = 2150.0
    antenna: float = 8.9
    squint: float = 0.0
    nesz: float = -23.0
    falling: bool = True
    flat_beam: bool = False

    def __post_init__(self) -> None:
        for name in ("wavelength", "bandwidth", "pulse_length", "sampling", "prf", "antenna"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"{name} must be a positive number; found {value}")
        if self.bandwidth > self.sampling:
            raise ValueError(
                f"sampling must be at least the bandwidth, {self.bandwidth} Hz; found "
                f"{self.sampling}"
            )
        if not abs(self.squint) < 5:
            raise ValueError(f"squint must be less than 5 deg either way; found {self.squint}")
        if np.isnan(self.nesz):
            raise ValueError(f"nesz must be a number of dB, or -inf; found {self.nesz}")

    @property
    def range_spacing(self) -> float:
        """Slant range between samples, m."""
        return LIGHT / (2 * self.sampling)

    @property
    def chirp_rate(self) -> float:
        """Hz/s, negative if the frequency falls."""
        return (-1 if self.falling else 1) * self.bandwidth / self.pulse_length

    @property
    def chirp_samples(self) -> int:
        """Samples that a pulse covers."""
        return int(np.ceil(self.pulse_length * self.sampling))

    def pattern(self, sine: Array) -> Array:
        """Amplitude there and back, 1 at the middle of the beam.

        Parameters
        ----------
        sine : array (...)
            Of the angle ahead of the plane across the flight.

        Returns
        -------
        ndarray (...)
        """
        u = self.antenna / self.wavelength * (np.asarray(sine) - np.sin(np.deg2rad(self.squint)))
        return np.where(np.abs(u) <= 0.5, 1.0 if self.flat_beam else np.sinc(u) ** 2, 0.0)


PALSAR = Radar()
"""The fine beam of ALOS."""


@dataclass(frozen=True, eq=False)
class Raw:
    """Raw data, and what a processor is told of them.

    Parameters
    ----------
    samples : array (pulses, ranges) of complex64
        Demodulated from the carrier.
    wavelength, sampling, prf, pulse_length : float
        m, Hz, Hz, s: see ``Radar``.
    chirp_rate : float
        Hz/s, negative if the frequency falls.
    near_range : float
        Of the first sample, if a pulse is taken to leave at time 0, m.
    first_time : float
        Of the first pulse, from the flight's epoch, s.
    """

    samples: Array
    wavelength: float
    sampling: float
    prf: float
    pulse_length: float
    chirp_rate: float
    near_range: float
    first_time: float


@dataclass(frozen=True, eq=False)
class Flight:
    """Position as a polynomial in time about an epoch.

    Parameters
    ----------
    path : tuple of numpy.polynomial.Polynomial
        Of time, s, to each Earth-fixed coordinate, m.
    """

    path: tuple[Polynomial, Polynomial, Polynomial]

    @classmethod
    def through(
        cls, derivative: Callable[[Array], Array], x: Array, span: float, step: float = 0.25
    ) -> "Flight":
        """The free flight through a state, by Runge-Kutta both ways.

        Parameters
        ----------
        derivative : callable
            dx/dt of x: ``EarthFixedOrbit.derivative``.
        x : array (6,)
            Earth-fixed position, m, and velocity, m/s, at the epoch.
        span : float
            Seconds before and after it.
        step : float
            Of the integration, s.

        Returns
        -------
        Flight
            A fit of degree 8, good to micrometres for 10 s of a low orbit.
        """
        x = validation.real_array("x", x, "6")
        if not (np.isfinite(span) and span > 0):
            raise ValueError(f"span must be a positive number of s; found {span}")
        n = max(int(np.ceil(span / step)), 5)
        states = {0: x}
        for sign in (-1, 1):
            for k in range(1, n + 1):
                states[sign * k] = runge_kutta(derivative, states[sign * (k - 1)], sign * span / n)
        t = np.arange(-n, n + 1) * (span / n)
        r = np.stack([states[i][:3] for i in range(-n, n + 1)]) - x[:3]
        fits = [Polynomial.fit(t, r[:, i], 8, domain=[-span, span]) + x[i] for i in range(3)]
        return cls((fits[0], fits[1], fits[2]))

    def position(self, t: Any) -> Array:
        """Earth-fixed, m.

        Parameters
        ----------
        t : array (...)
            s.

        Returns
        -------
        ndarray (..., 3)
        """
        return np.stack([p(np.asarray(t, float)) for p in self.path], axis=-1)

    def velocity(self, t: Any) -> Array:
        """Earth-fixed, m/s.

        Parameters
        ----------
        t : array (...)
            s.

        Returns
        -------
        ndarray (..., 3)
        """
        return np.stack([p.deriv()(np.asarray(t, float)) for p in self.path], axis=-1)

    def closest(self, p: Array) -> tuple[Array, Array]:
        """When points pass through the plane across the flight, and how far away they are then.

        Parameters
        ----------
        p : array (..., 3)
            Earth-fixed, m.

        Returns
        -------
        tuple of ndarray (...)
            Zero-Doppler time, s, and slant range, m.
        """
        p = np.asarray(p, float)
        t = np.zeros(p.shape[:-1])
        for _ in range(4):  # Newton: the second pass is good to micrometres
            v, ray = self.velocity(t), p - self.position(t)
            a = np.stack([q.deriv(2)(t) for q in self.path], axis=-1)
            t = t + np.sum(ray * v, axis=-1) / np.sum(v * v - ray * a, axis=-1)
        return t, np.linalg.norm(p - self.position(t), axis=-1)

    def ground_point(self, t: float, slant_range: float, height: float) -> Array:
        """The point to the right that is closest at a time, at a range, with a height.

        Parameters
        ----------
        t : float
            s.
        slant_range : float
            m.
        height : float
            Above the ellipsoid, m.

        Returns
        -------
        ndarray (3,)
            Earth-fixed, m.

        Raises
        ------
        ValueError
            A range at which there is no such point.
        """
        r, v = self.position(t), self.velocity(t)
        right = np.cross(v, r)
        right /= np.linalg.norm(right)
        down = np.cross(v, right)
        down /= -np.copysign(np.linalg.norm(down), down @ r)

        def point(look: float) -> Array:
            return r + slant_range * (np.cos(look) * down + np.sin(look) * right)

        def above(look: float) -> float:
            return float(ecef_to_geodetic(point(look))[2]) - height

        if above(0.0) > 0 or above(1.1) < 0:
            raise ValueError(
                f"slant_range must reach height {height} m; found {slant_range} m from "
                f"{ecef_to_geodetic(r)[2]:.0f} m up"
            )
        return point(brentq(above, 0.0, 1.1, xtol=1e-13))


class Echoes(NamedTuple):
    """Point scatterers in the radar's coordinates.

    Parameters
    ----------
    time, slant_range : array (n,)
        At which each is closest, s, m.
    height : array (n,)
        m.
    amplitude : array (n,) of complex
        Of the echo at the middle of the beam, without the phase of the range.
    """

    time: Array
    slant_range: Array
    height: Array
    amplitude: Array


class Window(NamedTuple):
    """Which pulses and ranges are received.

    Parameters
    ----------
    first_time : float
        Of the first pulse, s.
    pulses, ranges : int
    near_range : float
        Of the first sample, m.
    """

    first_time: float
    pulses: int
    ranges: int
    near_range: float


def point_echo(
    radar: Radar, flight: Flight, p: Array, window: Window, oversampling: int = 1
) -> Array:
    """The exact echo of a point of amplitude 1, in time.

    a(angle) rect((t - 2R/c) / T) exp(i pi K (t - 2R/c - T/2)^2 - 4 i pi R / wavelength)

    Parameters
    ----------
    radar : Radar
    flight : Flight
    p : array (3,)
        Earth-fixed, m.
    window : Window
    oversampling : int
        Samples in range for each of the radar's.

    Returns
    -------
    ndarray (pulses, oversampling * ranges) of complex128
    """
    t = window.first_time + np.arange(window.pulses) / radar.prf
    distance, pattern = _history(radar, flight, p, t)
    delay = np.arange(oversampling * window.ranges) / (oversampling * radar.sampling)
    into = delay + 2 * (window.near_range - distance[:, None]) / LIGHT
    phase = np.pi * radar.chirp_rate * (into - radar.pulse_length / 2) ** 2
    inside = (into >= 0) & (into < radar.pulse_length)
    carrier = pattern * np.exp(-4j * np.pi * distance / radar.wavelength)
    return np.where(inside, np.exp(1j * phase), 0) * carrier[:, None]


def _history(radar: Radar, flight: Flight, p: Array, t: Array) -> tuple[Array, Array]:
    """Range of a point at times, and the antenna's pattern towards it."""
    r, v = flight.position(t), flight.velocity(t)
    ray = p - r
    distance = np.linalg.norm(ray, axis=-1)
    across = np.cross(v, r)
    x = np.cross(across, -r)  # the horizontal axis of navfilters.frames.body_axes
    x /= np.linalg.norm(x, axis=-1)[..., None]
    return distance, radar.pattern(np.sum(ray * x, axis=-1) / distance)


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
    total = np.zeros((n, m), np.complex64)
    edges = np.linspace(*cells, blocks + 1).round().astype(int)
    for low, high in pairwise(edges):
        R_b = window.near_range + (low + high) / 2 * dR
        part = np.zeros((n, m), np.complex64)
        if raster is not None and layers is not None:
            inside = np.arange(max(low, raster.cell), min(high, raster.cell + layers.shape[1]))
            offset = window.near_range + inside * dR - R_b
            phase = np.outer(change.by_range, offset).astype(np.float32)
            part[:, inside % m] = layers[:, inside - raster.cell] * _unit(phase)
            part = fft.fft(part, axis=1, workers=2, overwrite_x=True)
        if echoes is not None:
            cell = (echoes.slant_range - window.near_range) / dR
            mine = Echoes(*(a[(cell >= low) & (cell < high)] for a in echoes))
            part += _point_spectra(radar, change, window, mine, f, f_R, R_b, mean_height)
        part *= _transfer(radar, flight, t_mid, R_b, mean_height, half, n, f_R)
        total += part
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


def _half_aperture(radar: Radar, flight: Flight, window: Window) -> int:
    """Pulses from the plane across the flight to the beam's farther edge on a point, and a few."""
    far = window.near_range + window.ranges * radar.range_spacing
    t = window.first_time + window.pulses / (2 * radar.prf)
    angle = np.arcsin(radar.wavelength / (2 * radar.antenna)) + np.deg2rad(abs(radar.squint))
    # the direction to a point turns at V_eff^2 / (|v| R), and V_eff^2 is some 0.9 of |v|^2
    p = flight.ground_point(t, far, 0.0)
    v = flight.velocity(t)
    a = np.stack([q.deriv(2)(t) for q in flight.path], axis=-1)
    turn = (v @ v + (flight.position(t) - p) @ a) / (np.linalg.norm(v) * far)
    return int(np.ceil(np.tan(angle) / turn * radar.prf)) + 2


def _layers(raster: Raster, change: _Dispersion, mean_height: float, layer: float, n: int) -> Array:
    """Azimuth spectra (n, cells) of a raster, turned by what the heights change."""
    lines, cells = raster.amplitude.shape
    level = (raster.height - mean_height) / layer
    total = np.zeros((n, cells), np.complex64)
    rows = (raster.line + np.arange(lines)) % n
    for k in range(int(np.floor(level.min())), int(np.ceil(level.max())) + 1):
        share = np.maximum(1 - np.abs(level - k), 0).astype(np.float32)
        if not share.any():
            continue
        padded = np.zeros((n, cells), np.complex64)
        padded[rows] = raster.amplitude * share
        turned = np.exp(1j * (k * layer) * change.by_height).astype(np.complex64)
        total += fft.fft(padded, axis=0, workers=2, overwrite_x=True) * turned[:, None]
    return total


def _point_spectra(
    radar: Radar,
    change: _Dispersion,
    window: Window,
    echoes: Echoes,
    f: Array,
    f_R: Array,
    R_b: float,
    mean_height: float,
) -> Array:
    """Spectra (n, m) of points, each an outer product."""
    time = 2 * np.pi * (echoes.time - window.first_time)
    delay = 4 * np.pi / LIGHT * (echoes.slant_range - window.near_range)
    carrier = echoes.amplitude * np.exp(-4j * np.pi / radar.wavelength * echoes.slant_range)
    phase = np.outer(change.by_range, echoes.slant_range - R_b) - np.outer(f, time)
    phase += np.outer(change.by_height, echoes.height - mean_height)
    in_time = (np.exp(1j * phase) * carrier).astype(np.complex64)
    return in_time @ np.exp(-1j * np.outer(delay, f_R)).astype(np.complex64)


def _transfer(
    radar: Radar,
    flight: Flight,
    t: float,
    slant_range: float,
    height: float,
    half: int,
    n: int,
    f_R: Array,
) -> Array:
    """H(f_t, f_R): the azimuth spectrum of the exact echo, without that of the pulse."""
    k = np.arange(-half, half + 1)
    p = flight.ground_point(t, slant_range, height)
    distance, pattern = _history(radar, flight, p, t + k / radar.prf)
    migration = distance - slant_range
    carrier = pattern * np.exp(-4j * np.pi / radar.wavelength * migration)
    delay = np.outer(migration * (4 * np.pi / LIGHT), f_R).astype(np.float32)
    history = np.zeros((n, len(f_R)), np.complex64)
    history[k % n] = _unit(-delay) * carrier[:, None].astype(np.complex64)
    return fft.fft(history, axis=0, workers=2, overwrite_x=True)


def _unit(phase: Array) -> Array:
    """exp(i phase) in single precision."""
    z = np.empty(phase.shape, np.complex64)
    np.cos(phase, out=z.real)
    np.sin(phase, out=z.imag)
    return z


def _pulse_spectrum(radar: Radar, m: int, oversampling: int = 8) -> Array:
    """Of the chirp, (m,), through an ideal receiver of the sampling's band."""
    t = np.arange(oversampling * m) / (oversampling * radar.sampling)
    phase = np.pi * radar.chirp_rate * (t - radar.pulse_length / 2) ** 2
    chirp = np.where(t < radar.pulse_length, np.exp(1j * phase), 0)
    f = fft.fftfreq(m, 1 / m).round().astype(int)
    return (fft.fft(chirp)[f] / oversampling).astype(np.complex64)


def receive(radar: Radar, window: Window, samples: Array) -> Raw:
    """Raw data with the header that goes with them.

    Parameters
    ----------
    radar : Radar
    window : Window
    samples : array (pulses, ranges) of complex

    Returns
    -------
    Raw
    """
    return Raw(
        samples,
        radar.wavelength,
        radar.sampling,
        radar.prf,
        radar.pulse_length,
        radar.chirp_rate,
        window.near_range,
        window.first_time,
    )


def centred_window(
    radar: Radar, flight: Flight, centre: Array, lines: int = 2048, samples: int = 1024
) -> Window:
    """The pulses and ranges of a fully illuminated image with a point at its middle.

    Parameters
    ----------
    radar : Radar
    flight : Flight
    centre : array (3,)
        Earth-fixed, m: it is closest at the pulse of index pulses // 2, and samples // 2 samples
        behind the near range.
    lines, samples : int
        Of the image; even numbers.

    Returns
    -------
    Window
        With the pulses that illuminate the image's edges, and the ranges that a pulse and the
        migration add.

    Raises
    ------
    ValueError
        Numbers that are not even, or too small.
    """
    for name, value in (("lines", lines), ("samples", samples)):
        if validation.whole_number(name, value, 16) % 2:
            raise ValueError(f"{name} must be even; found {value}")
    t, R = (float(x) for x in flight.closest(centre))
    dR = radar.range_spacing
    near = R - samples // 2 * dR
    half = _half_aperture(radar, flight, Window(t, 0, samples, near))
    angle = radar.wavelength / (2 * radar.antenna) + np.deg2rad(abs(radar.squint))
    migration = R * angle**2 / 2 * 1.1  # times (norm(v) / V_eff)^2, of which 2 samples are below
    ranges = samples + radar.chirp_samples + int(np.ceil(migration / dR)) + 2
    pulses = lines + 2 * half
    return Window(t - pulses // 2 / radar.prf, pulses, ranges, near)


def view_of(flight: Flight, centre: Array) -> View:
    """Where the radar is when a point is closest, over a flat Earth at that point.

    Parameters
    ----------
    flight : Flight
    centre : array (3,)
        Earth-fixed, m.

    Returns
    -------
    View
        Its heading is that of the line across the ray, on the ground.
    """
    t, R = flight.closest(centre)
    latitude, longitude, _ = ecef_to_geodetic(centre)
    ray = east_north_up(float(latitude), float(longitude)) @ (centre - flight.position(t))
    heading = np.arctan2(ray[0], ray[1]) - np.pi / 2  # the radar looks to the right
    return View(float(heading), float(np.arccos(-ray[2] / R)), float(R))


def scene_raster(
    radar: Radar,
    flight: Flight,
    scene: Scene,
    window: Window,
    lines: int,
    samples: int,
    speckle: Any,
    margin: int = 48,
) -> Raster:
    """The facets of a scene, added up in the radar's cells, with fully developed speckle.

    Each facet's power is shared linearly between the four nearest cells, so that facets at the same
    time and range overlay each other; a cell has a complex normal amplitude of the sum.

    Parameters
    ----------
    radar : Radar
    flight : Flight
    scene : Scene
    window : Window
        Around the middle of the scene: ``centred_window``.
    lines, samples : int
        Of the image.
    speckle : int or sequence of int
        Seed.
    margin : int
        Cells around the image; there is no ground further out.

    Returns
    -------
    Raster
    """
    power, height, line = _facets(radar, flight, scene, window, lines, samples, margin)
    rng = np.random.default_rng(speckle)
    normal = rng.standard_normal((*power.shape, 2), dtype=np.float32).view(np.complex64)[..., 0]
    return Raster(np.sqrt(power / 2) * normal, height, line, -margin)


def _facets(
    radar: Radar,
    flight: Flight,
    scene: Scene,
    window: Window,
    lines: int,
    samples: int,
    margin: int,
) -> tuple[Array, Array, int]:
    """Power and mean height in each cell, and the first line."""
    first = (window.pulses - lines) // 2 - margin
    shape = (lines + 2 * margin, samples + 2 * margin)
    centre = geodetic_to_ecef(scene.map.latitude, scene.map.longitude, scene.height(0.0, 0.0))
    view = view_of(flight, centre)
    dR, out = radar.range_spacing, np.sin(view.incidence)
    speed = _ground_speed(flight, scene, view)
    extent = shape[0] / 2 / radar.prf * speed, shape[1] / 2 * dR / out
    along = np.arange(-shape[0] // 2, shape[0] // 2 + 1) * (speed / radar.prf)
    relief = scene.height(*_lattice(view, *(np.linspace(-1.3 * e, 1.3 * e, 60) for e in extent)))
    relief = (relief - scene.height(0.0, 0.0)) / np.tan(view.incidence)
    step = dR / out / 3
    ends = [(-extent[1] + np.nanmin(relief)) * 1.03, (extent[1] + np.nanmax(relief)) * 1.03]
    across = np.arange(np.floor(ends[0] / step), np.ceil(ends[1] / step) + 1) * step
    power, height = scene.returns(view, along, across)
    time, distance = _to_radar(flight, scene, view, along, across, height)
    row = (time - window.first_time) * radar.prf - first
    column = (distance - window.near_range) / dR + margin
    total = np.zeros(shape, np.float32)
    moment = np.zeros(shape, np.float32)
    inside = (row >= 0) & (row < shape[0] - 1) & (column >= 0) & (column < shape[1] - 1)
    row, column, power, height = row[inside], column[inside], power[inside], height[inside]
    i, j = row.astype(np.int64), column.astype(np.int64)
    row, column = row - i, column - j
    for di, in_row in ((0, 1 - row), (1, row)):
        for dj, in_column in ((0, 1 - column), (1, column)):
            share = power * in_row * in_column
            index = (i + di) * shape[1] + j + dj
            for grid, weights in ((total, share), (moment, share * height)):
                grid += np.bincount(index, weights, grid.size).reshape(shape).astype(np.float32)
    mean = scene.height(0.0, 0.0)
    return total, np.where(total > 0, moment / np.where(total > 0, total, 1), mean), first


def _lattice(view: View, along: Array, across: Array) -> tuple[Array, Array]:
    """East and north of a grid along and across the flight."""
    flight, away = view.axes
    return tuple(along[:, None] * flight[i] + across * away[i] for i in range(2))


def _ground_speed(flight: Flight, scene: Scene, view: View) -> float:
    """Of the line across the flight, on the ground, m/s."""
    ends = np.array([-500.0, 500.0])
    east, north = (e[:, 0] for e in _lattice(view, ends, np.zeros(1)))
    place = scene.map.geodetic(east, north)
    t, _ = flight.closest(geodetic_to_ecef(*place, scene.height(0.0, 0.0)))
    return 1000.0 / float(t[1] - t[0])


def _to_radar(
    flight: Flight, scene: Scene, view: View, along: Array, across: Array, height: Array
) -> tuple[Array, Array]:
    """Zero-Doppler time and range of facets, by polynomials through exact ones."""
    scale = np.abs(along).max(), np.abs(across).max()
    nodes = np.cos(np.pi * (np.arange(6) + 0.5) / 6)
    low, high = float(height.min()) - 1, float(height.max()) + 1
    levels = (low + high) / 2 + (high - low) / 2 * np.cos(np.pi * (np.arange(3) + 0.5) / 3)
    place = scene.map.geodetic(*_lattice(view, nodes * scale[0], nodes * scale[1]))
    p = geodetic_to_ecef(place[0][..., None], place[1][..., None], levels)
    inverse = np.linalg.inv(polyvander(nodes, 5))
    to_level = np.linalg.inv(polyvander((levels - levels[1]) / 100, 2))
    rows, columns = polyvander(along / scale[0], 5), polyvander(across / scale[1], 5)
    h, results = (height - np.float32(levels[1])) / np.float32(100), []
    for exact in flight.closest(p):
        c = np.einsum("ia,jb,kc,abc->ijk", inverse, inverse, to_level, exact)
        grids = [rows @ c[..., k] @ columns.T for k in range(3)]
        results.append(grids[0] + h * (grids[1] + h * grids[2]))
    return results[0], results[1]


def observe(
    radar: Radar,
    flight: Flight,
    scene: Scene,
    *,
    lines: int = 2048,
    samples: int = 1024,
    speckle: Any = 0,
) -> Raw:
    """Raw data of a scene, its middle at the middle of the image, with thermal noise.

    Parameters
    ----------
    radar : Radar
    flight : Flight
    scene : Scene
    lines, samples : int
        Of the image that can be focused.
    speckle : int or sequence of int
        Seed of the speckle and the noise.

    Returns
    -------
    Raw
    """
    h = scene.height(0.0, 0.0)
    centre = geodetic_to_ecef(scene.map.latitude, scene.map.longitude, h)
    window = centred_window(radar, flight, centre, lines, samples)
    seeds = np.random.SeedSequence(speckle).spawn(3)
    raster = scene_raster(radar, flight, scene, window, lines, samples, seeds[0])
    echoes = _bright(radar, flight, scene, window, lines, samples, seeds[1])
    received = synthesize(radar, flight, window, echoes, raster, mean_height=float(h))
    rng = np.random.default_rng(seeds[2])
    noise = rng.standard_normal((*received.shape, 2), dtype=np.float32).view(np.complex64)[..., 0]
    received += np.float32(_noise_deviation(radar, flight, scene) / np.sqrt(2)) * noise
    return receive(radar, window, received)


def _bright(
    radar: Radar,
    flight: Flight,
    scene: Scene,
    window: Window,
    lines: int,
    samples: int,
    seed: Any,
) -> Echoes:
    """The bright points that the image shows, each with a phase of its own."""
    east, north, power = scene.points
    h = scene.height(east, north)
    t, R = flight.closest(geodetic_to_ecef(*scene.map.geodetic(east, north), h))
    line = (t - window.first_time) * radar.prf - (window.pulses - lines) / 2
    cell = (R - window.near_range) / radar.range_spacing
    seen = (line >= 0) & (line < lines) & (cell >= 0) & (cell < samples)
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(power))
    amplitude = np.sqrt(power) * np.exp(1j * phase)
    return Echoes(*(a[seen] for a in (t, R, h, amplitude)))


def _noise_deviation(radar: Radar, flight: Flight, scene: Scene) -> float:
    """Of a raw sample: what ground of the reflectivity ``nesz`` would send back."""
    h = scene.height(0.0, 0.0)
    p = geodetic_to_ecef(scene.map.latitude, scene.map.longitude, h)
    t, R = (float(a) for a in flight.closest(p))
    view = view_of(flight, p)
    half = _half_aperture(radar, flight, Window(t, 0, 0, R))
    _, pattern = _history(radar, flight, p, t + np.arange(-half, half + 1) / radar.prf)
    cell = _ground_speed(flight, scene, view) / radar.prf
    cell *= radar.range_spacing / np.sin(view.incidence)
    gain = np.sum(pattern**2) * radar.pulse_length * radar.sampling
    return float(np.sqrt(10 ** (radar.nesz / 10) * cell * gain))
