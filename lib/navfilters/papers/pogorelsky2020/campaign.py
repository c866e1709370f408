"""The closed-loop campaign of Pogorelsky et al.: all runs of both cases."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from navfilters.numerics import validation
from navfilters.papers.pogorelsky2020.acquisition import acquire, measure_directly
from navfilters.papers.pogorelsky2020.campaign_store import Folder, Formed
from navfilters.papers.pogorelsky2020.closed_loop import UPDATES, Images, summary
from navfilters.papers.pogorelsky2020.experiment import CASES
from navfilters.papers.pogorelsky2020.image_tables import ImageTable, assumed_speeds, image_table
from navfilters.papers.pogorelsky2020.imaging import FULL, Acquisition, Imaging, same_images
from navfilters.papers.pogorelsky2020.open_loop import MonteCarlo, monte_carlo
from navfilters.runs import stored_arrays
from navfilters.runs.locked_folder import alone_in
from navfilters.runs.progress import bar
from navfilters.space.image_measurement import Measurement
from navfilters.space.navigation_state import NavigationState

ACQUIRING, CLIMBING = 40, 14
"""What the raw data of an image and a climb with its match cost, in images: for the time left."""


class Agreement(NamedTuple):
    """How far runs that formed their images themselves are from those with tables.

    Parameters
    ----------
    images : int
        How many were compared.
    otherwise : int
        How many of them were measured by one and failed for the other.
    speed, pixel : float
        Largest distance of the measured velocity, m/s, and of the centre pixel, m.
    deviations : float
        Largest distance of the state after the images, in the filter's own deviations.
    """

    images: int
    otherwise: int
    speed: float
    pixel: float
    deviations: float


class Campaign(NamedTuple):
    """What a campaign found.

    Parameters
    ----------
    images : list of ImageTable
    closed, opened : dict of MonteCarlo
        By test case.
    agreement : Agreement or None
        None without direct runs.
    """

    images: list[ImageTable]
    closed: dict[str, MonteCarlo]
    opened: dict[str, MonteCarlo]
    agreement: Agreement | None


def run_campaign(
    folder: str | Path,
    runs: int = 100,
    direct: int = 10,
    seed: int = 0,
    *,
    imaging: Imaging = FULL,
    progress: Callable[..., Any] = bar,
) -> Campaign:
    """Both test cases in closed loop, 100 runs of three images each by default.

    Parameters
    ----------
    folder : path
        Made if it does not exist.
    runs : int
        Of each case, at least 2.
    direct : int
        How many of TC-1's runs are made again without tables.
    seed : int
        Of the runs.
    imaging : Imaging
    progress : callable
        Given the amount of work, a context whose value is told what is done.

    Returns
    -------
    Campaign
        Also stored: ``image-1.npz`` to ``image-3.npz``, ``TC-1.npz``, ``TC-2.npz``, a file for
        each image of each direct run, and ``summary.txt``.

    Raises
    ------
    ValueError
        Bad counts; a stored file that is damaged, or that other arguments made.
    OSError
        A folder that cannot be written, or in which another process is at work (BlockingIOError).

    References
    ----------
    pogorelsky2020, section "Closed-loop trajectory and SAR data", Figs. 8 and 10.
    """
    validation.whole_number("runs", runs, 2)
    if validation.whole_number("direct", direct, 0) > runs:
        raise ValueError(f"direct must be at most runs, {runs}; found {direct}")
    store = Folder(Path(folder), imaging, validation.whole_number("seed", seed, 0))
    with alone_in(store.path):
        return _run(store, runs, direct, progress)


def _run(store: Folder, runs: int, direct: int, progress: Callable[..., Any]) -> Campaign:
    seed, imaging = store.seed, store.imaging
    with progress(_work(store, direct)) as done:
        tables = [_table(store, k, done) for k in range(1, UPDATES + 1)]
        lookup = lambda setup, k, imaging: tables[k - 1]  # noqa: E731
        setups = {case: replace(CASES[case], walk=False) for case in CASES}
        logs, closed = {}, {}
        for case, setup in setups.items():
            images = Images(setup, runs, seed, imaging, tables=lookup)
            closed[case] = monte_carlo(setup, UPDATES, runs, seed, measure=images)
            if store.load(case, MonteCarlo, setup, runs, seed) is None:
                store.save(case, closed[case], setup, runs, seed)
            logs[case] = images.log
        agreement = None
        if direct:
            own = _Directly(
                store, Images(setups["TC-1"], direct, seed, imaging, tables=lookup), done
            )
            alone = monte_carlo(setups["TC-1"], UPDATES, direct, seed, measure=own)
            agreement = _compare(own.images.log, alone, logs["TC-1"], closed["TC-1"])
    opened = {case: monte_carlo(case, UPDATES, runs, seed) for case in CASES}
    result = Campaign(tables, closed, opened, agreement)
    stored_arrays.write(store.path / "summary.txt", campaign_report(result).encode())
    return result


def _work(store: Folder, direct: int) -> int:
    """What is left to do, in images."""
    tables = sum(not (store.path / f"image-{k}.npz").exists() for k in range(1, UPDATES + 1))
    total = tables * (ACQUIRING + len(assumed_speeds(store.imaging)))
    for k in range(1, UPDATES + 1):
        left = sum(not (store.path / f"{_name(k, i)}.npz").exists() for i in range(direct))
        total += left * CLIMBING + bool(left) * ACQUIRING
    return total


def _name(k: int, run: int) -> str:
    return f"direct-{run:03d}-image-{k}"


def _table(store: Folder, k: int, done: Callable[[int], Any]) -> ImageTable:
    """The table of an image, from its file or made now."""
    setup = same_images(CASES["TC-1"])
    found = store.load(f"image-{k}", ImageTable, setup, k)
    if found is None:
        acquired = acquire(setup, k, store.imaging)
        done(ACQUIRING)

        def counted(speeds: Iterable[float]) -> Iterator[float]:
            for speed in speeds:
                yield speed
                done(1)

        store.save(f"image-{k}", image_table(acquired, store.imaging, counted), setup, k)
        found = store.load(f"image-{k}", ImageTable, setup, k)
    return found


@dataclass(frozen=True, eq=False)
class _Directly:
    """Measurements of runs that form every image themselves, each stored as it comes."""

    store: Folder
    images: Images
    done: Callable[[int], Any]

    def __call__(self, k: int, state: NavigationState) -> Measurement:
        acquired: Acquisition | None = None
        found = []
        for run, start in enumerate(np.linalg.norm(state.v, axis=-1)):
            job = (self.images.setup, self.images.runs, self.images.seed, k, run)
            formed = self.store.load(_name(k, run), Formed, *job)
            if formed is None:
                if acquired is None:
                    acquired = acquire(same_images(self.images.setup), k, self.store.imaging)
                    self.done(ACQUIRING)
                climb, match = measure_directly(acquired, float(start), self.store.imaging)
                r_f = np.full(3, np.nan) if match is None else match.r_f
                formed = Formed(start, np.array(climb.speed), r_f, np.array(climb.ended))
                self.store.save(_name(k, run), formed, *job)
                self.done(CLIMBING)
            found.append(formed)
        start, speed, r_f, ended = (np.stack(part) for part in zip(*found, strict=True))
        return self.images.measured(k, start, speed, r_f, ended.tolist())


def _compare(own: list[Any], alone: MonteCarlo, log: list[Any], closed: MonteCarlo) -> Agreement:
    n = alone.errors.shape[1]
    absent, speed, pixel = [], [], []
    for direct, tabulated in zip(own, log, strict=True):
        absent.append(direct.absent != tabulated.absent[:n])
        speed.append(np.abs(direct.speed - tabulated.speed[:n]))
        pixel.append(np.linalg.norm(direct.r_f - tabulated.r_f[:n], axis=-1))
    apart = alone.errors[UPDATES] - closed.errors[UPDATES, :n]
    sigma = np.sqrt(np.diagonal(closed.covariances[UPDATES, :n], axis1=-2, axis2=-1))
    both = [np.nan_to_num(np.concatenate(parts)) for parts in (speed, pixel)]
    return Agreement(
        n * UPDATES,
        int(np.sum(absent)),
        float(both[0].max()),
        float(both[1].max()),
        float(np.max(np.abs(apart) / sigma)),
    )


def campaign_report(found: Campaign) -> str:
    """A campaign in words and numbers.

    Parameters
    ----------
    found : Campaign

    Returns
    -------
    str
    """
    lines = []
    for k, image in enumerate(found.images, start=1):
        curve, true = CubicSpline(image.speed, image.sharpness), image.true_speed
        near = np.linspace(true - 3, true + 3, 601)
        best = near[curve(near).argmax()]
        loss = 100 * (1 - curve([true - 15, true + 15]) / curve(best))
        off = np.linalg.norm(image.r_f - image.truth, axis=-1).max(initial=0)
        lines.append(
            f"image {k}: sharpest at {best - true:+.2f} m/s, 15 m/s off {loss[0]:.0f} and "
            f"{loss[1]:.0f} % less; centre within {off:.1f} m, by {image.inliers.min()} inliers"
        )
    for case, closed in found.closed.items():
        lines.append(f"{case}, {closed.errors.shape[1]} runs, 1-sigma position at 25 s")
        lines.append(summary(closed, found.opened[case]))
    if found.agreement is not None:
        images, otherwise, speed, pixel, deviations = found.agreement
        lines.append(
            f"formed directly: {images} images, {otherwise} with another end; velocity within "
            f"{speed:.2f} m/s, pixel within {pixel:.1f} m, state within {deviations:.2f} deviations"
        )
    return "\n".join(lines) + "\n"
