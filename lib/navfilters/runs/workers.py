"""Where chunks are computed on this machine: here or on the other cores. In no certain order."""

import signal
from collections.abc import Callable, Iterator
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from navfilters.numerics.extras import needed
from navfilters.runs.chunks import SweepError

Call = Callable[[Any], Any]


def in_turn(call: Call, tasks: Iterator[Any]) -> Iterator[Any]:
    """One after the other, in this process."""
    yield from map(call, tasks)


def on_cores(call: Call, tasks: Iterator[Any], workers: int, *, threads: bool) -> Iterator[Any]:
    """In so many processes or threads; a few tasks at a time are taken from the iterator.

    Raises
    ------
    SweepError
        A process has died.
    """
    joblib = needed("joblib", "navfilters[sweep]", "a sweep with workers")
    options: dict[str, Any] = {"backend": "threading"}
    if not threads:
        options = {"backend": "loky", "max_nbytes": None, "initializer": _leave_ctrl_c_to_parent}
    pool = joblib.Parallel(workers, return_as="generator_unordered", batch_size=1, **options)
    try:
        yield from pool(joblib.delayed(call)(task) for task in tasks)
    except BrokenProcessPool as error:
        raise SweepError(
            "a process of this sweep has died. If memory ran out, use fewer workers or a smaller "
            "chunk. With a checkpoint folder, the same call goes on with the chunks it has finished"
        ) from error


def _leave_ctrl_c_to_parent() -> None:
    """A terminal tells every process; the parent ends its workers without their tracebacks."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
