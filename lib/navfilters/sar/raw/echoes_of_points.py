"""The echoes of points, pulse by pulse, by their exact ranges."""

from typing import NamedTuple

import numpy as np
from scipy import fft

from navfilters.sar.in_parts import blocks, in_threads
from navfilters.sar.raw.flight import Flight
from navfilters.sar.raw.radar import LIGHT, Radar, Window
from navfilters.types import Array

CACHED = 2**15
"""Samples of pulses that are computed at once: temporary arrays of all would come from the system
page by page, which costs as much as they do."""

FEW = 32
"""Samples of a pulse whose phases differ from that of the first in the same way."""


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
    early = 2 * (window.near_range - distance) / LIGHT
    # The phase is quadratic in delay + early: a square of each, and their product, in which the
    # delay is that of the first of a few samples, and one more: few sines and cosines for all.
    middle, rate = delay - radar.pulse_length / 2, 2 * np.pi * radar.chirp_rate
    of_delay, of_early = _turned(rate / 2 * middle**2), _turned(rate / 2 * early**2)
    carrier = pattern * np.exp(-4j * np.pi * distance / radar.wavelength) * of_early
    echo = np.empty((window.pulses, len(delay)), np.complex128)

    def heard(pulses: slice) -> None:
        turn = rate * early[pulses, None]
        first = _turned(turn * middle[::FEW]) * carrier[pulses, None]
        chirp = first[..., None] * _turned(turn * delay[:FEW])[:, None]
        chirp = chirp.reshape(len(turn), -1)[:, : len(delay)]
        into = delay + early[pulses, None]
        chirp[(into < 0) | (into >= radar.pulse_length)] = 0
        np.multiply(chirp, of_delay, out=echo[pulses])

    in_threads(heard, blocks(window.pulses, max(CACHED // len(delay), 1)))
    return echo


def _history(radar: Radar, flight: Flight, p: Array, t: Array) -> tuple[Array, Array]:
    """Range of a point at times, and the antenna's pattern towards it."""
    r, v = flight.position(t), flight.velocity(t)
    ray = p - r
    distance = np.linalg.norm(ray, axis=-1)
    across = np.cross(v, r)
    x = np.cross(across, -r)  # the horizontal axis of navfilters.space.frames.body_axes
    x /= np.linalg.norm(x, axis=-1)[..., None]
    return distance, radar.pattern(np.sum(ray * x, axis=-1) / distance)


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


def _turned(phase: Array) -> Array:
    """exp(i phase): a real sine and cosine cost a fraction of a complex exponential."""
    z = np.empty(phase.shape, np.complex128)
    np.cos(phase, out=z.real)
    np.sin(phase, out=z.imag)
    return z


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
