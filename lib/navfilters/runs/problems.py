"""The arguments of a sweep: checked, taken apart, and dealt out in chunks."""

import sys
from dataclasses import dataclass, replace
from math import prod
from typing import Any

import numpy as np

from navfilters.numerics import validation
from navfilters.runs import model_checks
from navfilters.runs.chunks import compute
from navfilters.runs.march import Chunk, Job, Kept, March
from navfilters.runs.surroundings import Surroundings
from navfilters.runs.system_checks import compare_derivatives
from navfilters.runs.trees import Leaf, Tree, flatten
from navfilters.types import Gaussian

CACHED = 2**16
"""Elements of the covariances of a chunk: few enough for the cache, enough to amortise a call."""

PARTS = 8
"""Chunks, at least, of a sweep that is worth more than one process, if they are not too small."""

WORTH_A_PROCESS = 1e7
"""Updates below which a second process costs more time to start than it saves."""

SEVERAL = 3
"""Configurations that stand for a batch when the model's functions are looked at."""

FIRST: dict[tuple[Any, ...], Kept] = {}
"""What one step of the first configuration gave, by structures and shapes of problems: their models
were called and found sound, for which once is enough."""

SENT = 2**26
"""Bytes of the series over the steps, given and kept, of a chunk."""


@dataclass(frozen=True, eq=False)
class Problem:
    """All configurations of a sweep, none of them copied.

    Parameters
    ----------
    tree : Tree
        Of (estimator, priors, z, model, dynamics, record).
    leaves : list of Leaf
        The arrays of the tree.
    batch : tuple of int
        Their common batch axes.
    """

    tree: Tree
    leaves: list[Leaf]
    batch: tuple[int, ...]

    @classmethod
    def of(
        cls,
        estimator: Any,
        priors: Gaussian,
        z: Any,
        model: Any,
        dynamics: Any,
        record: Any,
        steps: int,
        z_per_step: bool,
    ) -> "Problem":
        """The arguments of a sweep, checked; ValueError names the one that is wrong."""
        priors = model_checks.start("priors", priors, model, dynamics)
        z, _ = model_checks.measurements(z, priors, model, steps, z_per_step, "priors")
        parts = {
            "estimator": flatten("estimator", estimator, 0),
            "mean": flatten("priors.mean", priors.mean, 1),
            "cov": flatten("priors.cov", priors.cov, 2),
            "z": flatten("z", z, 1, int(z_per_step)),
            "model": _one_model("model", model),
            "dynamics": _one_model("dynamics", dynamics),
            "record": flatten("record", record, 0),
        }
        leaves = [leaf for _, more in parts.values() for leaf in more]
        batch = validation.batch(**{leaf.name: leaf.batch for leaf in leaves})
        if 0 in batch:
            raise ValueError(
                f"priors must hold at least one configuration; found batch axes {batch}"
            )
        trees = {name: tree for name, (tree, _) in parts.items()}
        prior = Tree(Gaussian, Gaussian._fields, (trees.pop("mean"), trees.pop("cov")))
        names = ("estimator", "priors", "z", "model", "dynamics", "record")
        whole = tuple(prior if name == "priors" else trees[name] for name in names)
        return cls(
            Tree(tuple, names, whole), [_with_members(leaf, batch) for leaf in leaves], batch
        )

    @property
    def grid(self) -> tuple[int, ...]:
        """The batch axes, at least one."""
        return self.batch or (1,)

    @property
    def count(self) -> int:
        """Number of configurations."""
        return prod(self.batch)

    @property
    def complete(self) -> bool:
        """Whether no measurement is NaN."""
        return not any(np.isnan(leaf.array).any() for leaf in self.leaves if leaf.name == "z")

    @property
    def axes(self) -> tuple[int | None, ...]:
        """Where each leaf has its members, once they are picked."""
        return tuple(leaf.axis for leaf in self.leaves)

    def size(self, steps: int, series_bytes: int) -> int:
        """Members of a chunk by default: chunks of equal size that fit the cache.

        Parameters
        ----------
        steps : int
        series_bytes : int
            Size of the series that are kept, per member.

        Returns
        -------
        int
            Whatever the workers, so that they do not decide the result's last bits.
        """
        for leaf in self.leaves:
            if leaf.lead and leaf.batch:
                series_bytes += leaf.array.nbytes // prod(leaf.batch)
        n = next(leaf.array.shape[-1] for leaf in self.leaves if leaf.name == "priors.cov")
        most = CACHED // n**2
        if self.count * steps > WORTH_A_PROCESS:
            most = min(most, max(most // PARTS, self.count // PARTS))
        most = max(1, min(most, SENT // max(1, series_bytes)))
        return -(-self.count // -(-self.count // most))

    def chunk(self, number: int, size: int) -> Chunk:
        """So many members; the last chunk repeats its last one to be as large as the others."""
        members = np.minimum(np.arange(number * size, (number + 1) * size), self.count - 1)
        index = np.unravel_index(members, self.grid)
        return Chunk(number, members, [leaf.pick(index, self.grid) for leaf in self.leaves])


def _one_model(name: str, model: Any) -> tuple[Tree, list[Leaf]]:
    """A model taken apart: with batch axes if its R or its Q has them."""
    noise = [getattr(model, key) for key in ("R", "Q") if hasattr(model, key)]
    batched = any(np.ndim(matrix) > 2 for matrix in noise)
    tree, leaves = flatten(name, model, 2 if batched else None, opened=batched)
    if batched and tree.fixed is not None:
        raise ValueError(
            f"{name} must be a dataclass if it has batch axes, so that its arrays are known; found "
            f"{type(model).__name__}"
        )
    return tree, leaves


def first_step(job: Job, problem: Problem) -> Kept:
    """What one step of the first configuration keeps, its model's functions looked at before.

    They are called for one configuration and for several, as chunks of them will be. Once for
    problems that differ in numbers alone.

    Parameters
    ----------
    job : Job
    problem : Problem

    Returns
    -------
    Kept
        By its shapes and types what any configuration keeps.

    Raises
    ------
    ValueError
        As of :mod:`navfilters.runs.model_checks`.
    SweepError
        The filter or the model raised an exception.
    """
    kinds = tuple((leaf.name, leaf.array.shape, leaf.array.dtype) for leaf in problem.leaves)
    jax = sys.modules.get("jax")
    doubles = jax is None or jax.config.jax_enable_x64  # where a model may be one of JAX
    steps = min(job.steps, 1)
    around = Surroundings.of(job.tree).key
    known = (job.engine, doubles, job.tree, around, kinds, steps, job.z_per_step, job.complete)
    if around is not None and known in FIRST:
        return FIRST[known]
    _probe_models(job, problem)
    kept = compute(replace(job, engine="numpy", steps=steps), problem.chunk(0, 1))
    if around is not None:
        FIRST[known] = kept
    return kept


def _probe_models(job: Job, problem: Problem) -> None:
    for size in (1, SEVERAL):
        march = March(job, problem.chunk(0, size).arrays)
        try:
            model_checks.models(march.model, march.dynamics, march.prior, job.steps, "priors")
            compare_derivatives(march.filter, march.model, march.dynamics, march.prior)
        except ValueError as error:
            models = ("model", "dynamics")
            if not any(leaf.core and leaf.name.startswith(models) for leaf in problem.leaves):
                raise
            raise ValueError(
                f"{error}. (In a sweep a model's arrays that differ between configurations are "
                "fields of a dataclass, not in a closure, and those that are no matrices say so: "
                'field(metadata={"axes": number}).)'
            ) from error


def _with_members(leaf: Leaf, batch: tuple[int, ...]) -> Leaf:
    """A prior with all batch axes, so that the state has the same shape from the start."""
    if not leaf.name.startswith("priors"):
        return leaf
    core = leaf.array.shape[len(leaf.batch) :]
    return leaf._replace(array=np.broadcast_to(leaf.array, (*(batch or (1,)), *core)))
