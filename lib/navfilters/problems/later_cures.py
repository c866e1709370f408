"""The cures of other works: other moments and corrections, other rules, other coordinates."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from navfilters.estimators import (
    LATER_FILTERS,
    Filter,
    GatedInflation,
    InteractingModels,
    Modes,
    StrongTracking,
    VariationalNoise,
    expecting_noise,
)
from navfilters.models import (
    ConvertedRangeBearing,
    PolarState,
    RangeBearing,
    to_cartesian,
    to_polar,
)
from navfilters.problems.cures import PAPERS, Cure, Treatment, UnfitError, plain
from navfilters.problems.noisier import Noisier
from navfilters.problems.problem import Draw, Problem
from navfilters.types import Array, Gaussian


def _fading(problem: Problem, beta: Array) -> Treatment:
    return problem, Filter(rule=StrongTracking(beta=beta))


def _learning(problem: Problem, rho: Array) -> Treatment:
    return problem, VariationalNoise(rho=rho)


def _interacting(problem: Problem, factor: Array) -> Treatment:
    dynamics = problem.dynamics
    if dynamics is None:
        raise UnfitError("a point that stands still has one motion")
    if hasattr(dynamics, "retract"):
        raise UnfitError("averages the states of its modes, which an attitude does not allow")
    quiet = Noisier(dynamics, np.ones_like(factor))  # with the axes of the other
    modes = Modes((quiet, Noisier(dynamics, factor)))
    return replace(problem, dynamics=modes), InteractingModels()


def _range_and_bearing(problem: Problem) -> None:
    if not isinstance(problem.model, RangeBearing):
        raise UnfitError("is for range and bearing")


def _converted(problem: Problem, value: Any) -> Treatment:
    _range_and_bearing(problem)
    model = ConvertedRangeBearing(problem.model.R)
    return replace(problem, model=model), Filter(expecting_noise)


VAGUE = np.diag([1e4, 3.0])
"""A first covariance in polar coordinates: P0 of the fix along the range, and any bearing."""


def _polar(problem: Problem, value: Any) -> Treatment:
    _range_and_bearing(problem)
    return (
        replace(
            problem,
            draw=partial(_polar_draw, problem),
            model=PolarState(problem.model.R),
            back=to_cartesian,
        ),
        Filter(),
    )


def _polar_draw(problem: Problem, runs: int, seed: int) -> Draw:
    prior, truth, z = problem.drawn(runs, seed)
    start, true = to_polar(prior.mean), to_polar(truth)
    turns = np.round((true[..., 1] - start[..., 1]) / (2 * np.pi))  # the nearest bearing
    true = np.stack([true[..., 0] + 0 * turns, true[..., 1] - 2 * np.pi * turns], axis=-1)
    return Draw(Gaussian(start, VAGUE), true, z)


LATER = (
    *(Cure(name, plain(estimator)) for name, estimator in LATER_FILTERS.items()),
    Cure("STF", _fading, 1.0, (1.0, 2.0, 5.0, 10.0, 100.0), "softening factor beta"),
    Cure("gate", plain(Filter(rule=GatedInflation()))),
    Cure("VB", _learning, 0.98, (0.9, 0.98, 1.0), "rho"),
    Cure("IMM", _interacting, 1e8, (1e2, 1e4, 1e6, 1e8), "factor of Q in the second mode"),
    Cure("converted", _converted),
    Cure("polar", _polar),
)
"""Of other works, by the names of their chapters."""

CURES = (*PAPERS, *LATER)
"""Every cure of the table, in its order."""
