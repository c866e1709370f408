"""The closed loop with images of its own for each run."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Literal

import numpy as np

from navfilters.papers.pogorelsky2020.closed_loop import Attempt, Images
from navfilters.papers.pogorelsky2020.experiment import Setup
from navfilters.papers.pogorelsky2020.image_tables import ImageTable
from navfilters.papers.pogorelsky2020.imaging import FULL, Imaging
from navfilters.space.image_measurement import Measurement
from navfilters.space.navigation_state import NavigationState


@dataclass(frozen=True, eq=False)
class DifferentImages:
    """Measurements of the closed loop, not all runs with the same images.

    Parameters
    ----------
    setup : Setup
    runs : sequence of int
        Which: see ``navfilters.papers.pogorelsky2020.noise_draws.noise``.
    tables : callable
        (k, place of the run in ``runs``) -> ImageTable, the same object for runs that share one.
    seed : int
    imaging : Imaging
    geometry : {"nominal", "predicted"}
        See ``Images``.
    """

    setup: Setup
    runs: Sequence[int]
    tables: Callable[[int, int], ImageTable]
    seed: int = 0
    imaging: Imaging = FULL
    geometry: Literal["nominal", "predicted"] = "predicted"
    log: list[Attempt] = field(default_factory=list, init=False, repr=False)

    def __call__(self, k: int, state: NavigationState) -> Measurement:
        """The images after interval k.

        Parameters
        ----------
        k : int
            From 1.
        state : NavigationState
            What the filter predicts; one for each run.

        Returns
        -------
        Measurement
            r_f (runs, 3), slant_range (runs,), speed (runs,).
        """
        groups = dict[int, tuple[ImageTable, list[int]]]()  # runs that share an image go together
        for i in range(len(self.runs)):
            table = self.tables(k, i)
            groups.setdefault(id(table), (table, []))[1].append(i)
        found, attempts = list[Measurement](), list[Attempt]()
        for table, places in groups.values():
            images = Images(
                self.setup,
                [self.runs[i] for i in places],
                self.seed,
                self.imaging,
                self.geometry,
                partial(_alone, table),
            )
            found.append(images(k, NavigationState(*(part[places] for part in state))))
            attempts.extend(images.log)
        order = np.argsort(np.concatenate([places for _, places in groups.values()]))
        start, speed, r_f, absent = (
            np.concatenate([getattr(attempt, name) for attempt in attempts])[order]
            for name in ("start", "speed", "r_f", "absent")
        )
        ended = [e for attempt in attempts for e in attempt.ended]
        self.log.append(Attempt(k, start, speed, r_f, tuple(ended[i] for i in order), absent))
        return Measurement(*(np.concatenate(part)[order] for part in zip(*found, strict=True)))


def _alone(table: ImageTable, _setup: Setup, _k: int, _imaging: Imaging) -> ImageTable:
    """The one table of some runs."""
    return table
