"""The steps of a sweep for some members, in functions that run and compile."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from navfilters.runs.trees import Tree, unflatten
from navfilters.types import Array


@dataclass(frozen=True, eq=False)
class Job:
    """What all chunks of a sweep have in common.

    Parameters
    ----------
    engine : {"numpy", "jax"}
    tree : Tree
        Of (estimator, prior, z, model, dynamics, record).
    axes : tuple of (int or None)
        Where each of its arrays has its members; None where they share it.
    grid : tuple of int
        The batch axes of the sweep, (1,) for a single configuration.
    steps : int
    z_per_step : bool
        Whether z is a series over the steps.
    complete : bool
        Whether it is known that z has no NaN.
    sweep : str
        Another one for every sweep.
    """

    engine: str
    tree: Tree
    axes: tuple[int | None, ...]
    grid: tuple[int, ...]
    steps: int
    z_per_step: bool
    complete: bool = False
    sweep: str = ""


class Chunk(NamedTuple):
    """Some members.

    Parameters
    ----------
    number : int
    members : int array (k,)
        Their numbers in the flattened batch; the last may repeat, to fill up a compiled shape.
    arrays : list of ndarray
        The leaves of the job's tree, for these members.
    """

    number: int
    members: np.ndarray
    arrays: list[np.ndarray]


class Kept(NamedTuple):
    """What is kept of a chunk: the last state, and the record of all; None if there is none."""

    state: Any
    rows: Any


class March:
    """The steps of a job for some members, in functions that run and compile.

    Parameters
    ----------
    job : Job
    arrays : list of array
        The leaves of its tree.
    """

    def __init__(self, job: Job, arrays: list[Array]) -> None:
        self.job = job
        self.filter, self.prior, self.z, self.model, self.dynamics, self.record = unflatten(
            job.tree, arrays
        )

    def start(self) -> tuple[Any, Any]:
        """The state before any step, and its record."""
        state = self.filter.init(self.prior)
        return state, self.keep(state)

    def advance(self, state: Any, k: Array, z: Array) -> tuple[Any, Any]:
        """Step k, counted from 0."""
        state = self.filter.step(state, z, self.model, self.dynamics, k)
        return state, self.keep(state)

    def step(self, state: Any, k: int) -> tuple[Any, Any]:
        """Step k, with its measurement."""
        return self.advance(state, k, self.z[k] if self.job.z_per_step else self.z)

    def keep(self, state: Any) -> Any:
        """The record of a state."""
        return None if self.record is None else self.record(state)
