"""A filter under test: where its members are computed, who is told, what is kept for figures."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from navfilters.crash.adapters import Adapted
from navfilters.problems import Problem
from navfilters.problems.outcome import History, follow
from navfilters.runs.loop import run
from navfilters.runs.records import estimate
from navfilters.runs.sweeping import sweep
from navfilters.types import Array, Gaussian

WORTH_A_PROCESS = 500
"""Updates of one state from which on members of an unbatched filter go to other processes."""

PARTS = 8
"""Into so many chunks for each process, so that the bar moves and no process waits for long."""


def nobody(updates: int) -> None:
    """Told of progress that nobody wants to see."""


@dataclass(frozen=True, eq=False)
class Subject:
    """A filter under test.

    Parameters
    ----------
    filter : what ``run`` takes
    workers : int
        Processes among which the members of an adapted filter are divided.
    told : callable
        Of so many more updates that were made.
    kept : dict
        Filled by checks with what their figures show.
    """

    filter: Any
    workers: int = 1
    told: Callable[[int], Any] = nobody
    kept: dict[str, Any] = field(default_factory=dict)

    def history(self, prior: Gaussian, z: Array, model: Any, *, dynamics: Any = None) -> Gaussian:
        """The estimates of a run, without warnings of a filter that fails.

        Parameters
        ----------
        prior : Gaussian
            mean (..., n), cov (..., n, n).
        z : array (steps, ..., m)
        model : MeasurementModel
        dynamics : Dynamics, optional

        Returns
        -------
        Gaussian
            mean (steps + 1, ..., n), the prior first.
        """
        batch = np.broadcast_shapes(prior.mean.shape[:-1], prior.cov.shape[:-2], z.shape[1:-1])
        members = int(np.prod(batch))
        place = self._place(members, len(z))
        options: dict[str, Any] = {"dynamics": dynamics, "z_per_step": True}
        with np.errstate(all="ignore"):  # a filter that fails has no number, and says so there
            if place:
                return sweep(
                    self.filter, prior, z, model, record=estimate, **options, **place
                ).record
            found = run(self.filter, prior, z, model, **options)
        self.told(members * len(z))
        return found

    def followed(self, problem: Problem, runs: int) -> History:
        """Its runs of one of the book's problems.

        Parameters
        ----------
        problem : Problem
        runs : int

        Returns
        -------
        History
        """
        place = self._place(runs, problem.steps)
        found = follow(problem, self.filter, runs, **place)
        if not place:
            self.told(runs * problem.steps)
        return found

    def _place(self, members: int, steps: int) -> dict[str, Any]:
        """How ``sweep`` is to divide a filter of one state; nothing for others and for little."""
        if not isinstance(self.filter, Adapted) or members * steps < WORTH_A_PROCESS:
            return {}
        return {
            "workers": min(self.workers, members),
            "chunk": max(1, members // (PARTS * self.workers)),
            "progress": lambda done: self.told(done * steps),
        }
