"""An observation of a scene: its raw data, noise included."""

from typing import Any

import numpy as np

from navfilters.numerics import validation
from navfilters.sar.ground.scene import Scene
from navfilters.sar.raw.echoes_of_points import Echoes, _half_aperture, _history
from navfilters.sar.raw.flight import Flight, view_of
from navfilters.sar.raw.radar import Radar, Raw, Window, receive
from navfilters.sar.raw.rasters import _ground_speed, scene_raster
from navfilters.sar.raw.synthesis import synthesize
from navfilters.space.frames import geodetic_to_ecef
from navfilters.types import Array


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
    deviation = np.float32(_noise_deviation(radar, flight, scene) / np.sqrt(2))
    for line in received:  # so small an array stays in the cache
        line += deviation * rng.standard_normal(2 * len(line), np.float32).view(np.complex64)
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
