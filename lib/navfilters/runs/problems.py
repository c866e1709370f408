"""The arguments of a sweep: checked, taken apart, and dealt out in chunks."""

from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np

from navfilters.numerics import validation
from navfilters.runs import model_checks
from navfilters.runs.march import Chunk, Job, March
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

SENT = 2**26
"""Bytes of the series over the steps, given and kept, of a chunk."""


@dataclass(frozen=True, eq=False)
class Problem:
    """All configurations of a sweep, none of them copied.

    Parameters
    ----------
    tree : Tree
        Of (estimator, priors, z, model, truth).
    leaves : list of Leaf
        The arrays of the tree.
    batch : tuple of int
        Their common batch axes.
    """

    tree: Tree
    leaves: list[Leaf]
    batch: tuple[int, ...]

    @classmethod
    def of(cls, estimator, priors, z, model, truth, steps, z_varies) -> "Problem":
        """The arguments of a sweep, checked; ValueError names the one that is wrong."""
        priors = validation.gaussian("priors", priors)
        remembers = hasattr(estimator, "step")
        sensor = model[1] if remembers else model
        z, _ = model_checks.measurements(z, priors, sensor, steps, z_varies, "priors")
        if remembers and hasattr(model[0], "transition"):
            n = priors.mean.shape[-1]
            validation.covariance("model[0].Q", getattr(model[0], "Q", None), n, definite=False)
        if truth is not None:
            truth = _truth(truth, priors, steps, z_varies)
        parts = {
            "estimator": flatten("estimator", estimator, 0),
            "mean": flatten("priors.mean", priors.mean, 1),
            "cov": flatten("priors.cov", priors.cov, 2),
            "z": flatten("z", z, 1, int(z_varies)),
            "model": _pair(model) if remembers else _one_model("model", model),
            "truth": flatten("truth", truth, 1, int(z_varies)),
        }
        leaves = [leaf for _, more in parts.values() for leaf in more]
        batch = validation.batch(**{leaf.name: leaf.batch for leaf in leaves})
        if 0 in batch:
            raise ValueError(
                f"priors must hold at least one configuration; found batch axes {batch}"
            )
        trees = {name: tree for name, (tree, _) in parts.items()}
        prior = Tree(Gaussian, Gaussian._fields, (trees.pop("mean"), trees.pop("cov")))
        whole = (trees["estimator"], prior, trees["z"], trees["model"], trees["truth"])
        names = ("estimator", "priors", "z", "model", "truth")
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


def _truth(truth: Any, priors: Gaussian, steps: int, z_varies: bool) -> np.ndarray:
    """The truth as an array that fits the state and the number of steps."""
    truth = validation.real_array("truth", truth, "k")
    n = priors.mean.shape[-1]
    if truth.shape[-1] > n or (z_varies and (truth.ndim < 2 or truth.shape[0] != steps + 1)):
        axes = f"({steps + 1}, ..., k)" if z_varies else "(..., k)"
        raise ValueError(f"truth must have shape {axes} with k up to {n}; found {truth.shape}")
    return truth


def _pair(model: tuple) -> tuple[Tree, list[Leaf]]:
    """A pair of models taken apart."""
    parts = [_one_model(f"model[{i}]", part) for i, part in enumerate(model)]
    names = tuple(str(i) for i in range(len(model)))
    return Tree(tuple, names, tuple(t for t, _ in parts)), [x for _, more in parts for x in more]


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


def probe_models(job: Job, problem: Problem) -> None:
    """Call the model's functions for one configuration and for several, as chunks of them will.

    Parameters
    ----------
    job : Job
    problem : Problem

    Raises
    ------
    ValueError
        As of :mod:`navfilters.runs.model_checks`.
    """
    for size in (1, SEVERAL):
        march = March(job, problem.chunk(0, size).arrays)
        mean = march.prior.mean
        try:
            if not march.remembers:
                model_checks.sensor(march.model, mean, name="priors")
                continue
            if not _of_this_library(march):
                return
            dynamics, sensor = march.model
            model_checks.dynamics(dynamics, mean, name="model[0]")
            model_checks.sensor(sensor, mean, name="priors")
        except ValueError as error:
            if not any(leaf.core and leaf.name.startswith("model") for leaf in problem.leaves):
                raise
            raise ValueError(
                f"{error}. (In a sweep a model's arrays that differ between configurations are "
                "fields of a dataclass, not in a closure, and those that are no matrices say so: "
                'field(metadata={"axes": number}).)'
            ) from error


def _of_this_library(march: March) -> bool:
    """Whether a filter with a memory asks of its models what the extended Kalman filter does.

    One whose state is no Gaussian, or whose dynamics have no transition, has an interface of its
    own with them.
    """
    try:
        with np.errstate(all="ignore"):
            state = march.estimator.init(march.prior)
    except Exception:  # the first step will tell, and name the configuration
        return False
    return hasattr(march.model[0], "transition") and "estimate" in getattr(state, "_fields", ())


def _with_members(leaf: Leaf, batch: tuple[int, ...]) -> Leaf:
    """A prior with all batch axes, so that the state has the same shape from the start."""
    if not leaf.name.startswith("priors"):
        return leaf
    core = leaf.array.shape[len(leaf.batch) :]
    return leaf._replace(array=np.broadcast_to(leaf.array, (*(batch or (1,)), *core)))
