"""Kalman-type filters as one update with different moments, batched, and every claim checked."""

from navfilters import _moved
from navfilters.estimators.catalogue import FILTERS
from navfilters.estimators.filter import Filter
from navfilters.estimators.moments import linearized, second_order, unscented
from navfilters.estimators.sigma_points import SigmaPoints
from navfilters.estimators.update import kalman_update
from navfilters.runs.chunks import SweepError
from navfilters.runs.loop import first_indefinite, run
from navfilters.runs.sweeping import Sweep, sweep
from navfilters.types import Gaussian, Moments
from navfilters.version import __version__ as __version__

_moved.announce()

__all__ = [
    "FILTERS",
    "Filter",
    "Gaussian",
    "Moments",
    "SigmaPoints",
    "Sweep",
    "SweepError",
    "first_indefinite",
    "kalman_update",
    "linearized",
    "run",
    "second_order",
    "sweep",
    "unscented",
]
