"""A sweep on a dask cluster of this machine meets faults: is all there, and nothing twice?

At a seeded random instant a worker, all workers, the client or the scheduler is lost; or memory
runs out. What the sweep says is kept; where it ends with an error, the same call goes on with what
is there then. Every computation of a chunk leaves a mark, so that those made in vain are counted,
and every chunk that is put into the result is told by ``progress``.
"""

import argparse
import json
import os
import platform
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from datetime import date
from functools import partial
from pathlib import Path
from socket import socket
from tempfile import TemporaryDirectory, mkdtemp
from typing import Any, NamedTuple

import dask
import distributed
import numpy as np
from distributed import Client, LocalCluster
from kills import ROOT

from navfilters import FILTERS, Gaussian, sweep
from navfilters.papers.perea2007 import Setup

STORED = ROOT / "benchmarks" / "cluster_faults.json"
CHUNKS, SIZE = 40, 5
SECONDS = 0.05  # of work in a chunk
LIMIT, MUCH, TOO_MUCH = 300, 140, 600  # MiB: of a worker, and what a chunk takes more
TWICE = 2  # what has no random instant
BASE = Setup()
HERE = {"protocol": "tcp", "host": "127.0.0.1", "dashboard_address": ":0", "threads_per_worker": 1}


def marked(marks: Path, mib: float, prior: Gaussian, z: Any, model: Any) -> Gaussian:
    """The EKF, which leaves a mark of each of its chunks, takes its time and some memory."""
    if len(prior.mean) == SIZE:
        with marks.open("a") as file:
            file.write(f"{prior.mean[0, 0]!r}\n")
        taken = np.ones(int(mib * 2**17))
        time.sleep(SECONDS + 0.002 * mib)  # so that dask, which looks now and then, sees it
        del taken
    return FILTERS["EKF"](prior, z, model)


def swept(place: Path, mib: float = 0.0, **options: Any) -> dict[str, Any]:
    """A sweep of one step, its result in ``place``: what it said, and what it told of progress."""
    start = np.random.default_rng(0).normal(BASE.x0, 10.0, (CHUNKS * SIZE, 2))
    told: list[int] = []
    estimator = partial(marked, place / "marks", mib)
    problem = estimator, Gaussian(start, BASE.prior.cov), BASE.z, BASE.model, 1
    more = {"chunk": SIZE, "checkpoint": place / "chunks", "progress": told.append}
    place.mkdir(exist_ok=True)
    said = ""
    try:
        final = sweep(*problem, **more, **options).final
        (place / "result").write_bytes(final.mean.tobytes() + final.cov.tobytes())
    except Exception as error:
        said = f"{type(error).__name__}: {error}"
    return {"said": said, "told": sum(told)}


def left(place: Path) -> dict[str, bytes]:
    """What a sweep leaves, but for what its chunks belong to: that has the place in it."""
    arrays = {}
    for path in sorted((place / "chunks").glob("*.npz")):
        with np.load(path) as file:
            arrays |= {f"{path.name} {k}": file[k].tobytes() for k in file.files if k != "job"}
    return {"result": (place / "result").read_bytes(), **arrays}


@contextmanager
def local(memory: int = 0, **config: Any) -> Iterator[Client]:
    """A cluster of two worker processes; 0: of unlimited memory."""
    options = {"n_workers": 2, "processes": True, "memory_limit": memory * 2**20}
    with (
        dask.config.set({f"distributed.worker.memory.{k}": v for k, v in config.items()}),
        LocalCluster(**options, **HERE) as cluster,
        Client(cluster) as client,
    ):
        yield client


@contextmanager
def apart() -> Iterator[Client]:
    """One whose scheduler is a process of its own."""
    with closing(socket()) as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    common = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}

    def begin(what: str, *more: str) -> subprocess.Popen:
        return subprocess.Popen([sys.executable, "-m", f"distributed.cli.{what}", *more], **common)

    address = f"tcp://127.0.0.1:{port}"
    here = ("--host", "127.0.0.1", "--no-dashboard")
    scheduler = begin("dask_scheduler", "--port", port, *here)
    workers = begin("dask_worker", address, "--nworkers", "2", "--nthreads", "1", *here)
    try:
        with Client(address, timeout=60) as client:
            client.wait_for_workers(2, timeout=60)
            yield client
    finally:
        for process in (workers, scheduler):
            process.terminate()
            process.send_signal(signal.SIGCONT)  # one that was stopped
            process.wait()


def lose_workers(client: Client, count: int, kind: signal.Signals) -> None:
    """So many processes are told to end, or end."""
    for process in list(client.run(os.getpid).values())[:count]:
        os.kill(process, kind)


def lose_scheduler(client: Client, kind: signal.Signals) -> None:
    """Its process is gone, or stops."""
    os.kill(client.run_on_scheduler(os.getpid), kind)


class Fault(NamedTuple):
    """What happens to a sweep, and where.

    Parameters
    ----------
    strike : callable, optional
        Given the client, at a random instant.
    cluster : callable
        Makes one.
    mib : float
        Memory that a chunk takes for a while.
    """

    strike: Callable[[Client], None] | None
    cluster: Callable[[], Any] = local
    mib: float = 0.0


FAULTS = {
    "one worker killed": Fault(partial(lose_workers, count=1, kind=signal.SIGKILL)),
    "both workers killed at once": Fault(partial(lose_workers, count=2, kind=signal.SIGKILL)),
    "one worker told to end": Fault(partial(lose_workers, count=1, kind=signal.SIGTERM)),
    "scheduler killed": Fault(partial(lose_scheduler, kind=signal.SIGKILL), apart),
    "scheduler silent": Fault(partial(lose_scheduler, kind=signal.SIGSTOP), apart),
    "client closed": Fault(Client.close),
    "every result spilled to disk": Fault(None, partial(local, LIMIT, target=1e-9)),
    "memory nearly full": Fault(None, partial(local, LIMIT), MUCH),
    "memory too small for a chunk": Fault(None, partial(local, LIMIT), TOO_MUCH),
}


def written(dask_worker: Any) -> int:
    """Results that a worker has spilled."""
    return int(getattr(dask_worker.data, "cumulative_metrics", {}).get(("disk-write", "count"), 0))


def trial(fault: Fault, place: Path, seconds: float) -> dict[str, Any]:
    """A sweep that meets a fault, and the same call again if it ended with an error."""
    with fault.cluster() as client:
        struck = threading.Event()

        def strike() -> None:
            struck.set()
            if fault.strike:
                fault.strike(client)

        timer = threading.Timer(seconds, strike)
        timer.start()
        begun = time.perf_counter()
        row = swept(place, fault.mib, client=client)
        row["seconds"] = round(time.perf_counter() - begun, 1)
        row["struck"] = fault.strike is None or struck.is_set()
        timer.cancel()
        timer.join()
        row["spilled"] = sum(client.run(written).values()) if not fault.strike else 0
    if row["said"]:
        with local() as client:
            row |= {"again": (again := swept(place, fault.mib, client=client))["said"]}
            row["told"] = again["told"]
    marks = (place / "marks").read_text().split()
    return {**row, "in_vain": len(marks) - len(set(marks)), "chunks": len(set(marks))}


class Study:
    """Trials of a fault, one after the other.

    Parameters
    ----------
    name : str
    seed : int
    folder : Path
    """

    def __init__(self, name: str, seed: int, folder: Path) -> None:
        self.name, self.draw = name, random.Random(f"{name} {seed}")
        self.folder, self.whole = folder / name, folder / "whole"
        self.folder.mkdir()

    def trial(self) -> dict[str, Any]:
        """The next. One that struck after the end of the sweep is made again."""
        if not self.whole.exists():
            swept(self.whole, workers=1)
        row = {"struck": False}
        while not row.pop("struck"):
            place = Path(mkdtemp(dir=self.folder))
            instant = round(self.draw.uniform(0.0, CHUNKS * SECONDS / 2), 3)
            row = trial(FAULTS[self.name], place, instant)
            row["same"] = left(place) == left(self.whole)
            row["said"] = row["said"].replace(str(place), "FOLDER")
            sys.stdout.write(f"{self.name}, {row}\n")
            sys.stdout.flush()
        return row


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--times", type=int, default=10, help="of each fault that has an instant")
    parser.add_argument("--store", type=Path, default=STORED)
    options = parser.parse_args()
    report = {
        "date": f"{date.today()}",
        "seed": options.seed,
        "system": f"{platform.system()}, Python {platform.python_version()}, "
        f"distributed {distributed.__version__}",
        "configurations": CHUNKS * SIZE,
        "chunks": CHUNKS,
        "memory": {"worker": LIMIT, "much": MUCH, "too_much": TOO_MUCH},
        "faults": {},
    }
    with TemporaryDirectory() as folder:
        studies = {name: Study(name, options.seed, Path(folder)) for name in FAULTS}
        for turn in range(options.times):
            for name, study in studies.items():
                if turn < TWICE or FAULTS[name].strike:
                    report["faults"].setdefault(name, []).append(study.trial())
            options.store.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
