"""Many configurations at once: in chunks, on one of two engines, here or on a cluster.

::

    arguments --Problem--> chunks of members --engine, all steps--> what is kept --> Sweep
"""

from collections.abc import Callable, Iterator
from contextlib import closing, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal
from uuid import uuid4

from navfilters._moved import refuse_old_keywords
from navfilters.estimators import model_parts
from navfilters.estimators.any_filter import as_filter
from navfilters.estimators.filter import Filter
from navfilters.numerics import validation
from navfilters.numerics.extras import needed
from navfilters.runs import model_checks
from navfilters.runs import workers as places
from navfilters.runs.checkpoints import Checkpoint
from navfilters.runs.chunks import SweepError, compute
from navfilters.runs.cluster import on_cluster
from navfilters.runs.locked_folder import alone_in
from navfilters.runs.march import Chunk, Job, Kept
from navfilters.runs.problems import WORTH_A_PROCESS, Problem, first_step
from navfilters.runs.results import Results
from navfilters.types import Gaussian

__all__ = ["Sweep", "SweepError", "sweep"]


@dataclass(frozen=True, eq=False)
class Sweep:
    """What was kept of a sweep.

    Parameters
    ----------
    state : named tuple
        The last state, with all batch axes; counters included.
    record : as ``record`` returns it, optional
        Of the prior and of every step, (steps + 1, ...).
    """

    state: Any
    record: Any = None

    @property
    def final(self) -> Gaussian:
        """The last estimate: mean (..., n) and cov (..., n, n)."""
        return self.state.estimate


def sweep(
    estimator: Any,
    priors: Gaussian,
    z: Any,
    model: Any,
    steps: int | None = None,
    *,
    dynamics: Any = None,
    z_per_step: bool = False,
    record: Callable[[Any], Any] | None = None,
    engine: Literal["numpy", "jax"] = "numpy",
    client: Any = None,
    workers: int | None = None,
    chunk: int | None = None,
    checkpoint: Any = None,
    progress: bool | Callable[[int], Any] = True,
    **old: Any,
) -> Sweep:
    """Run a filter over many configurations and keep what is asked for.

    Parameters
    ----------
    estimator : Filter, or whatever :func:`~navfilters.estimators.any_filter.as_filter` takes
        As of :func:`~navfilters.runs.loop.run`. Options may be arrays, one value per configuration.
    priors : Gaussian
        mean (..., n), cov (..., n, n). Leading axes are batch axes and broadcast with those of
        all other arguments: each member of the whole batch is one configuration.
    z : array (..., m), or (steps, ..., m) with z_per_step
        The measurement: the same at every step, or one for each; NaN where it was not measured.
    model : MeasurementModel
        It has batch axes if its R has them. Then every array among its fields or attributes is a
        matrix (..., a, b), unless it is a dataclass whose field says
        ``field(metadata={"axes": number})``; what is in a closure is shared by all.
    steps : int, optional
        By default as many as z has with z_per_step, otherwise 1000.
    dynamics : Dynamics, optional
        Each step begins with a prediction. It has batch axes if its Q has them.
    z_per_step : bool
        Whether the first axis of z is the step.
    record : callable, optional
        What to keep of the prior and of every step, as of ``run``: see ``navfilters.runs.records``.
        By default nothing but the last state.
    engine : {"numpy", "jax"}
        NumPy; or JAX, compiled for these shapes, on the device that it has.
    client : distributed.Client, optional
        Compute on its cluster; wait for its first worker, and say so.
    workers : int, optional
        Without a client: processes of this machine (threads for JAX), which need joblib. By default
        one per core if there is enough to do, and one without joblib.
    chunk : int, optional
        Configurations computed together; by default what fits the cache. JAX rounds it up.
    checkpoint : path, optional
        A folder for finished chunks: the same call again computes only those that are missing. Of
        the source of filters and models only the numbers are compared that it reads by global names
        or has as attributes of classes: use another folder when the rest changes.
    progress : bool or callable
        A bar with rate and time left, where standard error is a terminal and tqdm is installed; or
        who is told of every chunk how many configurations it has finished.

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
        workers died one after the other, whose result is missing, or is not of the shape and type
        of the first configuration's.
    TimeoutError
        A cluster that for half a minute has no workers, or none whose memory is not full.
    ConnectionError
        A cluster whose scheduler is gone, or a client that was closed.
    OSError
        A checkpoint folder that cannot be written, or in which another process is at work
        (BlockingIOError).
    KeyboardInterrupt
        Says, as the two errors of a cluster do, how many configurations were finished, and whether
        they can be used.

    Notes
    -----
    A configuration's result depends neither on the others, nor on their order, nor on the workers;
    nor on the chunk, unless it is smaller than 128 under JAX, or than 2 under NumPy where products
    are left to BLAS (in a model, or with more than two states or measurements): then the last bits
    of each step may differ.

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
    refuse_old_keywords("sweep", old)
    estimator = as_filter(estimator)
    if engine not in ("numpy", "jax"):
        raise ValueError(f"engine must be 'numpy' or 'jax'; found {engine!r}")
    if callable(z):
        raise TypeError("z must be an array in a sweep; run takes a function that measures")
    if record is not None and not callable(record):
        raise TypeError(f"record must be callable as record(state); found {record!r}")
    z_per_step = validation.flag("z_per_step", z_per_step)
    steps = model_checks.number_of_steps(steps, z, z_per_step)
    workers, chunk = (
        None if value is None else validation.whole_number(name, value, 1)
        for name, value in (("workers", workers), ("chunk", chunk))
    )
    problem = Problem.of(estimator, priors, z, model, dynamics, record, steps, z_per_step)
    if steps and isinstance(estimator, Filter):
        model_checks.measures(model)
    complete = problem.complete and not hasattr(model_parts.at(model, 0), "given")
    shared = problem.tree, problem.axes, problem.grid, steps, z_per_step, complete
    job = Job(engine, *shared, uuid4().hex)
    with _doubles(engine):
        first = first_step(job, problem)
    results = Results(first, problem.count, steps)
    size = min(chunk, problem.count) if chunk else problem.size(steps, results.series_bytes)
    if engine == "jax":
        from navfilters.runs.compiled import whole_blocks

        size = whole_blocks(size)
    store = None
    alone: Any = nullcontext()
    if checkpoint is not None:
        store = Checkpoint(checkpoint, job, problem.leaves, size, results.tree)
        alone = alone_in(store.folder)
    with alone:
        _fill(results, job, problem, size, store, _place(job, problem, client, workers), progress)
    return Sweep(*results.collect(problem.batch))


def _doubles(engine: str) -> Any:
    """Where JAX's arrays are as they will be when it computes."""
    if engine == "numpy":
        return nullcontext()
    return needed("jax", "navfilters[jax]", 'engine="jax"').enable_x64(True)


def _place(
    job: Job, problem: Problem, client: Any, workers: int | None
) -> Callable[..., Iterator[Any]]:
    """Where the chunks are computed."""
    if client is not None:
        return partial(on_cluster, client=client)
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
    """In the place of tqdm's bar where that is not installed, or another is told."""

    def __init__(self, told: Callable[[int], Any] | None = None) -> None:
        self.told = told

    def update(self, members: int) -> None:
        """Pass it on."""
        if self.told is not None:
            self.told(members)

    def unpause(self) -> None:
        """Nothing to time."""


def _bar(total: int, progress: bool | Callable[[int], Any]) -> Any:
    if callable(progress) or not progress:
        return nullcontext(_NoBar(progress or None))
    try:
        from tqdm import tqdm
    except ImportError:
        return nullcontext(_NoBar())
    return tqdm(total=total, unit=" configurations", disable=None)  # unless it is no terminal


def _fill(
    results: Results,
    job: Job,
    problem: Problem,
    size: int,
    store: Checkpoint | None,
    place: Callable[..., Any],
    progress: bool | Callable[[int], Any],
) -> None:
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
        except (KeyboardInterrupt, ConnectionError, TimeoutError) as stop:
            where = "without a checkpoint folder they are lost"
            if store:
                where = f"they are in {store.folder}, and the same call goes on from there"
            why = f"{stop}. " * bool(str(stop))
            raise type(stop)(
                f"sweep stopped: {why}{results.finished} of {problem.count} configurations were "
                f"finished; {where}"
            ) from stop.__cause__
