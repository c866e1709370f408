"""Where chunks are computed on this machine: here or on the other cores. In no certain order."""

import signal
from collections.abc import Callable, Iterator
from typing import Any

from navfilters.numerics.extras import needed

Call = Callable[[Any], Any]


def in_turn(call: Call, tasks: Iterator[Any]) -> Iterator[Any]:
    """One after the other, in this process."""
    yield from map(call, tasks)


def on_cores(call: Call, tasks: Iterator[Any], workers: int, *, threads: bool) -> Iterator[Any]:
    """In so many processes or threads; a few tasks at a time are taken from the iterator."""
    joblib = needed("joblib", "navfilters[sweep]", "a sweep with workers")
    options: dict[str, Any] = {"backend": "threading"}
    if not threads:
        options = {"backend": "loky", "max_nbytes": None, "initializer": _leave_ctrl_c_to_parent}
    pool = joblib.Parallel(workers, return_as="generator_unordered", batch_size=1, **options)
    return pool(joblib.delayed(call)(task) for task in tasks)


def _leave_ctrl_c_to_parent() -> None:
    """A terminal tells every process; the parent ends its workers without their tracebacks."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
