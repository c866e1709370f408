"""Other processes and a cluster give the same result, name what failed, and end when told to."""

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from distributed import Client, LocalCluster
from numpy.testing import assert_array_equal
from sweeps import LOCAL

from navfilters import FILTERS, Gaussian, SweepError, sweep
from navfilters.papers.perea2007.experiment import Setup

pytestmark = pytest.mark.slow

BASE = Setup()
EKF = FILTERS["EKF"]
quiet = partial(sweep, z=BASE.z, model=BASE.model, steps=4, progress=False)


def priors(count=60):
    return Gaussian(np.random.default_rng(0).normal(BASE.x0, 10.0, (count, 2)), BASE.prior.cov)


def assert_same(got, wanted):
    for ours, theirs in zip(got, wanted, strict=True):
        assert_array_equal(ours, theirs)


def fails_at(x1, prior, z, model):
    """A filter that cannot bear one configuration."""
    if (prior.mean[..., 0] == x1).any():
        raise ZeroDivisionError("cannot bear this")
    return EKF(prior, z, model)


def fails_together(prior, z, model):
    """A filter that cannot bear more than two."""
    if len(prior.mean) > 2:
        raise MemoryError("too many")
    return EKF(prior, z, model)


def dies_once(folder, prior, z, model):
    """A filter whose process is gone the first time that it comes to work in earnest."""
    flag = Path(folder, "died")
    if len(prior.mean) > 1 and not flag.exists():
        flag.touch()
        os._exit(1)
    return EKF(prior, z, model)


@pytest.fixture(scope="module")
def client():
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": True}
    with LocalCluster(**options, **LOCAL) as cluster, Client(cluster) as client:
        yield client


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_processes_give_the_same(workers):
    assert_same(quiet(EKF, priors(), chunk=7, workers=workers).final, quiet(EKF, priors()).final)


@pytest.mark.parametrize("engine", ["numpy", "jax"])
def test_a_cluster_gives_the_same(client, engine):
    wanted = quiet(EKF, priors(), engine=engine, chunk=20).final
    assert_same(quiet(EKF, priors(), engine=engine, chunk=20, client=client).final, wanted)


def test_long_series_of_measurements_are_sent(client):
    """More than dask likes to send with a task: no warning."""
    z = np.broadcast_to(BASE.z, (400, 2000, 2))
    go = partial(
        quiet, lambda prior, z, model: prior, priors(2000), z=z, steps=400, z_per_step=True
    )
    assert_same(go(chunk=2000, client=client).final, go().final)


def test_a_worker_that_is_lost_on_the_way_is_no_loss(client, tmp_path):
    before = client.run(os.getpid)
    got = quiet(partial(dies_once, str(tmp_path)), priors(), chunk=7, client=client)
    assert (tmp_path / "died").exists()
    assert_same(got.final, quiet(EKF, priors()).final)
    client.wait_for_workers(2)
    assert len(set(client.run(os.getpid).values()) - set(before.values())) == 1


def test_a_process_that_dies_is_told(tmp_path):
    """And the same call goes on with what was finished."""
    options = {"chunk": 7, "workers": 2, "checkpoint": tmp_path / "sweep"}
    with pytest.raises(SweepError, match=r"a process of this sweep has died.*same call goes on"):
        quiet(partial(dies_once, str(tmp_path)), priors(), **options)
    got = quiet(partial(dies_once, str(tmp_path)), priors(), **options)
    assert_same(got.final, quiet(EKF, priors()).final)


# --- exceptions ---------------------------------------------------------------------------------


@pytest.mark.parametrize("where", ["here", "processes", "cluster"])
def test_an_exception_names_the_configuration_that_caused_it(where, request):
    options = {
        "here": lambda: {"workers": 1},
        "processes": lambda: {"workers": 2},
        "cluster": lambda: {"client": request.getfixturevalue("client")},
    }[where]()
    bad = partial(fails_at, priors().mean[38, 0])
    with pytest.raises(SweepError, match="configuration 38: ZeroDivisionError: cannot bear this"):
        quiet(bad, priors(), chunk=9, **options)


def test_a_configuration_of_a_grid_is_named_by_its_index():
    grid = Gaussian(priors().mean.reshape(6, 10, 2), BASE.prior.cov)
    with pytest.raises(SweepError, match=r"configuration \(3, 8\): ZeroDivisionError") as error:
        quiet(partial(fails_at, grid.mean[3, 8, 0]), grid, chunk=7)
    assert isinstance(error.value.__cause__, ZeroDivisionError)


def test_an_exception_of_many_names_them():
    with pytest.raises(SweepError, match="configuration 0 to 2: MemoryError: too many"):
        quiet(fails_together, priors(), chunk=12)


# --- the end before the end ---------------------------------------------------------------------


class Interrupting:
    """A filter during whose so-many-th call the user presses Ctrl-C."""

    calls_left = 0

    @classmethod
    def update(cls, prior, z, model):
        cls.calls_left -= 1
        if cls.calls_left == 0:
            raise KeyboardInterrupt
        return EKF(prior, z, model)


@pytest.mark.parametrize("stored", [True, False])
def test_ctrl_c_says_what_was_finished(stored, tmp_path):
    Interrupting.calls_left = 1 + 3 * 4 + 2  # the look at one configuration, and three chunks
    folder = tmp_path / "sweep" if stored else None
    message = "stopped: 21 of 60 configurations were finished; "
    message += f"they are in .*{folder.name}" if stored else "without a checkpoint folder they are"
    with pytest.raises(KeyboardInterrupt, match=message) as error:
        quiet(Interrupting.update, priors(), chunk=7, checkpoint=folder)
    assert error.value.__suppress_context__
    if stored:
        Interrupting.calls_left = 0
        got = quiet(Interrupting.update, priors(), chunk=7, checkpoint=folder)
        assert_same(got.final, quiet(EKF, priors()).final)
        assert -Interrupting.calls_left == 1 + 6 * 4


LONG = """
import signal, sys
from test_workers import BASE, EKF, priors, sweep

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background ignores it
    sweep(EKF, priors(4000), BASE.z, BASE.model, 4000, chunk=20, workers=2, checkpoint=sys.argv[1])
"""


def no_process_of(group):
    """Whether the group is empty, or will be in a moment: joblib's tracker of its files is last."""
    for _ in range(100):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False


@pytest.mark.skipif(sys.platform == "win32", reason="a signal for a whole group is POSIX")
def test_ctrl_c_ends_all_processes(tmp_path):
    """As a terminal sends it: to every process of the command."""
    script, folder = tmp_path / "long.py", tmp_path / "sweep"
    script.write_text(LONG)
    path = os.pathsep.join([str(Path(__file__).parent), *filter(None, sys.path)])
    with subprocess.Popen(
        [sys.executable, "-W", "error", script, folder],
        env={**os.environ, "PYTHONPATH": path},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as command:
        deadline = time.monotonic() + 60
        while len(list(folder.glob("*.npz"))) < 6:  # both workers are at work
            assert command.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.05)
        os.killpg(command.pid, signal.SIGINT)
        _, message = command.communicate(timeout=30)
    finished = 20 * len(list(folder.glob("*.npz")))
    assert f"sweep stopped: {finished} of 4000 configurations were finished" in message
    assert "LokyProcess" not in message  # no word from the workers
    assert no_process_of(command.pid)


# --- progress -----------------------------------------------------------------------------------


def test_progress_is_for_terminals(capsys):
    quiet(EKF, priors(), progress=True)
    assert capsys.readouterr() == ("", "")


def test_progress_shows_rate_and_time_left(capsys, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("TQDM_MININTERVAL", "0")
    quiet(EKF, priors(), chunk=7, progress=True)
    shown = capsys.readouterr().err
    assert "60/60" in shown
    assert " configurations/s" in shown
    assert "<" in shown
    quiet(EKF, priors(), chunk=7)
    assert capsys.readouterr().err == ""


def test_without_joblib_and_tqdm_it_runs_on_one_core(monkeypatch):
    wanted = quiet(EKF, priors()).final
    for name in ("joblib", "tqdm"):
        monkeypatch.setitem(sys.modules, name, None)
    assert_same(quiet(EKF, priors(), chunk=7, progress=True).final, wanted)
    with pytest.raises(ImportError, match=r"workers needs joblib: pip install navfilters\[sweep\]"):
        quiet(EKF, priors(), workers=2)


def test_import_needs_numpy_only():
    """In a fresh interpreter: the engines and the cluster come with the sweep that uses them."""
    optional = {"jax", "joblib", "tqdm", "distributed", "dask"}
    code = f"import sys, navfilters; print(*sorted({optional} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
