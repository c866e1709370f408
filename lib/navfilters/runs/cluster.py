"""Chunks on a dask cluster: what is lost is computed again, and what cannot go on is told."""

import asyncio
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from itertools import islice
from queue import Empty, SimpleQueue
from typing import Any

from navfilters.numerics.extras import needed
from navfilters.runs.chunks import SweepError
from navfilters.runs.march import Chunk

PATIENCE = 30.0
"""Seconds for which a sweep waits while no worker can work, or the scheduler is silent."""

PULSE = 1.0
"""Seconds after which a cluster is looked at again."""

LOSSES = 4
"""Times that all workers may be lost with no chunk finished in between. Dask counts these, too, but
not the workers that are told to end, as its nannies tell those whose memory is full."""

REMEDY = "Their logs may say why; if memory ran out, use a smaller chunk or give each worker more"


def on_cluster(call: Callable[[Chunk], Any], tasks: Iterator[Chunk], client: Any) -> Iterator[Any]:
    """On a dask cluster. What a lost worker had is computed again by another.

    Where there is no worker yet, this says so and waits, with one task submitted: a cluster that
    adapts itself starts a worker for it.

    Raises
    ------
    TimeoutError
        For a while no worker was there, or all were paused.
    ConnectionError
        The scheduler is gone or does not answer, or the client is gone.
    SweepError
        The workers of a chunk died one after the other.
    """
    dask = needed("dask", "navfilters[cluster]", "a sweep on a cluster")
    killed = needed("distributed", "navfilters[cluster]", "a sweep on a cluster").KilledWorker
    running: dict[Any, Chunk] = {}
    finished: SimpleQueue[tuple[Any, Any, BaseException | None]] = SimpleQueue()

    async def fetch(future: Any) -> None:
        # In the client's own thread, since it may take for ever: its worker may be lost now.
        try:
            finished.put((future, await client.gather(future, asynchronous=True), None))
        except BaseException as error:
            finished.put((future, None, error))

    def submit(task: Chunk) -> None:
        # A task carries its own configurations, so that no worker's loss takes them along.
        with dask.config.set({"distributed.admin.large-graph-warning-threshold": "1GB"}):
            future = client.submit(call, task, pure=False)
        running[future] = task
        client.loop.add_callback(fetch, future)

    if client.status != "running":
        raise ConnectionError(f"client must be connected to a cluster; found it {client.status}")
    watch = _Watch(client)
    try:
        while True:
            watch.look()
            with _loss_is_told(client, watch.address):
                for task in islice(tasks, max(0, watch.wanted - len(running))):
                    submit(task)
            if not running:
                return
            try:
                future, result, error = finished.get(timeout=PULSE)
            except Empty:
                continue
            if isinstance(error, killed):
                raise SweepError(f"{_named(running[future])}: {error} {REMEDY}.") from error
            if error is not None:
                with _loss_is_told(client, watch.address):
                    raise error
            del running[future]
            yield result
            watch.reset()
    except ConnectionError:
        running.clear()  # there is none who could cancel them
        raise
    finally:
        if running:
            client.cancel(list(running))


def _named(chunk: Chunk) -> str:
    return f"chunk {chunk.number}, configurations {chunk.members[0]} to {chunk.members[-1]}"


@contextmanager
def _loss_is_told(client: Any, address: str) -> Iterator[None]:
    """What dask raises, in many kinds, once its scheduler or its client is gone."""
    try:
        yield
    except (Exception, asyncio.CancelledError) as error:
        kinds = OSError | CancelledError | asyncio.CancelledError
        if client.status == "running" and not isinstance(error, kinds):
            raise
        why = " ".join(f"{type(error).__name__}: {error}".split())
        raise ConnectionError(f"the cluster at {address} has lost this work ({why})") from error


class _Watch:
    """Whether a cluster can still be expected to finish a chunk.

    Parameters
    ----------
    client : distributed.Client
    """

    def __init__(self, client: Any) -> None:
        self.client, self.address = client, client.scheduler.address
        self.workers: dict[tuple[str, str], Any] = {}
        self.looked = -PULSE
        self.reset()

    def reset(self) -> None:
        """A chunk was finished."""
        self.able, self.lost, self.most, self.said = time.monotonic(), 0, len(self.workers), False

    @property
    def wanted(self) -> int:
        """Chunks that keep all cores at work, and one where there is none yet."""
        return max(1, 2 * sum(worker["nthreads"] for worker in self.workers.values()))

    def look(self) -> None:
        """Who is there now, unless that was asked a moment ago; raise if it is hopeless."""
        now = time.monotonic()
        if now - self.looked < PULSE:
            return
        with _loss_is_told(self.client, self.address):
            ask = self.client.scheduler.identity
            found = self.client.sync(ask, callback_timeout=PATIENCE)["workers"]
        # A worker that is started again may have the address of the one before, but not its folder.
        workers = {(where, worker["local_directory"]): worker for where, worker in found.items()}
        if any(map(_can_work, (workers[name] for name in workers.keys() & self.workers.keys()))):
            self.able = now
        self.lost += len(self.workers.keys() - workers.keys())
        self.most = max(self.most, len(workers))
        self.workers, self.looked = workers, now
        if not workers and not self.said:
            self.said = True
            sys.stderr.write(
                f"sweep waits for workers of the cluster at {self.address}, which has none; at "
                f"most {PATIENCE:g} s\n"
            )
            sys.stderr.flush()
        self.judge()

    def judge(self) -> None:
        """Raise if too many were lost since a chunk was finished, or if no one can work."""
        if self.lost > LOSSES * self.most:
            raise SweepError(
                f"the cluster at {self.address} lost {self.lost} workers, and no chunk was "
                f"finished in between. {REMEDY}."
            )
        if time.monotonic() - self.able <= PATIENCE:
            return
        if self.workers:
            raise TimeoutError(
                f"client must have workers that can work; the {len(self.workers)} at "
                f"{self.address} could not for {PATIENCE:g} s: a worker pauses while its memory is "
                "full. Use a smaller chunk or give each worker more memory"
            )
        why = "Where they may take longer, call client.wait_for_workers(1) first"
        if self.lost:
            why = f"The {self.lost} that it had are gone. {REMEDY}"
        raise TimeoutError(
            f"client must have workers; found none at {self.address} after {PATIENCE:g} s. {why}"
        )


def _can_work(worker: dict[str, Any]) -> bool:
    """One that is paused finishes what it has begun."""
    return worker["status"] != "paused" or worker["metrics"]["task_counts"].get("executing", 0) > 0
