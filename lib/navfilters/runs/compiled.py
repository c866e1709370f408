"""The JAX engine: the same steps in one compiled scan, on whatever device JAX has."""

import threading
from functools import lru_cache
from typing import Any

import numpy as np

from navfilters.numerics.extras import missing
from navfilters.runs.march import Job, Kept, March, Row
from navfilters.runs.trees import Tree

try:
    import jax
    import jax.numpy as jnp
except ImportError as error:
    raise missing("jax", "navfilters[jax]", 'engine="jax"', error) from None

BLOCK = 512
"""Members that a processor's core takes through all steps at once: their arrays stay in its cache,
and since every block is the same program, a member's result does not depend on the chunk's size."""

_compiling = threading.Lock()


def on_processor() -> bool:
    """Whether JAX computes on the processor, not on an accelerator."""
    return jax.default_backend() == "cpu"


def whole_blocks(size: int) -> int:
    """The next size that consists of whole blocks, if it is more than one."""
    return size if size <= BLOCK else -(-size // BLOCK) * BLOCK


def by_jax(job: Job, arrays: list[np.ndarray]) -> Kept:
    """All steps, compiled once per structure and shape.

    Parameters
    ----------
    job : Job
    arrays : list of ndarray
        The leaves of its tree.

    Returns
    -------
    Kept
        Of NumPy arrays.
    """
    with jax.enable_x64(True):
        with _compiling:  # two threads would both compile
            tree = job.tree if job.tree.constant else _Once(job.tree, job.sweep)
            key = (tree, job.axes, job.steps, job.keep, job.z_varies)
            run = _program(key, tuple((a.shape, a.dtype) for a in arrays))
        return jax.tree.map(np.asarray, run(arrays))


class _Once:
    """A tree with something in it that may change between two sweeps without being another.

    Parameters
    ----------
    tree : Tree
    sweep : str
        What it is compiled for.
    """

    def __init__(self, tree: Tree, sweep: str) -> None:
        self.tree, self.sweep = tree, sweep

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Once) and self.sweep == other.sweep

    def __hash__(self) -> int:
        return hash(self.sweep)


@lru_cache(maxsize=64)
def _program(key: tuple, shapes: tuple) -> Any:
    """The executable of a job for arrays of these shapes."""
    tree, axes, steps, keep, z_varies = key
    if isinstance(tree, _Once):
        tree = tree.tree
    job = Job("jax", tree, axes, (), steps, keep, z_varies)
    arguments = [jax.ShapeDtypeStruct(*shape) for shape in shapes]
    return jax.jit(lambda arrays: _in_blocks(job, arrays)).lower(arguments).compile()


def _in_blocks(job: Job, arrays: list[jax.Array]) -> Kept:
    """Block after block, so that each goes through all its steps in the cache."""
    members = next(a.shape[i] for a, i in zip(arrays, job.axes, strict=True) if i is not None)
    if not on_processor() or members <= BLOCK:
        return _scan(job, arrays)
    split = [
        None if axis is None else _split(array, axis)
        for array, axis in zip(arrays, job.axes, strict=True)
    ]

    def block(mine: list) -> Kept:
        return _scan(job, [a if m is None else m for a, m in zip(arrays, mine, strict=True)])

    kept = jax.lax.map(block, split)
    final, indefinite = jax.tree.map(lambda a: _join(a, 0), (kept.final, kept.indefinite))
    return Kept(final, indefinite, jax.tree.map(lambda a: _join(a, 1), kept.rows))


def _split(array: jax.Array, axis: int) -> jax.Array:
    """Blocks of the members on an axis, on a new axis in front."""
    shape = array.shape
    return jnp.moveaxis(array.reshape(*shape[:axis], -1, BLOCK, *shape[axis + 1 :]), axis, 0)


def _join(array: jax.Array, axis: int) -> jax.Array:
    """The inverse of a split."""
    array = jnp.moveaxis(array, 0, axis)
    return array.reshape(*array.shape[:axis], -1, *array.shape[axis + 2 :])


def _scan(job: Job, arrays: list[jax.Array]) -> Kept:
    """All steps of some members."""
    march = March(job, arrays)
    carry, row = march.start()
    rows = jax.tree.map(lambda a: a[None], row)
    first = 1
    if job.steps and not _alike(carry, jax.eval_shape(lambda c: march.step(c, 1)[0], carry)):
        # A filter may begin with None where it will have an array: its first step is another's.
        carry, row = march.step(carry, 1)
        rows = jax.tree.map(lambda old, new: jnp.concat([old, new[None]]), rows, row)
        first = 2
    if job.steps >= first:
        z, truth = march.z, march.truth
        series = jnp.arange(first, job.steps + 1), None, None
        if job.z_varies:
            series = series[0], z[first - 1 :], None if truth is None else truth[first:]

        def step(carry, now):
            k, z_k, truth_k = now
            if not job.z_varies:
                z_k, truth_k = z, truth
            return march.advance(carry, k, z_k, truth_k)

        carry, more = jax.lax.scan(step, carry, series)
        rows = jax.tree.map(lambda old, new: jnp.concat([old, new]), rows, more)
    return march.finish(carry, Row(*rows))


def _alike(before: Any, after: Any) -> bool:
    """Whether two carries have the same structure, shapes and types."""
    first, second = (
        (jax.tree.structure(carry), [(leaf.shape, leaf.dtype) for leaf in jax.tree.leaves(carry)])
        for carry in (before, after)
    )
    return first == second
