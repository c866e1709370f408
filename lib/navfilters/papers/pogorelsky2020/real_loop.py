"""The closed loop on a PALSAR product."""

import datetime
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from navfilters.papers.pogorelsky2020.closed_loop import UPDATES
from navfilters.papers.pogorelsky2020.experiment import Setup, of_case
from navfilters.papers.pogorelsky2020.imaging import FULL, Imaging
from navfilters.papers.pogorelsky2020.noise_draws import noise
from navfilters.papers.pogorelsky2020.open_loop import MonteCarlo, monte_carlo
from navfilters.papers.pogorelsky2020.real_flight import fitted, flight_through, lines_between
from navfilters.papers.pogorelsky2020.real_images import RealAttempt as Attempt
from navfilters.papers.pogorelsky2020.real_images import RealImages
from navfilters.papers.pogorelsky2020.real_patches import Patch, cut_patches
from navfilters.papers.pogorelsky2020.true_flight import Truth
from navfilters.sar.palsar.frames import open_frames
from navfilters.sar.palsar.product import Product
from navfilters.space.frames import antenna_axes, body_axes


def true_flight(product: Product, patches: Sequence[Patch], setup: Setup) -> Truth:
    """The state vectors' flight, one interval before the first patch and at each.

    Parameters
    ----------
    product : Product
    patches : sequence of Patch
    setup : Setup
        Of the filter.

    Returns
    -------
    Truth
        Its attitudes are those of a body that turns such that the filter's one look angle, with no
        squint, sees the middle of each patch.
    """
    times = np.array([patches[0].time - setup.interval, *(patch.time for patch in patches)])
    flights = [flight_through(product, float(t)) for t in times]
    x = np.stack([np.concatenate([f.position(0.0), f.velocity(0.0)]) for f in flights])
    axes = body_axes(x[:, :3], x[:, 3:])
    to_body = setup.geometry.T_b_s.T
    seen = [to_body @ antenna_axes(*patch.pointing) for patch in patches]
    return Truth(times - times[0], x, np.stack([np.eye(3), *seen]) @ axes)


class Outcome(NamedTuple):
    """What the runs gave.

    Parameters
    ----------
    result : MonteCarlo
        The truth has no misalignment.
    attempts : list of Attempt
        By image, then by run.
    """

    result: MonteCarlo
    attempts: list[Attempt]


def run_filter(
    product: Product,
    patches: Sequence[Patch],
    setup: Setup = Setup(),
    runs: int = 1,
    seed: int = 0,
    *,
    imaging: Imaging = FULL,
    progress: Callable[[Iterable[Any]], Iterable[Any]] = iter,
) -> Outcome:
    """The filter from its first estimate, one interval before the first patch, through all patches.

    Parameters
    ----------
    product : Product
    patches : sequence of Patch
        Of ``cut_patches``.
    setup : Setup
        The same.
    runs : int
        Each has a first estimate and range errors of its own: see ``noise``.
    seed : int
    imaging : Imaging
        The same.
    progress : callable
        Wraps the iterable of images.

    Returns
    -------
    Outcome
    """
    ground = patches[0].acquired.scene.map
    setup = replace(
        setup,
        interval=lines_between(product, setup) / product.prf,
        target=(ground.latitude, ground.longitude),  # for the axes of the pixel's covariance
        walk=False,
    )
    errors = setup.sigma_range * noise(runs, len(patches), seed).slant_range
    images = RealImages(patches, errors, fitted(imaging, product))
    flight = true_flight(product, patches, setup)
    result = monte_carlo(
        setup, len(patches), runs, seed, flight=flight, measure=images, progress=progress
    )
    return Outcome(result, images.log)


def real_table(product: Product, patches: Sequence[Patch], outcome: Outcome) -> str:
    """Each image of each run, and the position before and after.

    Parameters
    ----------
    product : Product
    patches : sequence of Patch
    outcome : Outcome

    Returns
    -------
    str
        Of each image the error of its centre's position, that of the in-track velocity, and the
        inliers or why there is no measurement; then by axis the root mean square over the runs of
        the position's error, and what the filter believed of it.
    """
    fewer = ": its lines hold no more, longer strips do" if len(patches) < UPDATES else ""
    lines = [
        f"{product.name}, {product.day}, {len(patches)} of {UPDATES} patches{fewer}",
        f"{'image':>5}{'time (UTC)':>15}{'Doppler':>11}{'missing lines':>18}",
    ]
    for k, patch in enumerate(patches, start=1):
        time = datetime.datetime.min + datetime.timedelta(seconds=round(patch.time % 86400, 3))
        lost = f"{patch.missing} of {patch.pulses}"
        lines.append(
            f"{k:5}{time.time().isoformat('milliseconds'):>15}"
            f"{patch.doppler_centroid:8.1f} Hz{lost:>18}"
        )
    lines.append(
        f"\n{'run':>3}{'image':>7}{'latitude':>12}{'longitude':>12}{'error':>10}{'speed':>12}"
        f"{'inliers':>9}"
    )
    for attempt in sorted(outcome.attempts):
        lines.append(f"{attempt.run + 1:3}{attempt.k:7}{_found(attempt, patches)}")
    errors, sigma = outcome.result.errors[..., :3], outcome.result.covariances
    deviation = np.sqrt(np.diagonal(sigma[..., :3, :3], axis1=-2, axis2=-1))
    before, after = (
        np.sqrt(np.mean(np.square([errors[i], deviation[i]]), axis=1)) for i in (0, -1)
    )
    lines.append(f"\n{'':6}{'before':>12}{'1-sigma':>10}{'after':>12}{'1-sigma':>10}")
    for i, axis in enumerate("xyz"):
        lines.append(
            f"{axis} (m) {before[0, i]:12.1f}{before[1, i]:10.1f}"
            f"{after[0, i]:12.1f}{after[1, i]:10.1f}"
        )
    return "\n".join(lines)


def _found(attempt: Attempt, patches: Sequence[Patch]) -> str:
    """The end of an image's line: where it was found, or why it was not."""
    acquired, match = patches[attempt.k - 1].acquired, attempt.match
    if match is None:
        return f"  no image: the climb ended at a {attempt.climb.ended}"
    if not attempt.matched:
        return f"  no match: {match.inliers} inliers"
    error = np.linalg.norm(match.r_f - acquired.r_f)
    speed = attempt.climb.speed - acquired.speed
    return (
        f"{match.latitude:12.5f}{match.longitude:12.5f}{error:8.1f} m{speed:8.2f} m/s"
        f"{match.inliers:9}"
    )


def report(
    folders: str | Path | Sequence[str | Path],
    elevation: str | Path,
    reference: str | Path,
    case: Setup | str = "TC-1",
    runs: int = 1,
    seed: int = 0,
    *,
    geoid: float = 0.0,
    unit: str | None = None,
    imaging: Imaging = FULL,
    progress: Callable[[Iterable[Any]], Iterable[Any]] = iter,
    **options: Any,
) -> str:
    """The closed loop on files, from opening them to the table.

    Parameters
    ----------
    folders : str or Path, or sequence of them
        Of the product, or of the frames that are joined.
    elevation, reference : str or Path
        GeoTIFF files.
    case : {"TC-1", "TC-2"} or Setup
    runs, seed : int
        See ``run_filter``.
    geoid : float
        See ``read_terrain``.
    unit : {"dB", "linear"}, optional
        Of the reference: see ``read_reference``.
    imaging : Imaging
    progress : callable
        Wraps the iterable of images.
    **options
        To ``navfilters.sar.palsar.frames.open_frames``.

    Returns
    -------
    str

    Raises
    ------
    ValueError, OSError, ImportError
        As ``open_frames`` and ``cut_patches``.
    """
    setup, product = of_case(case), open_frames(folders, **options)
    patches = cut_patches(
        product, elevation, reference, setup=setup, imaging=imaging, geoid=geoid, unit=unit
    )
    outcome = run_filter(product, patches, setup, runs, seed, imaging=imaging, progress=progress)
    return real_table(product, patches, outcome)
