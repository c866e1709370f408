"""The JAX engine: the same steps in one compiled scan, on whatever device JAX has."""

import threading
from functools import lru_cache
from typing import Any

import numpy as np

from navfilters.estimators.any_filter import Memoryless
from navfilters.estimators.filter import Filter
from navfilters.estimators.update import COMPLETE
from navfilters.numerics.extras import missing
from navfilters.runs.march import Job, Kept, March
from navfilters.runs.surroundings import Surroundings
from navfilters.runs.trees import Tree

try:
    import jax
    import jax.numpy as jnp
except ImportError as error:
    raise missing("jax", "navfilters[jax]", 'engine="jax"', error) from None

BLOCK = 128
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
            around = Surroundings.of(job.tree).key
            tree = _Once(job.tree, job.sweep) if around is None else job.tree
            key = (tree, around, job.axes, job.steps, job.z_per_step, job.complete)
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
def _program(key: tuple[Any, ...], shapes: tuple[Any, ...]) -> Any:
    """The executable of a job for arrays of these shapes."""
    tree, _, axes, steps, z_per_step, complete = key
    if isinstance(tree, _Once):
        tree = tree.tree
    job = Job("jax", tree, axes, (), steps, z_per_step)
    arguments = [jax.ShapeDtypeStruct(*shape) for shape in shapes]
    token = COMPLETE.set(complete)
    try:
        return jax.jit(lambda arrays: _in_blocks(job, arrays)).lower(arguments).compile()
    finally:
        COMPLETE.reset(token)


def _in_blocks(job: Job, arrays: list[jax.Array]) -> Kept:
    """Block after block, so that each goes through all its steps in the cache."""
    members = next(a.shape[i] for a, i in zip(arrays, job.axes, strict=True) if i is not None)
    if not on_processor() or members <= BLOCK:
        return _scan(job, arrays)
    split = [
        None if axis is None else _split(array, axis)
        for array, axis in zip(arrays, job.axes, strict=True)
    ]

    def block(mine: list[Any]) -> Kept:
        return _scan(job, [a if m is None else m for a, m in zip(arrays, mine, strict=True)])

    kept = jax.lax.map(block, split)
    return Kept(
        jax.tree.map(lambda a: _join(a, 0), kept.state),
        jax.tree.map(lambda a: _join(a, 1), kept.rows),
    )


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
    state, row = march.start()
    rows = jax.tree.map(lambda a: a[None], row)
    first, last = 0, job.steps
    ours = isinstance(march.filter, Filter | Memoryless)

    def carried(state: Any) -> Any:
        """Without what our own filters only tell: to carry it costs a tenth of a step."""
        return state._replace(innovation=None, S=None) if ours else state

    def below(rows: Any, row: Any) -> Any:
        return _below(rows, jax.tree.map(lambda a: a[None], row))

    def z(k: int) -> jax.Array:
        return march.z[k] if job.z_per_step else march.z

    if job.steps == 1:
        state, row = march.step(state, 0)
        return Kept(state, below(rows, row))
    advance = jax.jit(march.advance)  # traced once for its shapes, the scan and the last step
    after = jax.eval_shape(advance, state, np.int64(0), z(0))[0] if job.steps else state
    if not _alike(carried(state), carried(after)):
        # A filter may begin with None where it will have an array: its first step is another's.
        state, row = march.step(state, 0)
        rows, first = below(rows, row), 1
    last -= ours and last > first
    if last > first:
        numbers = jnp.arange(first, last)
        series = (numbers, march.z[first:last] if job.z_per_step else None)

        def step(state: Any, now: Any) -> tuple[Any, Any]:
            k, z = now
            state, row = advance(state, k, z if job.z_per_step else march.z)
            return carried(state), row

        state, more = jax.lax.scan(step, carried(state), series)
        rows = _below(rows, more)
    if job.steps > last:
        state, row = advance(state, np.int64(last), z(last))
        rows = below(rows, row)
    return Kept(state, rows)


def _below(rows: Any, more: Any) -> Any:
    """One record below the other; what was None is NaN."""
    if more is None:
        return None
    if isinstance(more, tuple):
        olds = (None,) * len(more) if rows is None else rows
        parts = [_below(old, new) for old, new in zip(olds, more, strict=True)]
        return type(more)(*parts) if hasattr(more, "_fields") else tuple(parts)
    blank = jnp.nan if more.dtype.kind in "fc" else 0
    if rows is None:
        rows = jnp.full((1, *more.shape[1:]), blank, more.dtype)
    return jnp.concat([rows, more])


def _alike(before: Any, after: Any) -> bool:
    """Whether two carries have the same structure, shapes and types."""
    first, second = (
        (jax.tree.structure(carry), [(leaf.shape, leaf.dtype) for leaf in jax.tree.leaves(carry)])
        for carry in (before, after)
    )
    return first == second
