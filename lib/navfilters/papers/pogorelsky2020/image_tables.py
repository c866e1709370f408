"""Images over a lattice of assumed speeds, computed once."""

from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from navfilters.numerics import validation
from navfilters.papers.pogorelsky2020.acquisition import _locate, acquire
from navfilters.papers.pogorelsky2020.experiment import Setup, of_case
from navfilters.papers.pogorelsky2020.imaging import FULL, Acquisition, Imaging, same_images
from navfilters.sar.images.autofocusing import Climb, hill_climb, sharpness
from navfilters.types import Array


class ImageTable(NamedTuple):
    """What one image's raw data give at each assumed velocity.

    Parameters
    ----------
    speed, sharpness : array (n,)
        In-track velocity, m/s, and Eq. (3).
    matched : array (m,)
        In-track velocities at which the image was matched: wherever climbs can end, m/s.
    r_f : array (m, 3)
        Position of the centre pixel, m; NaN for no match.
    inliers : array (m,)
    slant_range : float
        Of the centre pixel, by the image, m.
    truth : array (3,)
        True position of the centre pixel, m.
    true_speed : float
        m/s.
    effective : array (3,)
        Effective velocity at the true speed, m/s, its derivative by the speed, and that of its
        square by the slant range, m/s^2.
    place : array (3,)
        Latitude, longitude and height of the centre, deg, deg, m.
    """

    speed: Array
    sharpness: Array
    matched: Array
    r_f: Array
    inliers: Array
    slant_range: float
    truth: Array
    true_speed: float
    effective: Array
    place: Array

    def climb(self, start: float, steps: Sequence[float], offset: float = 0.0) -> Climb:
        """Hill climb on the tabulated sharpness, by a cubic spline.

        Parameters
        ----------
        start : float
            m/s.
        steps : sequence of float
            m/s.
        offset : float
            What the run's geometry adds to the in-track velocity, m/s.

        Returns
        -------
        Climb
        """
        return self.climbs(np.array([start]), steps, np.array([offset]))[0]

    def climbs(self, starts: Array, steps: Sequence[float], offsets: Array) -> list[Climb]:
        """Many of them.

        Parameters
        ----------
        starts : array (n,)
            m/s.
        steps : sequence of float
            m/s.
        offsets : array (n,)
            m/s.

        Returns
        -------
        list of Climb
        """
        curve = CubicSpline(self.speed, self.sharpness)
        low, high = float(self.speed[0]), float(self.speed[-1])
        # all that climbs can ask if longer steps are multiples of the shortest, in one call
        shortest = min((step for step in steps if step > 0), default=1.0)
        most = np.ceil((high - low) / shortest)
        asked = starts[:, None] + shortest * np.arange(-most, most + 1)
        heights = curve(asked + offsets[:, None])

        def climb(start: float, offset: float, known: dict[float, float]) -> Climb:
            def height(speed: float) -> float:
                return known[speed] if speed in known else float(curve(speed + offset))

            return hill_climb(height, start, steps, (low - offset, high - offset))

        return [
            climb(float(start), float(offset), dict(zip(x.tolist(), y.tolist(), strict=True)))
            for start, offset, x, y in zip(starts, offsets, asked, heights, strict=True)
        ]


def image_table(
    acquired: Acquisition,
    imaging: Imaging = FULL,
    progress: Callable[[Iterable[Any]], Iterable[Any]] = iter,
) -> ImageTable:
    """Sharpness of one image at each assumed velocity, and its match wherever climbs can end.

    Parameters
    ----------
    acquired : Acquisition
    imaging : Imaging
    progress : callable
        Wraps the iterable of the ``len(assumed_speeds(imaging))`` velocities.

    Returns
    -------
    ImageTable
    """
    true = acquired.speed
    speed = true + assumed_speeds(imaging)
    sharp = np.empty(len(speed))
    for i in progress(range(len(speed))):
        velocity = acquired.effective(float(speed[i]))
        pixels = acquired.climber.image(velocity, acquired.slope).pixels
        sharp[i] = sharpness(pixels.real**2 + pixels.imag**2)
    effective = acquired.effective(true)
    derivative = (acquired.effective(true + 1) - acquired.effective(true - 1)) / 2
    scene = acquired.scene
    place = (scene.map.latitude, scene.map.longitude, float(scene.height(0.0, 0.0)))
    table = ImageTable(
        speed,
        sharp,
        np.zeros(0),
        np.zeros((0, 3)),
        np.zeros(0, int),
        acquired.focuser.centre_range,
        acquired.r_f,
        true,
        np.array([effective, derivative, acquired.slope]),
        np.array(place),
    )
    starts = np.arange(speed[0], speed[-1], 0.25)
    climbs = table.climbs(starts, imaging.steps, np.zeros(len(starts)))
    ends = np.array([climb.speed for climb in climbs])
    matched = np.unique(np.round(4 * (ends[np.isfinite(ends)] - true))) / 4 + true
    found = [_locate(acquired, float(s), imaging) for s in matched]
    return table._replace(
        matched=matched,
        r_f=np.array([match.r_f for match in found]).reshape(-1, 3),
        inliers=np.array([match.inliers for match in found], int),
    )


def assumed_speeds(imaging: Imaging) -> Array:
    """Velocities at which sharpness is tabulated, relative to the true one.

    Parameters
    ----------
    imaging : Imaging

    Returns
    -------
    array (n,)
        m/s, ascending.
    """
    inner = np.arange(-imaging.near, imaging.near + 0.5)
    outer = np.arange(imaging.near + 3.0, imaging.reach + 0.5, 3.0)
    return np.concatenate([-outer[::-1], inner, outer])


@lru_cache(maxsize=16)
def _tabulate(setup: Setup, k: int, imaging: Imaging) -> ImageTable:
    return image_table(acquire(setup, k, imaging), imaging)


def tabulate(setup: Setup | str = "TC-1", k: int = 1, imaging: Imaging = FULL) -> ImageTable:
    """Sharpness and match of one image at each assumed velocity: about a minute.

    Parameters
    ----------
    setup : Setup or {"TC-1", "TC-2"}
    k : int
        From 1.
    imaging : Imaging

    Returns
    -------
    ImageTable
        Computed once for all set-ups that have the same truth.
    """
    return _tabulate(same_images(of_case(setup)), validation.whole_number("k", k, 1), imaging)
