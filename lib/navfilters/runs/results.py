"""What a sweep keeps, filled in chunk by chunk: never with less than was asked for."""

from typing import Any

import numpy as np

from navfilters.runs.chunks import SweepError
from navfilters.runs.march import Chunk, Kept
from navfilters.runs.trees import flatten, unflatten


class Results:
    """What is kept of all members, to be filled in chunk by chunk."""

    def __init__(self, like: Kept, count: int, steps: int) -> None:
        self.tree, leaves = flatten("kept", like, None)
        self.leaves = leaves
        self.axes = [int(leaf.name.startswith("kept.rows")) for leaf in leaves]
        single = [leaf.array.shape[i] == 1 for leaf, i in zip(leaves, self.axes, strict=True)]
        if not (all(single) and self.tree.only_arrays):
            found = {leaf.name.removeprefix("kept."): leaf.array.shape for leaf in leaves}
            raise ValueError(
                "estimator must return arrays whose first axis is that of the configurations; "
                f"found {found or 'none'} for one configuration"
            )
        self.arrays = [
            np.empty((*(steps + 1,) * i, count, *leaf.array.shape[i + 1 :]), leaf.array.dtype)
            for leaf, i in zip(leaves, self.axes, strict=True)
        ]
        self.count, self.finished = count, 0
        self.missing: set[int] = set()

    @property
    def series_bytes(self) -> int:
        """Size of the rows that are kept, per member."""
        rows = [a.nbytes for a, i in zip(self.arrays, self.axes, strict=True) if i]
        return sum(rows) // self.count

    def put(self, chunk: Chunk, kept: Kept) -> int:
        """Fill in a chunk, whose results must be what the first configuration's are."""
        tree, leaves = flatten("kept", kept, None)
        first = int(chunk.members[0])
        members = int(chunk.members[-1]) + 1 - first
        found = {leaf.name: (leaf.array.shape, leaf.array.dtype) for leaf in leaves}
        wanted = {
            leaf.name: ((*a.shape[:i], len(chunk.members), *a.shape[i + 1 :]), a.dtype)
            for leaf, a, i in zip(self.leaves, self.arrays, self.axes, strict=True)
        }
        if tree != self.tree or found != wanted:
            raise SweepError(
                f"chunk {chunk.number}, configurations {first} to {first + members - 1}: estimator "
                f"must return arrays of shapes and types {_shown(wanted)}, as of the first "
                f"configuration; found {_shown(found)}"
            )
        for array, leaf, i in zip(self.arrays, leaves, self.axes, strict=True):
            lead = (slice(None),) * i
            array[(*lead, slice(first, first + members))] = leaf.array[(*lead, slice(members))]
        self.finished += members
        self.missing.discard(chunk.number)
        return members

    def collect(self, batch: tuple[int, ...]) -> Kept:
        """All of it, with the batch axes of the sweep; SweepError while a chunk is missing."""
        if self.missing:
            first = sorted(self.missing)[:9]
            raise SweepError(
                f"sweep must have every chunk; found {len(self.missing)} that never arrived: "
                f"{', '.join(map(str, first))}{', ...' * (len(self.missing) > 9)}"
            )
        shaped = [
            a.reshape((*a.shape[:i], *batch, *a.shape[i + 1 :]))
            for a, i in zip(self.arrays, self.axes, strict=True)
        ]
        return unflatten(self.tree, shaped)


def _shown(kept: dict[str, tuple[Any, ...]]) -> str:
    return ", ".join(
        f"{name.removeprefix('kept.')} {shape} {dtype}" for name, (shape, dtype) in kept.items()
    )
