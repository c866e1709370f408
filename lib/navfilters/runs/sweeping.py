"""Many configurations at once: in chunks, on one of two engines, here or on a cluster.

::

    arguments --Problem--> chunks of members --engine, all steps--> what is kept --> Sweep
"""

from collections.abc import Callable, Collection, Iterator
from contextlib import closing, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal
from uuid import uuid4

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.extras import needed
from navfilters.runs import workers as places
from navfilters.runs.checkpoints import Checkpoint
from navfilters.runs.chunks import SweepError, compute
from navfilters.runs.march import Chunk, Job, Kept
from navfilters.runs.problems import WORTH_A_PROCESS, Problem, probe_models
from navfilters.runs.results import Results
from navfilters.types import Gaussian

__all__ = ["Sweep", "SweepError", "sweep"]

KEEP = ("final", "indefinite", "error", "history")


@dataclass(frozen=True, eq=False)
class Sweep:
    """What was kept of a sweep; None for what was not asked for.

    Parameters
    ----------
    final : Gaussian
        mean (..., n) and cov (..., n, n) after the last step, with all batch axes. Of a filter with
        a memory its last state, counters included; the Gaussian is its ``estimate``.
    indefinite : int array (...)
        The first step whose covariance is not positive definite, 0 for the prior, -1 for none.
    error : array (steps + 1, ...)
        Distance of the mean from the truth at each step, the prior's first.
    history : Gaussian
        mean (steps + 1, ..., n) and cov (steps + 1, ..., n, n), as of ``run``.
    """

    final: Any = None
    indefinite: np.ndarray | None = None
    error: np.ndarray | None = None
    history: Gaussian | None = None


def sweep(
    estimator: Any,
    priors: Gaussian,
    z: Any,
    model: Any,
    steps: int = 1000,
    *,
    engine: Literal["numpy", "jax"] = "numpy",
    keep: Collection[str] = ("final",),
    truth: Any = None,
    z_varies: bool = False,
    client: Any = None,
    workers: int | None = None,
    chunk: int | None = None,
    checkpoint: Any = None,
    progress: bool = True,
) -> Sweep:
    """Run a filter over many configurations and keep what is asked for.

    Parameters
    ----------
    estimator : callable or filter with a memory
        (prior, z, model) -> Gaussian, such as a member of ``FILTERS`` or a ``functools.partial`` of
        one; or ``init(prior) -> state`` and ``step(state, z, dynamics, sensor) -> state``, such as
        those of ``navfilters.estimators``. Options may be arrays, one value per configuration.
        Where its call, or its ``step``, has a parameter named ``step`` without a default, that is
        given the number of the step, from 0: an integer, traced under JAX.
    priors : Gaussian
        mean (..., n), cov (..., n, n). Leading axes are batch axes and broadcast with those of
        all other arguments: each member of the whole batch is one configuration.
    z : array (..., m), or (steps, ..., m) with z_varies
        The measurement: the same at every step, or one for each.
    model : MeasurementModel, or (dynamics, sensor) for a filter with a memory
        It has batch axes if its R, or its Q, has them. Then every array among its fields or
        attributes is a matrix (..., a, b), unless it is a dataclass whose field says
        ``field(metadata={"axes": number})``; what is in a closure is shared by all.
    steps : int
        How many steps.
    engine : {"numpy", "jax"}
        NumPy; or JAX, compiled for these shapes, on the device that it has.
    keep : collection of {"final", "indefinite", "error", "history"}
        What the result holds. "error" and "history" grow with the number of steps.
    truth : array (..., k), or (steps + 1, ..., k) with z_varies
        For "error": the true values of the first k components of the state.
    z_varies : bool
        Whether the first axis of z, and of truth, is the step.
    client : distributed.Client, optional
        Compute on its cluster; wait for its first worker, and say so.
    workers : int, optional
        Without a client: processes of this machine (threads for JAX), which need joblib. By default
        one per core if there is enough to do, and one without joblib.
    chunk : int, optional
        Configurations computed together; by default what fits the cache. JAX rounds it up.
    checkpoint : path, optional
        A folder for finished chunks: the same call again computes only those that are missing. The
        source of the filters is not compared: use another folder when it changes.
    progress : bool
        A bar with rate and time left, where standard error is a terminal and tqdm is installed.

    Returns
    -------
    Sweep
        A member that cannot go on is NaN, alone.

    Raises
    ------
    ValueError
        A wrong shape, a value that is not finite, a covariance that is not one, an unknown name,
        masked entries, a model's function that mixes configurations: before any step. A checkpoint
        file that is damaged or belongs to another sweep.
    TypeError
        An estimator that is none.
    SweepError
        The filter or the model raised an exception; names the configuration. Or a chunk whose
        result is missing, or is not of the shape and type of the first configuration's.
    TimeoutError
        A cluster without workers.
    KeyboardInterrupt
        Says how many configurations were finished, and whether they can be used.

    Notes
    -----
    A configuration's result depends neither on the others, nor on their order, nor on the workers;
    nor on the chunk, unless it is smaller than 512 under JAX, or than 2 under NumPy where products
    are left to BLAS (in a model, or with more than two states or measurements): then the last bits
    of each step may differ.

    A filter whose state is no Gaussian, such as the multiplicative EKF with its quaternion, is
    swept as one with a memory: ``priors`` are in the coordinates of its error, ``init`` makes a
    named tuple of arrays from them, and the ``estimate`` of that tuple is the Gaussian again. What
    differs from step to step is an array in the model, or in the filter, that ``step`` indexes.

    Examples
    --------
    >>> import numpy as np
    >>> from navfilters import FILTERS, Gaussian, sweep
    >>> from navfilters.models import RangeBearing
    >>> model = RangeBearing(np.diag([2.5e-5, 6e-3]))
    >>> priors = Gaussian(np.array([[20.0, 80.0], [90.0, 90.0]]), 1e4 * np.eye(2))
    >>> z = model.h(np.array([100.0, 100.0]))
    >>> sweep(FILTERS["EKF"], priors, z, model, steps=2).final.mean.round(2).tolist()
    [[55.32, 131.94], [100.0, 100.0]]
    """
    remembers = hasattr(estimator, "step")
    if not (remembers or callable(estimator)):
        raise TypeError(
            "estimator must be callable as estimator(prior, z, model), such as FILTERS['EKF'], or "
            f"have init and step; found {estimator!r}"
        )
    if remembers and not (isinstance(model, tuple) and len(model) == 2):
        raise ValueError(
            f"model must be (dynamics, sensor) for a filter with a memory; found {model!r}"
        )
    steps = validation.whole_number("steps", steps, 0)
    kinds = _keep(keep, truth)
    if engine not in ("numpy", "jax"):
        raise ValueError(f"engine must be 'numpy' or 'jax'; found {engine!r}")
    z_varies = validation.flag("z_varies", z_varies)
    workers, chunk = (
        None if value is None else validation.whole_number(name, value, 1)
        for name, value in (("workers", workers), ("chunk", chunk))
    )
    problem = Problem.of(estimator, priors, z, model, truth, steps, z_varies)
    job = Job(engine, problem.tree, problem.axes, problem.grid, steps, kinds, z_varies, uuid4().hex)
    results = Results(_probe(job, problem), problem.count, steps)
    size = min(chunk, problem.count) if chunk else problem.size(steps, results.series_bytes)
    if engine == "jax":
        from navfilters.runs.compiled import whole_blocks

        size = whole_blocks(size)
    store = None
    if checkpoint is not None:
        store = Checkpoint(checkpoint, job, problem.leaves, size, results.tree)
    _fill(results, job, problem, size, store, _place(job, problem, client, workers), progress)
    kept = results.collect(problem.batch)
    return Sweep(kept.final, kept.indefinite, kept.rows.error, kept.rows.history)


def _keep(keep: Collection[str], truth: Any) -> tuple[str, ...]:
    """The names, known and in their own order."""
    if isinstance(keep, str) or not keep or not set(keep) <= set(KEEP):
        raise ValueError(f"keep must be a collection of some of {list(KEEP)}; found {keep!r}")
    if ("error" in keep) != (truth is not None):
        found = "no truth" if truth is None else "a truth"
        raise ValueError(
            f"truth must be given if, and only if, keep has 'error'; found {found} and keep = "
            f"{keep!r}"
        )
    return tuple(name for name in KEEP if name in keep)


def _probe(job: Job, problem: Problem) -> Kept:
    """One step of the first configuration, once its model is known to be sound."""
    one = replace(job, engine="numpy", steps=min(job.steps, 1))
    with _doubles(job.engine):
        probe_models(one, problem)
        return compute(one, problem.chunk(0, 1))


def _doubles(engine: str) -> Any:
    """Where JAX's arrays are as they will be when it computes."""
    if engine == "numpy":
        return nullcontext()
    return needed("jax", "navfilters[jax]", 'engine="jax"').enable_x64(True)


def _place(job: Job, problem: Problem, client: Any, workers: int | None) -> Callable[..., Iterator]:
    """Where the chunks are computed."""
    if client is not None:
        return partial(places.on_cluster, client=client)
    if workers is None:
        workers = _default_workers(job.engine, problem.count * job.steps)
    if workers == 1:
        return places.in_turn
    return partial(places.on_cores, workers=workers, threads=job.engine == "jax")


def _default_workers(engine: str, updates: int) -> int:
    try:
        from joblib import cpu_count
    except ImportError:
        return 1
    if engine == "numpy":
        return cpu_count() if updates > WORTH_A_PROCESS else 1
    from navfilters.runs.compiled import on_processor

    return cpu_count() if on_processor() else 1


def _numbered(job: Job, chunk: Chunk) -> tuple[int, Kept]:
    return chunk.number, compute(job, chunk)


class _NoBar:
    """In the place of tqdm's bar where that is not installed."""

    def update(self, members: int) -> None:
        """Nothing to show."""

    def unpause(self) -> None:
        """Nothing to time."""


def _bar(total: int, progress: bool) -> Any:
    try:
        from tqdm import tqdm
    except ImportError:
        return nullcontext(_NoBar())
    hidden = None if progress else True  # None: unless standard error is a terminal
    return tqdm(total=total, unit=" configurations", disable=hidden)


def _fill(results, job, problem, size, store, place, progress) -> None:
    """Load the chunks that are stored and compute the others."""
    with _bar(problem.count, progress) as bar:
        missing = []
        results.missing = set(range(-(-problem.count // size)))
        for number in range(-(-problem.count // size)):
            kept = store.load(number) if store else None
            if kept is None:
                missing.append(number)
            else:
                bar.update(results.put(problem.chunk(number, size), kept))
        bar.unpause()  # the rate is that of computing
        tasks = (problem.chunk(number, size) for number in missing)
        try:
            with closing(place(partial(_numbered, job), tasks)) as done:
                for number, kept in done:
                    if store:
                        store.save(number, kept)
                    bar.update(results.put(problem.chunk(number, size), kept))
        except KeyboardInterrupt:
            where = "without a checkpoint folder they are lost"
            if store:
                where = f"they are in {store.folder}, and the same call goes on from there"
            raise KeyboardInterrupt(
                f"sweep stopped: {results.finished} of {problem.count} configurations were "
                f"finished; {where}"
            ) from None
