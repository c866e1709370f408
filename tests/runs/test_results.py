"""A sweep that returns has every member of its result; otherwise it says what is missing."""

import threading
import time
from functools import partial

import numpy as np
import pytest
from distributed import Client, LocalCluster
from numpy.testing import assert_array_equal
from sweeps import LOCAL

from navfilters import FILTERS, Gaussian, SweepError, sweep
from navfilters.papers.perea2007.experiment import Setup
from navfilters.runs import cluster, records
from navfilters.runs import workers as places

BASE = Setup()
EKF = FILTERS["EKF"]
quiet = partial(sweep, z=BASE.z, model=BASE.model, steps=4, progress=False)


def priors(count=60):
    return Gaussian(np.random.default_rng(0).normal(BASE.x0, 10.0, (count, 2)), BASE.prior.cov)


# --- chunks -------------------------------------------------------------------------------------


def losing(*lost):
    """A place that computes all chunks but some, as one that gives up without an exception."""

    def place(call, tasks):
        for task in tasks:
            if task.number not in lost:
                yield call(task)

    return place


@pytest.mark.parametrize("record", [None, records.definite, records.estimate])
@pytest.mark.parametrize(
    ("lost", "message"),
    [
        ([2], "found 1 that never arrived: 2$"),
        ([0, 5], "found 2 that never arrived: 0, 5$"),
        (range(12), r"found 12 that never arrived: 0, 1, .*, 8, \.\.\.$"),
    ],
)
def test_a_chunk_that_never_arrived_is_named(monkeypatch, lost, message, record):
    monkeypatch.setattr(places, "in_turn", losing(*lost))
    with pytest.raises(SweepError, match=f"sweep must have every chunk; {message}"):
        quiet(EKF, priors(), chunk=5, record=record, workers=1)


def test_what_a_checkpoint_has_need_not_arrive_again(monkeypatch, tmp_path):
    wanted = quiet(EKF, priors(), chunk=5).final.mean
    monkeypatch.setattr(places, "in_turn", losing(3, 7))
    with pytest.raises(SweepError, match="found 2 that never arrived: 3, 7"):
        quiet(EKF, priors(), chunk=5, workers=1, checkpoint=tmp_path)
    monkeypatch.setattr(places, "in_turn", losing(*set(range(12)) - {3}))
    with pytest.raises(SweepError, match="found 1 that never arrived: 7"):
        quiet(EKF, priors(), chunk=5, workers=1, checkpoint=tmp_path)
    monkeypatch.undo()
    got = quiet(EKF, priors(), chunk=5, workers=1, checkpoint=tmp_path).final.mean
    assert_array_equal(got, wanted)


def averages(prior, z, model):
    """All members become one: an axis of length one, that would fill any number of rows."""
    return Gaussian(*(part.mean(axis=0, keepdims=True) for part in EKF(prior, z, model)))


def shortened(prior, z, model):
    return Gaussian(*(part[: max(1, len(part) - 1)] for part in EKF(prior, z, model)))


def widened(prior, z, model):
    return Gaussian(*(np.concatenate([part, part[:1]])[1:] for part in prior))._replace(
        mean=np.concatenate([prior.mean] * (1 + (len(prior.mean) > 1)))
    )


def rounded(prior, z, model):
    """Of another type for many than for one."""
    kind = float if len(prior.mean) == 1 else np.float32
    return Gaussian(*(part.astype(kind) for part in EKF(prior, z, model)))


@pytest.mark.parametrize("estimator", [averages, shortened, widened, rounded])
def test_a_chunk_of_another_shape_or_type_is_no_result(estimator):
    message = r"chunk 0, configurations 0 to 6: estimator must return arrays .*; found state.est"
    with pytest.raises(SweepError, match=message):
        quiet(estimator, priors(), chunk=7)


def test_an_interruption_gives_no_result(monkeypatch):
    def place(call, tasks):
        yield call(next(tasks))
        raise KeyboardInterrupt

    monkeypatch.setattr(places, "in_turn", place)
    with pytest.raises(KeyboardInterrupt, match="5 of 60 configurations were finished"):
        quiet(EKF, priors(), chunk=5, workers=1)


# --- a cluster without workers ------------------------------------------------------------------


@pytest.fixture
def empty():
    """A cluster whose workers have not come."""
    options = {"n_workers": 0, "threads_per_worker": 1, "processes": False}
    with LocalCluster(**options, **LOCAL) as cluster, Client(cluster) as client:
        yield client


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 60])
def test_a_cluster_that_stays_empty_is_an_error(empty, count, monkeypatch, capsys):
    monkeypatch.setattr(cluster, "PATIENCE", 0.5)
    with pytest.raises(TimeoutError, match=r"client must have workers; found none at .* 0.5 s"):
        quiet(EKF, priors(count), chunk=20, client=empty)
    said = capsys.readouterr().err
    assert said.startswith("sweep waits for workers of the cluster at ")
    assert said.count("\n") == 1


@pytest.mark.slow
def test_a_sweep_waits_for_workers(empty, capsys):
    """And uses those that come later, too."""

    def arrive():
        time.sleep(0.5)
        empty.cluster.scale(2)

    thread = threading.Thread(target=arrive)
    thread.start()
    got = quiet(EKF, priors(), chunk=3, client=empty).final.mean
    thread.join()
    assert_array_equal(got, quiet(EKF, priors(), chunk=3).final.mean)
    assert "sweep waits for workers" in capsys.readouterr().err


@pytest.mark.slow
def test_a_cluster_that_adapts_itself_is_given_something_to_adapt_to(empty):
    """It starts a worker only where there is a task."""
    empty.cluster.adapt(minimum=0, maximum=1, interval="100ms")
    got = quiet(EKF, priors(), chunk=20, client=empty).final.mean
    assert_array_equal(got, quiet(EKF, priors(), chunk=20).final.mean)


@pytest.mark.slow
def test_a_cluster_with_workers_is_not_waited_for(empty, capsys):
    empty.cluster.scale(1)
    empty.wait_for_workers(1)
    quiet(EKF, priors(), chunk=20, client=empty)
    assert capsys.readouterr().err == ""
