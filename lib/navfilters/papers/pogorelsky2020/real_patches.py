"""Patches of a PALSAR product for the closed loop."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.constants import c
from scipy.optimize import brentq

from navfilters.papers.pogorelsky2020.experiment import Setup
from navfilters.papers.pogorelsky2020.imaging import FULL, Acquisition, Imaging
from navfilters.papers.pogorelsky2020.real_flight import (
    first_lines,
    fitted,
    flight_through,
    lines_between,
)
from navfilters.sar.ground.land_cover import LandCover
from navfilters.sar.ground.scene import Points, Scene
from navfilters.sar.ground.terrain import LocalMap, Terrain
from navfilters.sar.images.focuser import Focuser
from navfilters.sar.images.slant_image import effective_velocity
from navfilters.sar.palsar.geotiff_reader import median_height, read_reference, read_terrain
from navfilters.sar.palsar.product import Product
from navfilters.sar.raw.flight import Flight, view_of
from navfilters.sar.raw.radar import Raw
from navfilters.space.frames import body_axes, ecef_to_geodetic
from navfilters.types import Array

MARGIN = 1000.0
"""Elevations are read so far beyond the reference image, m."""

_BLOCK = 256  # lines that are read at once, of all columns


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
        GeoTIFF files: see ``navfilters.sar.palsar.geotiff_reader``.
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
            f"found {product.samples} in {product.name}"
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
