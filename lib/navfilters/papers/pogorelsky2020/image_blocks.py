"""One large image cut into blocks: as many small ones, of different ground."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np

from navfilters.numerics import validation
from navfilters.papers.pogorelsky2020.image_tables import ImageTable
from navfilters.papers.pogorelsky2020.imaging import Acquisition, Imaging
from navfilters.sar.images.autofocusing import sharpness
from navfilters.sar.images.focus_criteria import image_entropy
from navfilters.sar.images.ground_image import GroundImage, to_ground
from navfilters.sar.images.map_drift import drift_to_velocity, look_drift
from navfilters.sar.images.slant_image import Image, effective_velocity
from navfilters.sar.matching.geolocation import geolocate
from navfilters.sar.matching.reference import Reference
from navfilters.sar.raw.flight import Flight, view_of
from navfilters.space.frames import ecef_to_geodetic
from navfilters.types import Array


def cut_blocks(image: Image, lines: int, samples: int) -> list[Image]:
    """The blocks of an image, line by line; what is left over at the far ends is cut off.

    Parameters
    ----------
    image : Image
    lines, samples : int
        Of a block.

    Returns
    -------
    list of Image

    Raises
    ------
    ValueError
        A block that is larger than the image.
    """
    rows, columns = image.pixels.shape
    for name, value, most in (("lines", lines, rows), ("samples", samples, columns)):
        if validation.whole_number(name, value, 16) > most:
            raise ValueError(f"{name} must be at most {most} for this image; found {value}")
    return [
        image._replace(
            pixels=image.pixels[i : i + lines, j : j + samples],
            first_time=image.first_time + i / image.prf,
            near_range=image.near_range + j * image.range_spacing,
        )
        for i in range(0, rows - lines + 1, lines)
        for j in range(0, columns - samples + 1, samples)
    ]


FADE = 32
"""Lines at a block's ends over which it fades: or else what moves across an end, out of focus,
weighs in the entropy as much as what loses its focus."""


class BlockCurves(NamedTuple):
    """What three autofocuses see of each block at each assumed velocity.

    Parameters
    ----------
    offset : array (n,)
        Assumed minus true in-track velocity, m/s.
    variance : array (n, b)
        The paper's sharpness, Eq. (3).
    entropy : array (n, b)
    drift : array (n, b)
        By how much the velocity is too fast according to map drift, m/s in-track.
    """

    offset: Array
    variance: Array
    entropy: Array
    drift: Array


def block_curves(
    acquired: Acquisition,
    offset: Array,
    lines: int,
    samples: int,
    progress: Callable[[Iterable[Any]], Iterable[Any]] = iter,
) -> BlockCurves:
    """Focus at each velocity once, and look at each block, which fades towards its ends.

    Parameters
    ----------
    acquired : Acquisition
    offset : array (n,)
        m/s.
    lines, samples : int
        Of a block.
    progress : callable
        Wraps the iterable of velocities.

    Returns
    -------
    BlockCurves
    """
    gain = acquired.effective(acquired.speed + 0.5) - acquired.effective(acquired.speed - 0.5)
    inwards = np.minimum(np.arange(lines), np.arange(lines)[::-1]) + 0.5
    window = np.sin(np.pi / 2 * np.minimum(inwards / FADE, 1.0)).astype(np.float32) ** 2
    rows = list[list[tuple[float, float, float]]]()
    for each in progress(offset):
        velocity = acquired.effective(acquired.speed + float(each))
        row = list[tuple[float, float, float]]()
        for sharp in cut_blocks(acquired.focuser.image(velocity, acquired.slope), lines, samples):
            block = sharp._replace(pixels=sharp.pixels * window[:, None])
            intensity = block.pixels.real**2 + block.pixels.imag**2
            error = drift_to_velocity(
                look_drift(block), velocity, block.centre_range, acquired.focuser.wavelength
            )
            row.append((sharpness(intensity), image_entropy(intensity), error / gain))
        rows.append(row)
    return BlockCurves(np.asarray(offset), *np.moveaxis(np.array(rows), -1, 0))


@dataclass(frozen=True, eq=False)
class BlockPlace:
    """Where the centre pixel of a block is in truth, and how it is seen.

    Parameters
    ----------
    r_f : array (3,)
        Earth-fixed, m.
    incidence, ground_speed : float
        rad, m/s: see ``to_ground``.
    """

    r_f: Array
    incidence: float
    ground_speed: float

    @classmethod
    def of(cls, acquired: Acquisition, whole: Image, block: Image) -> "BlockPlace":
        """The point of the terrain at the block's zero-Doppler time and range.

        Parameters
        ----------
        acquired : Acquisition
        whole, block : Image

        Returns
        -------
        BlockPlace
        """
        flight = _flight(acquired)
        lines = block.pixels.shape[0] // 2 - whole.pixels.shape[0] // 2
        t = block.first_time - whole.first_time + lines / block.prf
        height = float(acquired.scene.height(0.0, 0.0))
        for _ in range(20):  # converges where no slope is laid over
            r_f = flight.ground_point(t, block.centre_range, height)
            place = acquired.scene.map.position(*ecef_to_geodetic(r_f)[:2])
            last, height = height, float(acquired.scene.height(*place))
            if abs(height - last) < 1e-6:
                break
        r, v = flight.position(t), flight.velocity(t)
        a = acquired.acceleration(np.concatenate([r, v]))
        speed = float(effective_velocity(r, v, r_f, a) ** 2 / np.linalg.norm(v))
        return cls(r_f, view_of(flight, r_f).incidence, speed)


@lru_cache(maxsize=3)
def _flight(acquired: Acquisition) -> Flight:
    """Through where the centre pixel was closest."""

    def derivative(x: Array) -> Array:
        return np.concatenate([x[..., 3:], acquired.acceleration(x)], axis=-1)

    return Flight.through(derivative, np.concatenate([acquired.r, acquired.v]), 2.0)


class BlockMatches(NamedTuple):
    """Where blocks were found.

    Parameters
    ----------
    error : array (b, 3)
        Of the centre pixel's position, Earth-fixed, m; NaN for no match.
    inliers : array (b,) of int
    """

    error: Array
    inliers: Array


def match_blocks(
    acquired: Acquisition,
    imaging: Imaging,
    lines: int,
    samples: int,
    *,
    reference: Reference | None = None,
    offset: float = 0.0,
) -> BlockMatches:
    """Match each block with the reference map, and compare with the truth.

    Parameters
    ----------
    acquired : Acquisition
    imaging : Imaging
    lines, samples : int
        Of a block.
    reference : Reference, optional
        What the onboard computer has: that of the acquisition by default, or one that is wrong.
    offset : float
        Assumed minus true in-track velocity, m/s.

    Returns
    -------
    BlockMatches
    """
    known = acquired.reference if reference is None else reference
    errors, inliers = list[Array](), list[int]()
    for place, ground in _grounds(acquired, imaging, lines, samples, offset):
        match = geolocate(ground, known, relief=imaging.relief)
        errors.append(match.r_f - place.r_f)
        inliers.append(match.inliers)
    return BlockMatches(np.array(errors), np.array(inliers))


@lru_cache(maxsize=3)
def _grounds(
    acquired: Acquisition, imaging: Imaging, lines: int, samples: int, offset: float
) -> list[tuple[BlockPlace, GroundImage]]:
    """Blocks on the ground, once for all references that they are matched with."""
    image = acquired.focuser.image(acquired.effective(acquired.speed + offset), acquired.slope)
    found = list[tuple[BlockPlace, GroundImage]]()
    for block in cut_blocks(image, lines, samples):
        place = BlockPlace.of(acquired, image, block)
        ground = to_ground(
            block,
            incidence=place.incidence,
            ground_speed=place.ground_speed,
            looks=imaging.looks,
            pixel=imaging.pixel,
        )
        found.append((place, ground))
    return found


def block_tables(
    acquired: Acquisition,
    curves: BlockCurves,
    matches: BlockMatches,
    criterion: Literal["variance", "entropy"] = "variance",
) -> list[ImageTable]:
    """Each block as an image of the boresight's ground: its own curve, its own error of the pixel.

    Parameters
    ----------
    acquired : Acquisition
    curves : BlockCurves
    matches : BlockMatches
    criterion : {"variance", "entropy"}
        On which runs climb.

    Returns
    -------
    list of ImageTable
        Matched at one velocity: that of the matches.
    """
    height = curves.variance if criterion == "variance" else -curves.entropy
    true = acquired.speed
    effective = acquired.effective(true)
    gain = acquired.effective(true + 0.5) - acquired.effective(true - 0.5)
    seen = acquired.scene.map
    place = (seen.latitude, seen.longitude, float(acquired.scene.height(0.0, 0.0)))
    return [
        ImageTable(
            true + curves.offset,
            height[:, b],
            np.array([true]),
            acquired.r_f + matches.error[None, b],
            matches.inliers[None, b],
            float(np.linalg.norm(acquired.r_f - acquired.r)),
            acquired.r_f,
            true,
            np.array([effective, gain, acquired.slope]),
            np.array(place),
        )
        for b in range(height.shape[1])
    ]
