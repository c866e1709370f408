"""What a filter is tried on: a patient, its draws, and how well an honest filter could do."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from navfilters.estimators import model_parts
from navfilters.estimators.filter import Filter
from navfilters.numerics import validation
from navfilters.types import Array, Gaussian

LOST = 10.0
"""A run is lost if its error is more than so many times that of the reference, or no number."""


class Draw(NamedTuple):
    """Some runs of a problem.

    Parameters
    ----------
    prior : Gaussian
        First estimates: mean (runs, n), cov (n, n).
    truth : array (steps + 1, runs or 1, n)
        True states, the first at the time of the prior.
    z : array (steps, runs, m)
        Measurements; NaN where there is none.
    """

    prior: Gaussian
    truth: Array
    z: Array


@dataclass(frozen=True, eq=False)
class Problem:
    """A patient: what is estimated, from what, and how the result is judged.

    Parameters
    ----------
    name : str
    draw : callable
        (runs, seed) -> Draw. Run i has a stream of its own, whatever the others are.
    model : MeasurementModel
        What the filter knows of the sensor.
    steps : int
    judged : tuple of int
        Components of the error, truth minus estimate, whose norm is the error.
    unit : str
        Of that error.
    since : int
        First update, counted from 1, of the window over which the error is averaged; it ends with
        the last.
    dynamics : Dynamics, optional
        What the filter knows of the motion.
    burning : bool array (steps,), optional
        Steps in which a force acts that the filter does not know.
    tested : tuple of int, optional
        Components of the error of which the NEES is; all by default.
    repeated : bool
        Whether all runs have the same measurements, so that their NEES are no independent ones.
    back : callable, optional
        From this problem's states to those of the problem that it stands for, if a cure writes the
        state in another way.
    """

    name: str
    draw: Callable[[int, int], Draw]
    model: Any
    steps: int
    judged: tuple[int, ...]
    unit: str
    since: int
    dynamics: Any = None
    burning: Array | None = None
    tested: tuple[int, ...] | None = None
    repeated: bool = False
    back: Callable[[Array], Array] | None = None

    def __post_init__(self) -> None:
        validation.whole_number("steps", self.steps, 1)
        validation.whole_number("since", self.since, 1)
        if self.since > self.steps:
            raise ValueError(f"since must be 1 to {self.steps}; found {self.since}")

    def drawn(self, runs: int, seed: int = 0) -> Draw:
        """The draws of some runs, made once.

        Parameters
        ----------
        runs : int
        seed : int

        Returns
        -------
        Draw
            Do not write into it.
        """
        return _drawn(self.draw, runs, seed)

    def error(self, estimate: Array, truth: Array) -> Array:
        """Truth minus estimate, (..., n), on the manifold if the state is on one."""
        return model_parts.difference(self.model, truth, estimate)

    def reference(self, runs: int, seed: int = 0) -> float:
        """Error of the best honest estimate, root mean square over runs and window, in ``unit``.

        It is that of an EKF that linearises at the truth and is told what the truth does: the bound
        of Cramer and Rao where the true motion is known or still, and close to it elsewhere.

        Parameters
        ----------
        runs : int
        seed : int

        Returns
        -------
        float
        """
        return _reference(self, runs, seed)


@lru_cache(maxsize=32)
def _drawn(draw: Callable[[int, int], Draw], runs: int, seed: int) -> Draw:
    return draw(runs, seed)


@lru_cache(maxsize=32)
def _reference(problem: Problem, runs: int, seed: int) -> float:
    draw, ekf = problem.drawn(runs, seed), Filter()
    x = draw.truth
    truth = np.broadcast_to(x, (len(x), *draw.prior.mean.shape[:-1], x.shape[-1]))
    state, total = ekf.init(Gaussian(truth[0], draw.prior.cov)), []
    for k in range(problem.steps):
        if problem.dynamics is not None:
            state = ekf.predict(state, problem.dynamics, k)
        here = Gaussian(truth[k + 1], state.estimate.cov)
        state = ekf.update(state._replace(estimate=here), draw.z[k], problem.model, k)
        state = state._replace(estimate=Gaussian(truth[k + 1], state.estimate.cov))
        if k + 1 >= problem.since:
            variances = np.diagonal(state.estimate.cov, axis1=-2, axis2=-1)
            total.append(np.mean(variances[..., list(problem.judged)].sum(axis=-1)))
    return float(np.sqrt(np.mean(total)))


def streams(runs: int, seed: int) -> list[np.random.Generator]:
    """One stream of random numbers for each run.

    Parameters
    ----------
    runs : int
        At least 1.
    seed : int

    Returns
    -------
    list of Generator
    """
    runs = validation.whole_number("runs", runs, 1)
    return [np.random.default_rng([seed, i]) for i in range(runs)]
