"""Many configurations in shards that are drawn where they are computed: the plan for a billion.

A shard is a sweep of its own. It has a number, its seed, and sends back a few counts, so that
neither its configurations nor its results travel. Counts are kept in a folder, one file a shard:
the same command goes on where it was. ::

    python benchmarks/billion.py --shards 100 --members 10000 --folder FOLDER
    python benchmarks/billion.py --shards 1000 --members 1000000 --folder FOLDER \\
        --cluster tcp://SCHEDULER:8786

With ``--measure`` it stores in ``billion.json`` what the plan needs: part of ``make bench``.
Seconds are the processors', of all processes together.
"""

import argparse
import json
import os
import pickle
import platform
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import date
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import cloudpickle
import distributed
import numpy as np
from distributed import Client, LocalCluster, as_completed

from navfilters import FILTERS, Gaussian, sweep
from navfilters.papers.perea2007 import Setup
from navfilters.runs import stored_arrays

BASE = Setup()
EDGES = (0.0, 0.1, 1.0, 10.0, 50.0, np.inf)
"""Of the classes of the final position error. What is not finite is in none."""

STORED = Path(__file__).with_name("billion.json")


def starts(number: int, members: int) -> Gaussian:
    """The priors of a shard, whose number is their seed: uniform on Perea's plane."""
    mean = np.random.default_rng([2007, number]).uniform(0.0, 200.0, (members, 2))
    return Gaussian(mean, BASE.prior.cov)


def shard(
    number: int,
    members: int,
    steps: int,
    engine: str = "numpy",
) -> tuple[int, np.ndarray]:
    """Its number, and how many of its members end in each class."""
    problem = FILTERS["EKF"], starts(number, members), BASE.z, BASE.model, steps
    final = sweep(*problem, engine=engine, workers=1, progress=False).final
    error = np.linalg.norm(final.mean - BASE.x_true, axis=-1)
    return number, np.histogram(error[np.isfinite(error)], EDGES)[0]


def study(client: Client, folder: Path, shards: int, **options: Any) -> np.ndarray:
    """The counts of all shards, of which those in the folder are not computed again."""
    job = repr(sorted(options.items()))
    folder.mkdir(parents=True, exist_ok=True)
    total, missing = np.zeros(len(EDGES) - 1, dtype=int), []
    for number in range(shards):
        words = {"kind": "study", "remedy": "its shard is computed again"}
        kept = stored_arrays.load(name(folder, number), job, ["counts"], **words)
        if kept is None:
            missing.append(number)
        else:
            total += kept[0]
    work = client.map(partial(shard, **options), missing, pure=False)
    for _, (number, counts) in as_completed(work, with_results=True):
        stored_arrays.save(name(folder, number), job, counts=counts)
        total += counts
    return total


def name(folder: Path, number: int) -> Path:
    """Where the counts of a shard are."""
    return folder / f"shard-{number:07d}.npz"


# --- what the plan needs ------------------------------------------------------------------------

CHUNKS = {1: 200, 100: 200, 10_000: 50, 100_000: 10}  # members of a chunk: how many are sent
GROWTH = (1, 10, 100)  # shards
MEMBERS, STEPS, REPEATS = 10_000, 100, 3


def spent(client: Client) -> dict[str, float]:
    """Processor seconds so far of the client, the scheduler and all workers."""
    workers = client.run(time.process_time).values()
    scheduler = client.run_on_scheduler(time.process_time)
    return {"client": time.process_time(), "scheduler": scheduler, "workers": sum(workers)}


@contextmanager
def counted(client: Client, into: dict[str, float], times: int = 1) -> Iterator[None]:
    """What a piece of work takes on each side, divided by ``times``: the least of some."""
    before = spent(client)
    yield
    after = spent(client)
    new = {who: (after[who] - before[who]) / times for who in after}
    if not into or sum(new.values()) < sum(into.values()):
        into |= {who: float(f"{seconds:.3g}") for who, seconds in new.items()}


def of_chunks(client: Client) -> dict[str, Any]:
    """What a chunk costs that is sent, not stepped, and sent back; and its pickling alone."""
    found: dict[str, Any] = {}
    for size, count in CHUNKS.items():
        priors = starts(0, size * count)
        problem = FILTERS["EKF"], priors, BASE.z, BASE.model, 0
        found[str(size)] = row = {}
        for _ in range(REPEATS):
            with counted(client, row, count):
                sweep(*problem, chunk=size, client=client, progress=False)
        arrays = priors.mean[:size], np.broadcast_to(priors.cov, (size, 2, 2)).copy()
        begun = time.process_time()
        for _ in range(count):
            packed = cloudpickle.dumps(arrays)
            pickle.loads(packed)
        row["pickling"] = float(f"{(time.process_time() - begun) / count:.3g}")
        row["bytes"] = len(packed)
    return found


def of_shards(client: Client) -> dict[str, float]:
    """What a shard costs that has one member and makes no step."""
    found: dict[str, float] = {}
    for _ in range(REPEATS):
        with counted(client, found, 200):
            client.gather(client.map(partial(shard, members=1, steps=0), range(200), pure=False))
    return found


def of_growth(client: Client) -> list[dict[str, Any]]:
    """Studies of ten thousand, a hundred thousand and a million configurations."""
    rows = []
    for shards in GROWTH:
        row: dict[str, float] = {}
        for _ in range(REPEATS):
            with TemporaryDirectory() as place, counted(client, row):
                counts = study(client, Path(place), shards, members=MEMBERS, steps=STEPS)
                files = [path.stat().st_size for path in Path(place).iterdir()]
        rows.append({"configurations": shards * MEMBERS, **row, "counts": counts.tolist()})
        rows[-1]["bytes_per_shard"] = max(files)
        sys.stdout.write(f"{rows[-1]}\n")
    return rows


def of_files() -> dict[str, Any]:
    """Of a chunk in a checkpoint folder: its bytes, and seconds by the clock until it is there."""
    found = {}
    for size in CHUNKS:
        final = starts(0, size)
        arrays = {"mean": final.mean, "cov": np.broadcast_to(final.cov, (size, 2, 2))}
        with TemporaryDirectory(dir=Path.cwd()) as place:
            path, took = Path(place) / "chunk.npz", []
            for _ in range(10):
                begun = time.perf_counter()
                stored_arrays.save(path, "job", **arrays)
                took.append(time.perf_counter() - begun)
            seconds = float(f"{np.median(took):.2g}")
            found[str(size)] = {"bytes": path.stat().st_size, "seconds": seconds}
    return found


def peak() -> float:
    """The largest memory of a process so far, in MB."""
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def measure(client: Client) -> dict[str, Any]:
    """All that the plan needs."""
    shard(0, 1, 1)
    return {
        "date": f"{date.today()}",
        "system": f"{platform.system()}, Python {platform.python_version()}, distributed "
        f"{distributed.__version__}, {os.cpu_count()} cores",
        "chunks": of_chunks(client),
        "shards": of_shards(client),
        "members": MEMBERS,
        "steps": STEPS,
        "edges": EDGES[:-1],
        "growth": of_growth(client),
        "worker_mb": round(max(client.run(peak).values())),
        "files": of_files(),
    }


def main() -> None:
    """Study, or measure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shards", type=int, default=100)
    parser.add_argument("--members", type=int, default=MEMBERS, help="of a shard")
    parser.add_argument("--steps", type=int, default=STEPS)
    parser.add_argument("--engine", choices=("numpy", "jax"), default="numpy")
    parser.add_argument("--folder", type=Path, default=Path("billion"), help="for the counts")
    parser.add_argument("--cluster", help="a scheduler's address; by default the cores here")
    parser.add_argument("--measure", action="store_true", help="and no more")
    chosen = parser.parse_args()
    if chosen.measure:
        sys.path.insert(0, str(STORED.parents[1] / "tools"))
        from cluster_faults import apart

        with apart() as client:
            STORED.write_text(json.dumps(measure(client), indent=1) + "\n", encoding="utf-8")
        return
    with cluster(chosen.cluster) as client:
        options = {"members": chosen.members, "steps": chosen.steps, "engine": chosen.engine}
        counts = study(client, chosen.folder, chosen.shards, **options)
        for low, high, count in zip(EDGES, EDGES[1:], counts, strict=False):
            sys.stdout.write(f"error {low:g} to {high:g}: {count}\n")
        lost = chosen.shards * chosen.members - counts.sum()
        sys.stdout.write(f"not finite: {lost}\n")


@contextmanager
def cluster(address: str | None) -> Iterator[Client]:
    """One that is there, or one process for each core here."""
    if address:
        with Client(address) as client:
            yield client
        return
    here = {"protocol": "tcp", "host": "127.0.0.1", "dashboard_address": ":0"}
    with LocalCluster(threads_per_worker=1, **here) as local, Client(local) as client:
        yield client


if __name__ == "__main__":
    main()
