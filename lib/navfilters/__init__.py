"""Kalman-type filters as one update with different moments, batched, and every claim checked."""

import importlib
from typing import TYPE_CHECKING

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

if TYPE_CHECKING:
    from navfilters.crash import crash_test as crash_test
    from navfilters.diagnosis import diagnose as diagnose

_moved.announce()

LATER = {"crash_test": "navfilters.crash", "diagnose": "navfilters.diagnosis"}
"""What is imported when it is first asked for: it brings the experiments with it."""

__all__ = [
    "FILTERS",
    "Filter",
    "Gaussian",
    "Moments",
    "SigmaPoints",
    "Sweep",
    "SweepError",
    "crash_test",
    "diagnose",
    "first_indefinite",
    "kalman_update",
    "linearized",
    "run",
    "second_order",
    "sweep",
    "unscented",
]


def __getattr__(name: str) -> object:
    if name in LATER:
        return getattr(importlib.import_module(LATER[name]), name)
    raise AttributeError(f"module 'navfilters' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *LATER})
