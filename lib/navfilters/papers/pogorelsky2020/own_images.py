"""Images of its own for each run of the closed loop: other hills, cover, speckle and noise."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Literal, NamedTuple

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
from navfilters.papers.pogorelsky2020.open_loop import MonteCarlo, monte_carlo
from navfilters.runs.consistency import mean_nees
from navfilters.runs.progress import bar
from navfilters.sar.raw.radar import PALSAR

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


def own_tables(
    runs: int, imaging: Imaging = WHOLE, *, progress: Callable = bar
) -> dict[str, list[list[ImageTable]]]:
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
    dict of list
        By criterion, then [k - 1][run].
    """
    validation.whole_number("runs", runs, 1)
    found: dict[str, list[list[ImageTable]]] = {"variance": [], "entropy": []}
    with progress(runs * UPDATES) as done:
        for k in range(1, UPDATES + 1):
            for of_k in found.values():
                of_k.append([])
            for run in range(runs):
                rng = np.random.default_rng([imaging.seed, k, run, 3])
                north, east = rng.uniform(-REACH, REACH, 2)
                own = replace(imaging, seed=1000 + run, moved=(float(north), float(east)))
                sighting = look_at(k, own, imaging.lines, imaging.samples)
                found["variance"][-1] += block_tables(*sighting, "variance")
                found["entropy"][-1] += block_tables(*sighting, "entropy")
                done(1)
    return found


def fly_own_images(
    case: str,
    tables: list[list[ImageTable]],
    runs: int,
    *,
    shared: bool = False,
    seed: int = 0,
    geometry: Literal["predicted", "nominal"] = "predicted",
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

    Returns
    -------
    MonteCarlo
    DifferentImages
        With its log.
    """
    setup = replace(CASES[case], walk=False)

    def table(k: int, i: int) -> ImageTable:
        return tables[k - 1][0 if shared else i % len(tables[k - 1])]

    images = DifferentImages(setup, range(runs), table, seed, WHOLE, geometry)
    return monte_carlo(setup, UPDATES, runs, seed, measure=images), images


def own_report(runs: int = 100, seed: int = 0, *, progress: Callable = bar) -> str:
    """Bias, spread and NEES after three images, of runs that share their images and of others.

    Parameters
    ----------
    runs : int
        At least 2.
    seed : int
    progress : callable
        As for ``own_tables``.

    Returns
    -------
    str
    """
    validation.whole_number("runs", runs, 2)
    tables = own_tables(runs, progress=progress)
    lines = [f"{'':28}{'NEES':>7}{'velocity, of predicted':>25}{'bias / s.e.':>13}{'failed':>8}"]
    for case in CASES:
        for name, of_name in tables.items():
            for shared in (True, False):
                flown, images = fly_own_images(case, of_name, runs, shared=shared, seed=seed)
                lines.append(_line(case, name, shared, flown, images))
    return "\n".join(lines)


def _line(case: str, name: str, shared: bool, flown: MonteCarlo, images: DifferentImages) -> str:
    errors, covariances = flown.errors[UPDATES], flown.covariances[UPDATES]
    kept = ~np.any([attempt.absent for attempt in images.log], axis=0)
    total = mean_nees(errors[kept], covariances[kept], runs_axis=0)
    deviation = partial(np.std, axis=0, ddof=1)
    predicted = np.sqrt(np.mean(covariances[kept], axis=0).diagonal())
    ratio = deviation(errors[kept]) / predicted
    bias = np.mean(errors[kept], axis=0) / deviation(errors[kept]) * np.sqrt(kept.sum())
    velocity = " ".join(f"{r:.2f}" for r in ratio[3:6])
    worst = float(np.abs(bias[:6]).max())
    which = "shared" if shared else "own"
    return (
        f"{case}, {name}, {which:8}".ljust(28)
        + f"{total.mean:7.1f}{velocity:>25}{worst:13.1f}{int((~kept).sum()):8}"
    )
