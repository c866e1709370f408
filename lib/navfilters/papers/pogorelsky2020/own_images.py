"""Images of its own for each run of the closed loop: other hills, cover, speckle and noise."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np

from navfilters.numerics import validation
from navfilters.papers.pogorelsky2020.acquisition import acquire
from navfilters.papers.pogorelsky2020.closed_loop import UPDATES
from navfilters.papers.pogorelsky2020.different_images import DifferentImages
from navfilters.papers.pogorelsky2020.experiment import CASES
from navfilters.papers.pogorelsky2020.image_blocks import (
    BlockCurves,
    BlockMatches,
    block_curves,
    block_tables,
    match_blocks,
)
from navfilters.papers.pogorelsky2020.image_tables import ImageTable
from navfilters.papers.pogorelsky2020.imaging import Acquisition, Imaging, same_images
from navfilters.papers.pogorelsky2020.linearised import Altered, Seen
from navfilters.papers.pogorelsky2020.open_loop import MonteCarlo, monte_carlo
from navfilters.papers.pogorelsky2020.pixel_errors import (
    image_axes,
    pixel_covariance,
    terrain_normal,
)
from navfilters.papers.pogorelsky2020.true_flight import truth
from navfilters.runs.consistency import mean_nees
from navfilters.runs.progress import bar
from navfilters.sar.raw.radar import PALSAR
from navfilters.space.frames import ecef_to_geodetic
from navfilters.types import Array

SHORT_PULSE = replace(PALSAR, pulse_length=4e-6)
"""PALSAR with a seventh of its pulse, at the same noise: the same images, of less raw data."""

OFFSETS = np.r_[-32:-7:6.0, -4.0, -3.0, -2.0:2.5:0.5, 3.0, 4.0, 8:33:6.0]
"""Assumed minus true velocity at which an image is looked at, m/s: closest where
peaks are."""

REACH = 0.06
"""By which terrain is moved at most, either way, deg; the tile has 0.14."""

WHOLE = Imaging(radar=SHORT_PULSE, lines=1024, samples=512, half_width=2288.0)
"""Of the command: a quarter of the library's size of an image."""


class Sighting(NamedTuple):
    """One image, looked at: what a loop needs of it.

    Parameters
    ----------
    acquired : Acquisition
    curves : BlockCurves
    matches : BlockMatches
    """

    acquired: Acquisition
    curves: BlockCurves
    matches: BlockMatches


def look_at(
    k: int, imaging: Imaging, lines: int, samples: int, offset: np.ndarray = OFFSETS
) -> Sighting:
    """Simulate an image, focus it at each velocity, and match it block by block.

    Parameters
    ----------
    k : int
        From 1.
    imaging : Imaging
    lines, samples : int
        Of a block.
    offset : array (n,)
        Assumed minus true velocity, m/s.

    Returns
    -------
    Sighting
    """
    acquired = acquire(same_images(CASES["TC-1"]), k, imaging)
    curves = block_curves(acquired, offset, lines, samples)
    return Sighting(acquired, curves, match_blocks(acquired, imaging, lines, samples))


class OwnImages(NamedTuple):
    """Sets of three images that share nothing.

    Parameters
    ----------
    variance, entropy : list of list of ImageTable
        By the criterion on which runs climb: [k - 1][set].
    normal : array (UPDATES, sets, 3)
        Of the ground where the images were matched, by the map on board.
    """

    variance: list[list[ImageTable]]
    entropy: list[list[ImageTable]]
    normal: Array

    @property
    def errors(self) -> Array:
        """Of the matched pixels, Earth-fixed, (UPDATES, sets, 3), m."""
        return np.array([[t.r_f[0] - t.truth for t in of_k] for of_k in self.variance])

    @property
    def axes(self) -> Array:
        """``image_axes`` of each image where it was matched, (UPDATES, sets, 3, 3)."""
        x = truth(CASES["TC-1"], UPDATES).x[1:, None]
        r_f = np.array([[t.r_f[0] for t in of_k] for of_k in self.variance])
        return image_axes(r_f, x[..., :3], x[..., 3:], self.normal)


def own_tables(
    runs: int, imaging: Imaging = WHOLE, *, progress: Callable[..., Any] = bar
) -> OwnImages:
    """Three images for each run.

    Parameters
    ----------
    runs : int
    imaging : Imaging
        Of which each image has a seed and a place of the tile of its own.
    progress : callable
        Given the number of images, a context whose value is told what is done.

    Returns
    -------
    OwnImages
    """
    validation.whole_number("runs", runs, 1)
    variance: list[list[ImageTable]] = [[] for _ in range(UPDATES)]
    entropy: list[list[ImageTable]] = [[] for _ in range(UPDATES)]
    normal: list[list[Array]] = [[] for _ in range(UPDATES)]
    with progress(runs * UPDATES) as done:
        for k in range(1, UPDATES + 1):
            for run in range(runs):
                rng = np.random.default_rng([imaging.seed, k, run, 3])
                north, east = rng.uniform(-REACH, REACH, 2)
                own = replace(imaging, seed=1000 + run, moved=(float(north), float(east)))
                sighting = look_at(k, own, imaging.lines, imaging.samples)
                (by_variance,) = block_tables(*sighting, "variance")
                variance[k - 1].append(by_variance)
                entropy[k - 1] += block_tables(*sighting, "entropy")
                latitude, longitude, _ = (float(a) for a in ecef_to_geodetic(by_variance.r_f[0]))
                terrain = sighting.acquired.scene.terrain
                normal[k - 1].append(terrain_normal(terrain, latitude, longitude))
                done(1)
    return OwnImages(variance, entropy, np.array(normal))


def fly_own_images(
    case: str,
    tables: list[list[ImageTable]],
    runs: int,
    *,
    shared: bool = False,
    seed: int = 0,
    geometry: Literal["predicted", "nominal"] = "predicted",
    D: Array | None = None,
) -> tuple[MonteCarlo, DifferentImages]:
    """One case in closed loop.

    Parameters
    ----------
    case : {"TC-1", "TC-2"}
    tables : list of list of ImageTable
        [k - 1][set of images]; run i has set i, and again from the first.
    runs : int
    shared : bool
        Whether all runs have the first set.
    seed : int
    geometry : {"predicted", "nominal"}
        See ``Images``.
    D : array (3, 3) or (UPDATES, sets, 3, 3), optional
        What the filter is told of the pixels' errors, Earth-fixed, m^2; the set-up's by default.

    Returns
    -------
    MonteCarlo
    DifferentImages
        With its log.
    """
    setup = replace(CASES[case], walk=False)
    which = np.arange(runs) * (not shared) % len(tables[0])

    def table(k: int, i: int) -> ImageTable:
        return tables[k - 1][which[i]]

    images = DifferentImages(setup, range(runs), table, seed, WHOLE, geometry)
    told = None
    if D is not None:
        known = np.broadcast_to(D, (UPDATES, len(tables[0]), 3, 3))[:, which]
        told = Altered(setup.mekf, partial(_told, known))
    return monte_carlo(setup, UPDATES, runs, seed, measure=images, estimator=told), images


def _told(D: Array, seen: Seen) -> tuple[Array, Array, Array]:
    """The image with another covariance of its pixel."""
    y, H, _ = seen.linearise()
    H_f = seen.geometry.pixel_jacobian(seen.state, seen.image.r_f)
    known = D[min(seen.k, UPDATES) - 1]  # after the last image nothing is measured
    return y, H, seen.geometry.R + H_f @ known @ H_f.mT


def measured_sigma(found: OwnImages) -> Array:
    """Root mean square of the pixels' errors in the image: what ``pixel_covariance`` asks for.

    Parameters
    ----------
    found : OwnImages

    Returns
    -------
    array (3,)
        Along the line of sight, along the flight and off the ground, m.
    """
    parts = np.einsum("...ij,...j->...i", found.axes, found.errors)
    return np.sqrt(np.nanmean(parts**2, axis=(0, 1)))


def own_report(found: OwnImages, runs: int = 100, seed: int = 0) -> str:
    """Bias, spread and NEES after three images, of runs that share their images and of others.

    Parameters
    ----------
    found : OwnImages
    runs : int
        At least 2; run i has set i, and again from the first.
    seed : int

    Returns
    -------
    str
        With the paper's D, and of each run's own images also with that of its ground.
    """
    validation.whole_number("runs", runs, 2)
    by_slope = pixel_covariance(found.axes, measured_sigma(found))
    lines = [f"{'':28}{'NEES':>7}{'velocity, of predicted':>25}{'bias / s.e.':>13}{'failed':>8}"]
    for case in CASES:
        for name in ("variance", "entropy"):
            for which, options in (
                ("shared", {"shared": True}),
                ("own", {}),
                ("own, D", {"D": by_slope}),
            ):
                flown = fly_own_images(case, getattr(found, name), runs, seed=seed, **options)
                lines.append(_line(case, name, which, *flown))
    return "\n".join(lines)


def _line(case: str, name: str, which: str, flown: MonteCarlo, images: DifferentImages) -> str:
    errors, covariances = flown.errors[UPDATES], flown.covariances[UPDATES]
    kept = ~np.any([attempt.absent for attempt in images.log], axis=0)
    total = mean_nees(errors[kept], covariances[kept], runs_axis=0)
    deviation = partial(np.std, axis=0, ddof=1)
    predicted = np.sqrt(np.mean(covariances[kept], axis=0).diagonal())
    ratio = deviation(errors[kept]) / predicted
    bias = np.mean(errors[kept], axis=0) / deviation(errors[kept]) * np.sqrt(kept.sum())
    velocity = " ".join(f"{r:.2f}" for r in ratio[3:6])
    worst = float(np.abs(bias[:6]).max())
    return (
        f"{case}, {name}, {which:8}".ljust(28)
        + f"{total.mean:7.1f}{velocity:>25}{worst:13.1f}{int((~kept).sum()):8}"
    )
