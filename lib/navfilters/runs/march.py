"""The steps of a sweep for some members, in functions that run and compile."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from navfilters.numerics.small_matrices import is_positive_definite
from navfilters.runs.trees import Tree, unflatten
from navfilters.types import Array, Gaussian


@dataclass(frozen=True, eq=False)
class Job:
    """What all chunks of a sweep have in common.

    Parameters
    ----------
    engine : {"numpy", "jax"}
    tree : Tree
        Of (estimator, prior, z, model, truth).
    axes : tuple of (int or None)
        Where each of its arrays has its members; None where they share it.
    grid : tuple of int
        The batch axes of the sweep, (1,) for a single configuration.
    steps : int
    keep : tuple of str
        Names of what is kept.
    z_varies : bool
        Whether z and truth are series over the steps.
    sweep : str
        Another one for every sweep.
    """

    engine: str
    tree: Tree
    axes: tuple[int | None, ...]
    grid: tuple[int, ...]
    steps: int
    keep: tuple[str, ...]
    z_varies: bool
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


class Carry(NamedTuple):
    """What goes from step to step."""

    state: Any
    indefinite: Array


class Row(NamedTuple):
    """What is kept of each step: None if it is not asked for."""

    error: Array | None
    history: Gaussian | None


class Kept(NamedTuple):
    """What is kept of a chunk: None if it is not asked for."""

    final: Any
    indefinite: Array | None
    rows: Row


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
        problem = unflatten(job.tree, arrays)
        self.estimator, self.prior, self.z, self.model, self.truth = problem
        self.remembers = hasattr(self.estimator, "step")
        self.update = self.estimator.step if self.remembers else self.estimator
        self.counts = _asks_for_step(self.update)

    def start(self) -> tuple[Carry, Row]:
        """Before any step."""
        xp = self.prior.mean.__array_namespace__()
        state = self.estimator.init(self.prior) if self.remembers else self.prior
        never = xp.full(self.prior.mean.shape[:-1], -1)
        return self._look(0, state, never, self._at(self.truth, 0))

    def advance(self, carry: Carry, k: Array, z: Array, truth: Array | None) -> tuple[Carry, Row]:
        """Step k, counted from 1."""
        models = self.model if self.remembers else (self.model,)
        count = {"step": k - 1} if self.counts else {}
        state = self.update(carry.state, z, *models, **count)
        return self._look(k, state, carry.indefinite, truth)

    def step(self, carry: Carry, k: int) -> tuple[Carry, Row]:
        """Step k, with its measurement and its truth."""
        return self.advance(carry, k, self._at(self.z, k - 1), self._at(self.truth, k))

    def finish(self, carry: Carry, rows: Row) -> Kept:
        """The result, of the rows of all steps."""
        keep = self.job.keep
        return Kept(
            carry.state if "final" in keep else None,
            carry.indefinite if "indefinite" in keep else None,
            rows,
        )

    def _at(self, series: Array, k: int) -> Array:
        return series[k] if self.job.z_varies and series is not None else series

    def _look(self, k: Array, state: Any, lost: Array, truth: Array | None) -> tuple[Carry, Row]:
        estimate, keep = state.estimate if self.remembers else state, self.job.keep
        xp = estimate.mean.__array_namespace__()
        error = None
        if "indefinite" in keep:
            now = (lost < 0) & ~is_positive_definite(estimate.cov)
            lost = xp.where(now, k, lost)
        if truth is not None:
            miss = estimate.mean[..., : truth.shape[-1]] - truth
            error = xp.linalg.vector_norm(miss, axis=-1)
        return Carry(state, lost), Row(error, estimate if "history" in keep else None)


def _asks_for_step(update: Callable) -> bool:
    """Whether a parameter is called step and has no value yet."""
    step = inspect.signature(update).parameters.get("step")
    return step is not None and step.default is step.empty
