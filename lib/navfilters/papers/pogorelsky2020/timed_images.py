"""Simulated images whose lines are timed, with errors of the clock and of the pointing."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from navfilters.papers.pogorelsky2020.experiment import Setup
from navfilters.papers.pogorelsky2020.open_loop import SimulatedImages, simulate_images
from navfilters.papers.pogorelsky2020.true_flight import Truth
from navfilters.space.navigation_state import NavigationState
from navfilters.space.quaternions import from_rotation_vector, product
from navfilters.space.zero_doppler import TimedMeasurement
from navfilters.types import Array


def sweep_speed(setup: Setup, flight: Truth) -> Array:
    """How fast the plane of zero Doppler passes a point in it, at each time of the flight.

    d/dt of -(r_f - r) . v / norm(v) in Earth-fixed axes, (v^2 - (r_f - r) . a) / norm(v): it turns
    the time of a line into metres.

    Parameters
    ----------
    setup : Setup
    flight : Truth

    Returns
    -------
    array (k + 1,)
        m/s.
    """
    images = simulate_images(replace(setup, walk=False), 1, flight=flight)
    d = np.concatenate([images.centre(k) for k in range(len(flight.times))]) - flight.x[:, :3]
    v, a = flight.x[:, 3:], setup.orbit.acceleration(flight.x)
    return (np.sum(v * v, axis=-1) - np.sum(d * a, axis=-1)) / np.linalg.norm(v, axis=-1)


@dataclass(frozen=True, eq=False)
class TimedImages:
    """Simulated images with the azimuth of their centre pixel, with or without the antenna.

    Parameters
    ----------
    images : SimulatedImages
    azimuth_error : array (runs, k)
        Of each image, m: by how much later it was taken than its time says, times ``sweep_speed``.
    range_error : float or array (runs,)
        By how much all distances of a run are measured too long, m.
    antenna, plane : bool or bool array (runs,)
        Whether the two ratios are measured, and whether the azimuth is.
    """

    images: SimulatedImages
    azimuth_error: Array
    range_error: Array = 0.0
    antenna: Array = False
    plane: Array = True

    def __call__(self, k: int, state: NavigationState) -> TimedMeasurement:
        """The image after interval k, from 1; it does not depend on the state.

        Parameters
        ----------
        k : int
        state : NavigationState

        Returns
        -------
        TimedMeasurement
        """
        images = self.images
        seen, (r, v) = images(k, state), np.split(images.flight.x[k], 2)
        ahead = (images.centre(k) - r) @ v / np.linalg.norm(v) - self.azimuth_error[:, k - 1]
        ratio = np.where(self.antenna, 0.0, np.nan) + 0 * ahead
        return TimedMeasurement(
            seen.r_f,
            seen.slant_range + self.range_error,
            seen.speed,
            np.where(self.plane, ahead, np.nan),
            np.stack([ratio, ratio], axis=-1),
        )


def white_errors(runs: int | Sequence[int], intervals: int, width: int, seed: int) -> Array:
    """Unit normal numbers of the errors that the paper leaves out, (runs, intervals, width).

    Parameters
    ----------
    runs : int or sequence of int
        How many, or which, as for ``noise``; their streams are others than those of ``noise``.
    intervals, width, seed : int

    Returns
    -------
    array (runs, intervals, width)
    """
    which = range(runs) if isinstance(runs, int) else runs
    streams = (np.random.default_rng([1, i, seed]) for i in which)
    return np.stack([stream.standard_normal((intervals, width)) for stream in streams])


def with_pointing_noise(images: SimulatedImages, arcseconds: Array) -> SimulatedImages:
    """The same images by a body whose attitude has white errors of which no filter is told.

    Parameters
    ----------
    images : SimulatedImages
    arcseconds : array (runs, k, 3)
        Rotation about the antenna's axes at each image.

    Returns
    -------
    SimulatedImages
        Its true misalignment includes the errors.
    """
    q = images.q_mu.copy()
    q[:, 1:] = product(from_rotation_vector(np.deg2rad(arcseconds / 3600)), q[:, 1:])
    return replace(images, q_mu=q)
