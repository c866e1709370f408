"""Where chunks are computed: here, on the other cores, or on a cluster. In no certain order."""

import signal
import sys
import time
from collections.abc import Callable, Iterator
from itertools import islice
from typing import Any

from navfilters.numerics.extras import needed

Call = Callable[[Any], Any]

PATIENCE = 30.0
"""Seconds for which a sweep waits for the first worker of a cluster."""


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


def on_cluster(call: Call, tasks: Iterator[Any], client: Any) -> Iterator[Any]:
    """On a dask cluster. What a lost worker had is computed again by another.

    Where there is no worker yet, this says so and waits, with one task submitted: a cluster that
    adapts itself starts a worker for it. TimeoutError if none arrives.
    """
    dask = needed("dask", "navfilters[cluster]", "a sweep on a cluster")
    as_completed = needed("distributed", "navfilters[cluster]", "a sweep on a cluster").as_completed

    def submit(task: Any) -> Any:
        # A task carries its own configurations, so that no worker's loss takes them along.
        with dask.config.set({"distributed.admin.large-graph-warning-threshold": "1GB"}):
            return client.submit(call, task, pure=False)

    def wanted() -> int:
        return max(1, 2 * sum(client.ncores().values()))

    running = [submit(task) for task in islice(tasks, 1)]
    done = as_completed(running)
    try:
        if running:
            _wait_for_worker(client)
        while running:
            for task in islice(tasks, max(0, wanted() - len(running))):
                running.append(submit(task))
                done.add(running[-1])
            future = next(done)
            yield future.result()
            running.remove(future)
    finally:
        client.cancel(running)


def _wait_for_worker(client: Any) -> None:
    if client.ncores():
        return
    where = client.scheduler.address
    sys.stderr.write(
        f"sweep waits for workers of the cluster at {where}, which has none yet; at most "
        f"{PATIENCE:g} s\n"
    )
    sys.stderr.flush()
    until = time.monotonic() + PATIENCE
    while not client.ncores():
        if time.monotonic() > until:
            raise TimeoutError(
                f"client must have workers; found none at {where} after {PATIENCE:g} s. Where they "
                "may take longer, call client.wait_for_workers(1) first"
            )
        time.sleep(0.1)
