"""Finished chunks in a folder, so that a sweep that stops can go on."""

import hashlib
import pickle
from pathlib import Path
from typing import Any

import numpy as np

from navfilters.runs import stored_arrays
from navfilters.runs.march import Job, Kept
from navfilters.runs.surroundings import Surroundings
from navfilters.runs.trees import Leaf, Tree, flatten, unflatten
from navfilters.version import __version__


class Checkpoint:
    """A folder with one file for each finished chunk of one job.

    Parameters
    ----------
    folder : path
    job : Job
    leaves : list of Leaf
        Of its tree, for all members.
    size : int
        Members of a chunk.
    result : Tree
        Of what a chunk has kept.

    Raises
    ------
    ValueError
        A part of the estimator or of the model that cannot be pickled, and so not compared.
    """

    def __init__(self, folder: Any, job: Job, leaves: list[Leaf], size: int, result: Tree) -> None:
        self.folder, self.result = Path(folder), result
        self.job = _fingerprint(job, leaves, size)

    def path(self, number: int) -> Path:
        """Where a chunk is."""
        return self.folder / f"chunk-{number:06d}.npz"

    def save(self, number: int, kept: Kept) -> None:
        """Store a chunk, whole or not at all."""
        _, leaves = flatten("kept", kept, None)
        arrays = {f"leaf{i}": leaf.array for i, leaf in enumerate(leaves)}
        stored_arrays.save(self.path(number), self.job, **arrays)

    def load(self, number: int) -> Kept | None:
        """A stored chunk; None if there is none.

        Parameters
        ----------
        number : int

        Returns
        -------
        Kept or None

        Raises
        ------
        ValueError
            The file is damaged, or another job's; naming it.
        """
        arrays = stored_arrays.load(
            self.path(number),
            self.job,
            [f"leaf{i}" for i in range(self.result.size)],
            kind="sweep or chunk size",
            remedy="its configurations are computed again",
        )
        return None if arrays is None else unflatten(self.result, arrays)


def _fingerprint(job: Job, leaves: list[Leaf], size: int) -> str:
    """A hash of all that decides what the chunks hold, but for the source of filters and models."""
    digest = hashlib.sha256()
    options = (job.engine, job.grid, job.steps, job.z_per_step, size)
    digest.update(repr((__version__, options)).encode())
    _add(digest, job.tree)
    for number in Surroundings.of(job.tree).numbers():
        digest.update(repr(number).encode())
    for leaf in leaves:
        digest.update(repr((leaf.name, leaf.array.dtype, leaf.array.shape)).encode())
        digest.update(np.ascontiguousarray(leaf.array).data)
    return digest.hexdigest()


def _add(digest: Any, tree: Tree) -> None:
    digest.update(repr((tree.kind.__module__, tree.kind.__qualname__, tree.names)).encode())
    if tree.fixed is not None:
        try:
            digest.update(pickle.dumps(tree.fixed.value, protocol=4))
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise ValueError(
                "checkpoint needs an estimator and a model that can be pickled, to know them "
                f"again; found {tree.fixed.value!r} ({error})"
            ) from None
    for part in tree.parts:
        _add(digest, part)
