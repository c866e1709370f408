"""Some members of a sweep, all steps: what one process does in one go, whatever the engine."""

from collections.abc import Callable

import numpy as np

from navfilters.numerics.allocator import keep_freed_memory
from navfilters.numerics.small_matrices import WRITTEN_OUT
from navfilters.runs.march import Chunk, Job, Kept, March
from navfilters.runs.records import put


class SweepError(RuntimeError):
    """A filter or a model raised an exception: for which configuration, and which."""


def compute(job: Job, chunk: Chunk) -> Kept:
    """All steps of a chunk.

    Parameters
    ----------
    job : Job
    chunk : Chunk

    Returns
    -------
    Kept
        Of NumPy arrays.

    Raises
    ------
    SweepError
        What the filter or the model raised, naming the configuration that caused it.
    """
    go: Callable[[Job, list[np.ndarray]], Kept] = by_numpy
    if job.engine == "jax":
        from navfilters.runs.compiled import by_jax as go
    try:
        return go(job, chunk.arrays)
    except Exception as error:
        guilty = [chunk.members[0], chunk.members[-1]]  # JAX raises when it compiles: for all
        if job.engine == "numpy":
            guilty, error = _guilty(job, chunk, error)
        name = "configuration " + " to ".join(_name(job, member) for member in guilty)
        raise SweepError(f"{name}: {type(error).__name__}: {error}") from error


def by_numpy(job: Job, arrays: list[np.ndarray]) -> Kept:
    """All steps under NumPy."""
    keep_freed_memory()
    march = March(job, arrays)
    if march.prior.mean.shape[-1] <= WRITTEN_OUT:
        march = March(job, list(map(_members_innermost, arrays, job.axes)))
    with np.errstate(all="ignore"):  # a member that fails is NaN in the result: that is its report
        state, row = march.start()
        rows = put(None, row, 0, job.steps + 1)
        for k in range(job.steps):
            state, row = march.step(state, k)
            rows = put(rows, row, k + 1, job.steps + 1)
    return Kept(state, rows)


def _members_innermost(array: np.ndarray, axis: int | None) -> np.ndarray:
    """The same array in the order of memory that ``linalg`` likes for small states."""
    if axis is None:
        return array
    return np.moveaxis(np.ascontiguousarray(np.moveaxis(array, axis, -1)), -1, axis)


def _guilty(job: Job, chunk: Chunk, error: Exception) -> tuple[list[int], Exception]:
    """The first member that raises alone, found by halving; or the chunk's first and last."""
    first, last = 0, len(chunk.members)
    while last - first > 1:
        middle = (first + last) // 2
        for half in (slice(first, middle), slice(middle, last)):
            try:
                by_numpy(job, _some(job, chunk.arrays, half))
            except Exception as caught:
                first, last, error = half.start, half.stop, caught
                break
        else:  # only together
            return [int(chunk.members[first]), int(chunk.members[last - 1])], error
    return [int(chunk.members[first])], error


def _some(job: Job, arrays: list[np.ndarray], members: slice) -> list[np.ndarray]:
    return [
        array if axis is None else array[(*(slice(None),) * axis, members)]
        for array, axis in zip(arrays, job.axes, strict=True)
    ]


def _name(job: Job, member: int) -> str:
    """A member's index in the batch axes: a number where there is one axis."""
    index = tuple(int(i) for i in np.unravel_index(member, job.grid))
    return str(index[0] if len(index) == 1 else index)
