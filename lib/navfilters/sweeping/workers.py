"""Where chunks are computed: here, on the other cores, or on a cluster. In no certain order."""

import signal
from collections.abc import Callable, Iterator
from itertools import islice
from typing import Any

from navfilters._extras import needed

Call = Callable[[Any], Any]


def in_turn(call: Call, tasks: Iterator) -> Iterator:
    """One after the other, in this process."""
    yield from map(call, tasks)


def on_cores(call: Call, tasks: Iterator, workers: int, *, threads: bool) -> Iterator:
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


def on_cluster(call: Call, tasks: Iterator, client: Any) -> Iterator:
    """On a dask cluster. What a lost worker had is computed again by another."""
    dask = needed("dask", "navfilters[cluster]", "a sweep on a cluster")
    as_completed = needed("distributed", "navfilters[cluster]", "a sweep on a cluster").as_completed

    def submit(task):
        # A task carries its own configurations, so that no worker's loss takes them along.
        with dask.config.set({"distributed.admin.large-graph-warning-threshold": "1GB"}):
            return client.submit(call, task, pure=False)

    running = [submit(task) for task in islice(tasks, 2 * sum(client.ncores().values()))]
    done = as_completed(running)
    try:
        for future in done:
            yield future.result()
            running.remove(future)
            for task in islice(tasks, 1):
                running.append(submit(task))
                done.add(running[-1])
    finally:
        client.cancel(running)
