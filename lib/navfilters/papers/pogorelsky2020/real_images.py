"""Images of a PALSAR product as measurements."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from navfilters.papers.pogorelsky2020.acquisition import measure_directly
from navfilters.papers.pogorelsky2020.imaging import FULL, Imaging
from navfilters.papers.pogorelsky2020.real_patches import Patch
from navfilters.sar.images.autofocusing import Climb
from navfilters.sar.matching.geolocation import Match
from navfilters.space.image_measurement import Measurement
from navfilters.space.navigation_state import NavigationState
from navfilters.types import Array


class RealAttempt(NamedTuple):
    """What a run made of one image.

    Parameters
    ----------
    run, k : int
        From 0, from 1.
    climb : Climb
    match : Match or None
        None if the climb found no peak.
    """

    run: int
    k: int
    climb: Climb
    match: Match | None

    @property
    def matched(self) -> bool:
        """Whether the filter was given a measurement."""
        return self.match is not None and bool(np.isfinite(self.match.r_f).all())


@dataclass(frozen=True, eq=False)
class RealImages:
    """Measurements of the closed loop from patches that each run focuses for itself.

    Parameters
    ----------
    patches : sequence of Patch
    range_error : array (runs, k)
        Added to the range, m: the truth is made from the range itself, whose error would be zero.
    imaging : Imaging
    """

    patches: Sequence[Patch]
    range_error: Array
    imaging: Imaging = FULL
    log: list[RealAttempt] = field(default_factory=list, init=False, repr=False)

    def __call__(self, k: int, state: NavigationState) -> Measurement:
        """The image after interval k, as each run forms it.

        Parameters
        ----------
        k : int
            From 1.
        state : NavigationState
            What the filter predicts; one for each run.

        Returns
        -------
        Measurement
            NaN where the climb found no peak or the image there no match.
        """
        patch = self.patches[k - 1]
        r_f, speed = np.full(state.v.shape, np.nan), np.full(len(state.v), np.nan)
        for i, start in enumerate(np.linalg.norm(state.v, axis=-1)):
            climb, match = measure_directly(patch.acquired, float(start), self.imaging)
            self.log.append(RealAttempt(i, k, climb, match))
            if match is not None and self.log[-1].matched:
                r_f[i], speed[i] = match.r_f, climb.speed
        slant_range = patch.slant_range + self.range_error[:, k - 1]
        return Measurement(r_f, np.where(np.isnan(speed), np.nan, slant_range), speed)
