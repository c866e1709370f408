"""Patches of an ALOS PALSAR level-1.0 product, with the terrain and the reference around them.

Up to three patches are cut from the middle of the swath, one filter interval apart. The truth is
the leader file's state vectors: a patch's true centre is the point at the slant range of its centre
pixel and at its zero-Doppler time, on the terrain, to the right of the flight.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.polynomial import polyvander
from scipy.constants import c
from scipy.optimize import brentq

from navfilters.experiments.sar_closed_loop import UPDATES
from navfilters.experiments.sar_images import FULL, Acquisition, Imaging
from navfilters.experiments.sar_trn import Setup
from navfilters.frames import body_axes, ecef_to_geodetic
from navfilters.sar.echo import Flight, Raw, view_of
from navfilters.sar.focus import Focuser, effective_velocity
from navfilters.sar.geotiff import median_height, read_reference, read_terrain
from navfilters.sar.palsar import Product
from navfilters.sar.scene import LandCover, LocalMap, Points, Scene, Terrain
from navfilters.types import Array

MISSING = 0.1
"""A patch in which more than this share of the lines is missing is not used."""
MARGIN = 1000.0
"""Elevations are read so far beyond the reference image, m."""
_BLOCK = 256  # lines that are read at once, of all columns


def flight_through(product: Product, epoch: float) -> Flight:
    """The polynomial through the six state vectors that are nearest, and through their velocities.

    Parameters
    ----------
    product : Product
    epoch : float
        UTC seconds of the product's day; the flight's own time starts there.

    Returns
    -------
    Flight
        Of degree 11. Through vectors of a low orbit 60 s apart it is good to 10 micrometres and
        1 micrometre a second; a cubic through two of them, to 0.3 m.
    """
    vectors = product.state_vectors
    near = np.argsort(np.abs(vectors.times - epoch))[:6]
    times = vectors.times[near] - epoch
    scale = np.abs(times).max()
    degree = 2 * len(near) - 1
    values = polyvander(times / scale, degree)
    slopes = np.zeros_like(values)
    slopes[:, 1:] = values[:, :-1] * np.arange(1, degree + 1) / scale
    middle = vectors.positions[near[0]]  # the polynomial's digits are for what changes
    rows = np.concatenate([vectors.positions[near] - middle, vectors.velocities[near]])
    solved = np.linalg.solve(np.concatenate([values, slopes]), rows)
    solved[0] += middle
    x, y, z = (Polynomial(solved[:, i], domain=[-scale, scale]) for i in range(3))
    return Flight((x, y, z))


def first_lines(missing: Array, window: int, step: int, most: int = UPDATES) -> Array:
    """Where patches start: as many as fit, with the fewest missing lines, nearest to the middle.

    Parameters
    ----------
    missing : array (lines,) of bool
    window : int
        Lines that each patch needs.
    step : int
        Lines between the starts.
    most : int
        Patches.

    Returns
    -------
    ndarray (n,) of int
        At least one.

    Raises
    ------
    ValueError
        Too few lines for a single patch, missing ones counted.
    """
    before = np.concatenate([[0], np.cumsum(missing)])
    for n in range(most, 0, -1):
        free = len(missing) - window - (n - 1) * step
        if free < 0:
            continue
        starts = np.arange(free + 1)[:, None] + step * np.arange(n)
        lost = (before[starts + window] - before[starts]).max(axis=1)
        best = np.lexsort([np.abs(starts[:, 0] - free / 2), lost])[0]
        if lost[best] <= MISSING * window:
            return starts[best]
    raise ValueError(
        f"product must have {window} lines in a row, at most {100 * MISSING:.0f} % of them "
        f"missing, to focus a patch; found {len(missing)} lines, {before[-1]} of them missing"
    )


class Patch(NamedTuple):
    """One image's raw data, and what is known of it.

    Parameters
    ----------
    acquired : Acquisition
        Its scene has no land cover: nothing is simulated.
    time : float
        Zero-Doppler time of the centre, UTC seconds of the product's day.
    slant_range : float
        Of the centre, m.
    doppler_centroid : float
        Hz.
    pulses, missing : int
        Lines that were read, and how many of them hold no echoes.
    """

    acquired: Acquisition
    time: float
    slant_range: float
    doppler_centroid: float
    pulses: int
    missing: int

    @property
    def pointing(self) -> tuple[float, float]:
        """Look and squint angle of the boresight through the centre, rad, by the true state."""
        a = self.acquired
        ray = body_axes(a.r, a.v) @ ((a.r_f - a.r) / np.linalg.norm(a.r_f - a.r))
        return float(np.arctan2(ray[1], ray[2])), float(np.arcsin(ray[0]))


class _Sizes(NamedTuple):
    """Of what is read for a patch: Doppler band, Hz; lines; first column and how many."""

    bandwidth: float
    pulses: int
    column: int
    ranges: int


def fitted(imaging: Imaging, product: Product) -> Imaging:
    """Images of the same ground and resolution cell, whatever the product's sampling rate.

    Parameters
    ----------
    imaging : Imaging
        For its radar's sampling rate.
    product : Product

    Returns
    -------
    Imaging
        The same for that rate. At 16 MHz (a band of 14 MHz, as in FBD) a sample is twice as long as
        at 32 MHz: half as many samples, and half as many looks in range.

    Raises
    ------
    ValueError
        A rate at which no whole number of looks makes the same cell.
    """
    rate = imaging.radar.sampling
    azimuth, looks = imaging.looks
    fewer = product.sampling_rate / rate
    if abs(fewer - 1) < 1e-3:
        return imaging
    if round(looks * fewer) < 1 or abs(round(looks * fewer) / (looks * fewer) - 1) > 0.1:
        raise ValueError(
            f"product must be sampled such that {looks} looks in range at {1e-6 * rate:g} MHz are "
            f"a whole number; found {1e-6 * product.sampling_rate:g} MHz in {product.leader}"
        )
    return replace(
        imaging,
        radar=replace(
            imaging.radar,
            sampling=product.sampling_rate,
            bandwidth=min(imaging.radar.bandwidth, product.sampling_rate),
        ),
        looks=(azimuth, round(looks * fewer)),
        samples=round(imaging.samples * fewer),
    )


def cut_patches(
    product: Product,
    elevation: str | Path,
    reference: str | Path,
    *,
    setup: Setup = Setup(),
    imaging: Imaging = FULL,
    geoid: float = 0.0,
    unit: str | None = None,
) -> list[Patch]:
    """Up to three patches at the middle of the swath, one interval of the filter apart.

    Parameters
    ----------
    product : Product
        Of a radar that looks to the right.
    elevation, reference : str or Path
        GeoTIFF files: see ``navfilters.sar.geotiff``.
    setup : Setup
        Its interval is rounded to whole lines.
    imaging : Imaging
        How images are formed, at any sampling rate: see ``fitted``. What it says of the simulation
        is not used.
    geoid : float
        See ``read_terrain``.
    unit : {"dB", "linear"}, optional
        Of the reference: see ``read_reference``.

    Returns
    -------
    list of Patch
        Only their own lines have been read.

    Raises
    ------
    ValueError
        A product with too few lines or samples, or files that do not cover the patches.
    OSError
        A file that cannot be read.
    ImportError
        Without rasterio, pymap3d or OpenCV.

    Notes
    -----
    A Doppler centroid moves the aperture along the track. As long as that is by less than half an
    image, 240 Hz for 2048 lines of PALSAR's, the centre keeps its whole aperture and an end of the
    image loses some of its own.
    """
    imaging = fitted(imaging, product)
    sizes = _sizes(product, setup, imaging)
    starts = first_lines(product.missing, sizes.pulses, lines_between(product, setup))
    return [
        _cut(product, int(first), sizes, elevation, reference, setup, imaging, geoid, unit)
        for first in starts
    ]


def lines_between(product: Product, setup: Setup) -> int:
    """The filter's interval.

    Parameters
    ----------
    product : Product
    setup : Setup

    Returns
    -------
    int
        Lines.
    """
    return round(setup.interval * product.prf)


def _sizes(product: Product, setup: Setup, imaging: Imaging) -> _Sizes:
    """For an image of full resolution at the middle of the swath."""
    spacing = c / (2 * product.sampling_rate)
    flight = flight_through(product, float(product.line_times[product.lines // 2]))
    chirp = int(np.ceil(product.pulse_length * product.sampling_rate))
    R = product.near_range + (product.samples - chirp) / 2 * spacing
    r, v = flight.position(0.0), flight.velocity(0.0)
    a = setup.orbit.acceleration(np.concatenate([r, v]))
    speed = effective_velocity(r, v, flight.ground_point(0.0, R, 0.0), a)
    bandwidth = min(imaging.bandwidth or product.prf, product.prf)
    lit = bandwidth * product.wavelength * R / (2 * speed**2)  # s
    half = int(np.ceil(lit / 2 * product.prf))
    migration = R / 2 * (product.wavelength * bandwidth / (4 * speed)) ** 2
    ranges = imaging.samples + chirp + int(np.ceil(migration / spacing)) + 1
    if ranges > product.samples:
        raise ValueError(
            f"product must have {ranges} samples in a line for patches of {imaging.samples}; "
            f"found {product.samples} in {product.image}"
        )
    column = (product.samples - ranges) // 2
    return _Sizes(bandwidth, imaging.lines + 2 * half, column, ranges)


def _cut(
    product: Product,
    first: int,
    sizes: _Sizes,
    elevation: str | Path,
    reference: str | Path,
    setup: Setup,
    imaging: Imaging,
    geoid: float,
    unit: str | None,
) -> Patch:
    last = first + sizes.pulses
    time = float(product.line_times[first + sizes.pulses // 2])
    spacing = c / (2 * product.sampling_rate)
    near = product.near_range + sizes.column * spacing
    R = near + imaging.samples // 2 * spacing
    flight = flight_through(product, time)
    scene = _ground(flight, R, elevation, imaging.half_width + MARGIN, geoid)
    centre = flight.ground_point(0.0, R, float(scene.height(0.0, 0.0)))
    across = imaging.samples * spacing / np.sin(view_of(flight, centre).incidence)
    along = imaging.lines / product.prf * np.linalg.norm(flight.velocity(0.0))
    shown = read_reference(
        reference,
        scene,
        half_width=imaging.half_width,
        pixel=imaging.pixel,
        needed=float(max(across, along)) / 2,
        unit=unit,
        matcher=imaging.matcher,
    )
    raw = Raw(
        _echoes(product, first, last, sizes),
        product.wavelength,
        product.sampling_rate,
        product.prf,
        product.pulse_length,
        product.chirp_rate,
        near,
        -(sizes.pulses // 2) / product.prf,
    )
    centroid = product.doppler_centroid(first, last)
    focuser = Focuser(
        raw,
        lines=imaging.lines,
        samples=imaging.samples,
        bandwidth=sizes.bandwidth,
        doppler_centroid=centroid,
    )
    acquired = Acquisition.of(flight, setup.orbit.acceleration, scene, focuser, shown)
    missing = int(product.missing[first:last].sum())
    return Patch(acquired, time, R, centroid, sizes.pulses, missing)


def _echoes(product: Product, first: int, last: int, sizes: _Sizes) -> Array:
    """The columns of a patch, (last - first, ranges); whole lines would need several times more."""
    samples = np.empty((last - first, sizes.ranges), np.complex64)
    for start in range(first, last, _BLOCK):
        stop = min(start + _BLOCK, last)
        read = product.read(start, stop)[:, sizes.column : sizes.column + sizes.ranges]
        samples[start - first : stop - first] = read
    return samples


def _ground(
    flight: Flight, slant_range: float, elevation: str | Path, half_width: float, geoid: float
) -> Scene:
    """The terrain about the point that is closest at time 0, at a range; its map's middle is it."""

    def place(height: float) -> LocalMap:
        latitude, longitude, _ = ecef_to_geodetic(flight.ground_point(0.0, slant_range, height))
        return LocalMap(float(latitude), float(longitude))

    height = median_height(elevation, place(0.0), half_width, geoid=geoid)
    for _ in range(2):  # the second time about what the first has found
        terrain = read_terrain(elevation, place(height), half_width, geoid=geoid)
        height = _height(place, terrain)
    none = np.zeros(0)
    return Scene(place(height), terrain, LandCover(np.ones((1, 1)), 1.0), Points(none, none, none))


def _height(place: Callable[[float], LocalMap], terrain: Terrain) -> float:
    """At which the place is on the terrain; one of them where the radar sees several at once."""

    def above(height: float) -> float:
        here = place(height)
        return height - float(terrain.height(here.latitude, here.longitude))

    low, high = float(terrain.posts.min()) - 100, float(terrain.posts.max()) + 100
    return float(brentq(above, low, high, xtol=1e-4))
