"""What is tried on every problem: the cures of the four works, with what their texts leave open."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from navfilters.estimators import FILTERS, AdaptiveNoise, AdaptiveRobust, Filter, Robust, variants
from navfilters.problems.noisier import Noisier
from navfilters.problems.problem import Problem
from navfilters.space.star_earth_sensor import StarEarthSensor
from navfilters.types import Array

Treatment = tuple[Problem, Any]


class UnfitError(Exception):
    """A cure cannot act on a problem; the message says why."""


@dataclass(frozen=True)
class Cure:
    """A cure by name.

    Parameters
    ----------
    name : str
    apply : callable
        (problem, value) -> (problem, filter): the problem as the filter is to know it, and the
        filter. Raises UnfitError where it cannot act.
    value : float
        Of its parameter, as its text has it.
    scanned : tuple of float
        Values to be tried where the text leaves it open.
    parameter : str
        What the value is.
    """

    name: str
    apply: Callable[[Problem, Any], Treatment]
    value: float = 1.0
    scanned: tuple[float, ...] = ()
    parameter: str = ""


def plain(estimator: Filter) -> Callable[[Problem, Any], Treatment]:
    """A cure that is a filter, without a parameter."""
    return lambda problem, value: (problem, estimator)


def _equivalent(problem: Problem, value: Any) -> Treatment:
    draw = problem.drawn(1)
    n, m = draw.prior.cov.shape[-1], problem.model.R.shape[-1]
    if n != m:
        raise UnfitError(f"needs a square H, to invert; here are {m} measurements of {n} states")
    return problem, FILTERS["B-EKF 3"]


def _bumped(problem: Problem, bump: Array) -> Treatment:
    return problem, FILTERS["B-EKF 1"].having(bump=bump)


def _underweighted(problem: Problem, bump: Array, updates: int = 10) -> Treatment:
    return problem, Filter(variant=variants.Underweighting(bump, updates))


def _robust(problem: Problem, factor: Array) -> Treatment:
    largest = np.sqrt(np.linalg.eigvalsh(problem.drawn(1).prior.cov)[-1])
    return problem, Filter(rule=Robust(factor * largest))


def _adaptive(problem: Problem, value: Any) -> Treatment:
    if not isinstance(problem.model, StarEarthSensor):
        raise UnfitError("its text says for two stars alone where an innovation drives Q, Eq. (44)")
    return problem, Filter(rule=AdaptiveNoise())


def _gated(problem: Problem, alpha: Array) -> Treatment:
    return problem, Filter(rule=AdaptiveRobust(alpha=alpha))


def _noisier(problem: Problem, factor: Array, timed: bool = False) -> Treatment:
    if problem.dynamics is None:
        raise UnfitError("a point that stands still has no process noise to be raised")
    when = problem.burning if timed else None
    if timed and when is None:
        raise UnfitError("nothing happens here at times that one could be told")
    dynamics = Noisier(problem.dynamics, factor, when)
    return replace(problem, dynamics=dynamics), FILTERS["EKF"]


BUMPS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
NOISES = (1e1, 1e2, 1e4, 1e6, 1e8, 1e9, 1e10)

PAPERS = (
    Cure("EKF", plain(FILTERS["EKF"])),
    Cure("B-EKF 1", _bumped, 1.0, BUMPS, "bump"),
    Cure("first 10", _underweighted, 0.2, BUMPS, "bump"),
    Cure("B-EKF 2", plain(FILTERS["B-EKF 2"])),
    Cure("B-EKF 3", _equivalent),
    Cure("B-EKF 4", plain(FILTERS["B-EKF 4"])),
    Cure("mtSOF", plain(FILTERS["mtSOF"])),
    Cure("B-mtSOF", plain(FILTERS["B-mtSOF"])),
    Cure("UKF", plain(FILTERS["UKF"])),
    Cure("B-UKF", plain(FILTERS["B-UKF"])),
    Cure("UKFz", plain(FILTERS["UKFz"])),
    Cure("REKF", _robust, 1.6, (1.1, 1.3, 1.6, 3.0, 10.0), "gamma / largest deviation of P0"),
    Cure("AEKF", _adaptive),
    Cure("AREKF", _gated, 0.2, (0.02, 0.05, 0.1, 0.2, 0.5, 1.0), "alpha"),
    Cure("more Q", _noisier, 1e2, NOISES, "factor of Q"),
    Cure("timed Q", partial(_noisier, timed=True), 1e8, NOISES, "factor of Q in the burns"),
)
"""Of the four works: ten filters, underweighting, three rules, and Q by hand."""

CURES = PAPERS
