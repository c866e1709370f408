"""Runs: one history, or many configurations, on either engine; and tests of consistency."""

from navfilters.runs import records
from navfilters.runs.chi_square import chi_square_band
from navfilters.runs.chunks import SweepError
from navfilters.runs.consistency import (
    coverage,
    mean_nees,
    nees,
    nis,
    sample_deviation,
)
from navfilters.runs.loop import first_indefinite, run
from navfilters.runs.records import Distance
from navfilters.runs.sweeping import Sweep, sweep

__all__ = [
    "Distance",
    "Sweep",
    "SweepError",
    "chi_square_band",
    "coverage",
    "first_indefinite",
    "mean_nees",
    "nees",
    "nis",
    "records",
    "run",
    "sample_deviation",
    "sweep",
]
