"""Kalman-type filters as one update with different moments, batched, and every claim checked."""

from navfilters.engine import first_indefinite, run
from navfilters.filters import FILTERS, Filter, kalman_update
from navfilters.moments import SigmaPoints, linearized, second_order, unscented
from navfilters.sweeping import Sweep, SweepError, sweep
from navfilters.types import Gaussian, Moments

__version__ = "0.1.0"

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
