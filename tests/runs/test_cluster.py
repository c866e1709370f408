"""A cluster that loses its workers, its memory or its scheduler: all is computed once, or told."""

import asyncio
import os
import re
from types import SimpleNamespace

import dask
import numpy as np
import pytest
from distributed import Client, LocalCluster
from distributed.core import Status
from sweeps import BASE, EKF, LOCAL, assert_same, priors

from navfilters import SweepError, sweep
from navfilters.runs import cluster as ours

TWO = {"n_workers": 2, "threads_per_worker": 1, "memory_limit": 0, **LOCAL}


def swept(count=60, estimator=EKF, **options):
    options = {"steps": 4, "chunk": 7, "progress": False, **options}
    return sweep(estimator, priors(count), BASE.z, BASE.model, **options)


@pytest.fixture
def threads(monkeypatch):
    """A cluster of two workers that are threads, and a sweep that has little patience."""
    monkeypatch.setattr(ours, "PATIENCE", 0.5)
    monkeypatch.setattr(ours, "PULSE", 0.1)
    with LocalCluster(processes=False, **TWO) as cluster, Client(cluster) as client:
        yield client


# --- the scheduler ------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_scheduler_that_is_lost_is_told_and_another_goes_on(tmp_path):
    def lose(members):
        done.append(members)
        if sum(done) == 21:
            cluster.close()

    done = []
    with LocalCluster(processes=False, **TWO) as cluster, Client(cluster) as client:
        where = f"the cluster at {cluster.scheduler_address} has lost this work .*"
        with pytest.raises(ConnectionError, match=rf"stopped: {where}\d+ of 60 config") as told:
            swept(client=client, checkpoint=tmp_path, progress=lose)
    assert f"{sum(done)} of 60 configurations were finished; they are in {tmp_path}" in str(
        told.value
    )
    stored, again = len(list(tmp_path.glob("*.npz"))), []
    assert 7 * stored == sum(done)
    with LocalCluster(processes=False, **TWO) as cluster, Client(cluster) as client:
        got = swept(client=client, checkpoint=tmp_path, progress=again.append)
    assert sum(again) == 60
    assert_same(got.final, swept().final)


@pytest.mark.slow
def test_a_scheduler_that_is_silent_is_not_waited_for_for_ever(threads, monkeypatch):
    async def silent():
        await asyncio.sleep(60)

    def fall_silent(_):
        monkeypatch.setattr(threads.scheduler, "identity", silent)

    where = re.escape(f"the cluster at {threads.cluster.scheduler_address} has lost this work")
    with pytest.raises(ConnectionError, match=rf"{where} \(TimeoutError: timed out after 0.5 s"):
        swept(400, client=threads, progress=fall_silent)


@pytest.mark.slow
def test_a_client_that_is_closed_on_the_way_is_told(threads):
    with pytest.raises(ConnectionError, match="has lost this work"):
        swept(400, client=threads, progress=lambda _: threads.close())


def test_a_client_that_is_closed_is_refused():
    with pytest.raises(ConnectionError, match="must be connected to a cluster; found it closed"):
        swept(client=SimpleNamespace(status="closed"))


# --- the workers --------------------------------------------------------------------------------


def dies(prior, z, model):
    """A filter that ends its process where a certain configuration is among several."""
    if len(prior.mean) > 3 and (prior.mean == priors(60).mean[38]).any():
        os._exit(1)
    return EKF(prior, z, model)


@pytest.mark.slow
def test_a_chunk_that_kills_its_workers_is_named():
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        LocalCluster(processes=True, **TWO) as cluster,
        Client(cluster) as client,
        pytest.raises(SweepError, match=r"configurations .* died while running.*smaller chunk"),
    ):
        swept(estimator=dies, client=client)


@pytest.mark.slow
def test_workers_that_all_leave_are_not_waited_for_for_ever(threads, tmp_path):
    options = {"client": threads, "checkpoint": tmp_path}
    with pytest.raises(
        TimeoutError, match=r"none at .* gone\. .* smaller chunk .* finished; they are in"
    ):
        swept(400, progress=lambda _: threads.cluster.scale(0), **options)
    threads.cluster.scale(1)
    assert_same(swept(400, **options).final, swept(400).final)


@pytest.mark.slow
def test_workers_that_all_pause_are_not_waited_for_for_ever(threads):
    def pause(_):
        for worker in threads.cluster.workers.values():
            worker.status = Status.paused

    with pytest.raises(TimeoutError, match=r"the 2 at .* a worker pauses while its memory is full"):
        swept(400, client=threads, progress=pause)


class Seen:
    """A client to whom a cluster shows other workers at each look."""

    status = "running"
    scheduler = SimpleNamespace(address="there", identity=None)

    def __init__(self, *looks):
        self.looks = iter(looks)

    def sync(self, _, callback_timeout):
        return {"workers": next(self.looks)}


def worker(number, status="running", executing=0):
    """As the scheduler tells of it."""
    metrics = {"task_counts": {"executing": executing} if executing else {}}
    told = {"status": status, "metrics": metrics, "local_directory": f"{number}", "nthreads": 2}
    return {f"address {number % 2}": told}


@pytest.fixture
def time(monkeypatch):
    """A clock that goes when it is told to."""
    clock = SimpleNamespace(now=0.0, monotonic=lambda: clock.now)
    monkeypatch.setattr(ours, "time", clock)
    return clock


def watched(time, *looks):
    watch = ours._Watch(Seen(*looks))
    for _ in looks:
        watch.look()
        time.now += ours.PULSE
    return watch


def test_workers_that_come_and_go_without_a_chunk_are_not_waited_for_for_ever(time):
    """As a nanny starts them anew when their memory is full from the start."""
    coming = [worker(n) for n in range(100)]
    watched(time, *coming[:5])
    with pytest.raises(SweepError, match="lost 5 workers, and no chunk was finished in between"):
        watched(time, *coming)


def test_workers_that_are_never_seen_twice_cannot_work(time, monkeypatch):
    monkeypatch.setattr(ours, "LOSSES", np.inf)
    with pytest.raises(TimeoutError, match="the 1 at there could not for 30 s"):
        watched(time, *(worker(n) for n in range(100)))


def test_a_paused_worker_that_finishes_its_chunk_is_waited_for(time):
    watched(time, *[worker(0, "paused", executing=1)] * 100)
    with pytest.raises(TimeoutError, match="a worker pauses while its memory is full"):
        watched(time, *[worker(0, "paused")] * 100)


def test_a_long_chunk_is_waited_for(time):
    assert watched(time, *[worker(0) | worker(1)] * 1000).wanted == 8


def test_a_cluster_is_not_looked_at_all_the_time(time):
    watch = ours._Watch(Seen(worker(0)))
    watch.look()
    watch.look()
    assert watch.wanted == 4
