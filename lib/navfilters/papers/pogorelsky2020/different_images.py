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
    """Measurements of the closed loop, each run with images that it shares with no other.

    Parameters
    ----------
    setup : Setup
    runs : sequence of int
        Which: see ``navfilters.papers.pogorelsky2020.noise_draws.noise``.
    tables : callable
        (k, place of the run in ``runs``) -> ImageTable.
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
        found, attempts = list[Measurement](), list[Attempt]()
        for i, run in enumerate(self.runs):
            images = Images(
                self.setup,
                [run],
                self.seed,
                self.imaging,
                self.geometry,
                partial(_alone, self.tables(k, i)),
            )
            alone = NavigationState(*(part[i : i + 1] for part in state))
            found.append(images(k, alone))
            attempts.extend(images.log)
        parts = zip(*attempts, strict=True)
        next(parts)
        start, speed, r_f, ended, absent = parts
        self.log.append(
            Attempt(
                k,
                np.concatenate(start),
                np.concatenate(speed),
                np.concatenate(r_f),
                tuple(e for each in ended for e in each),
                np.concatenate(absent),
            )
        )
        return Measurement(*(np.concatenate(part) for part in zip(*found, strict=True)))


def _alone(table: ImageTable, _setup: Setup, _k: int, _imaging: Imaging) -> ImageTable:
    """The one table of a run."""
    return table
