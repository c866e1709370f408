"""How time and memory of a sweep grow with members, steps and processes: part of ``make bench``.

The static EKF. Each measurement has a process of its own, so that its largest memory is its own; it
makes a small sweep first, and what it takes more than that is counted. NumPy and one core, but
where processes are counted.
"""

import json
import multiprocessing
import os
import resource
import sys
import time
from datetime import date
from pathlib import Path

import numpy as np

from navfilters import FILTERS, Gaussian, sweep
from navfilters.models import RangeBearing

MODEL = RangeBearing(np.diag([2.5e-5, 6e-3]))
MEMBERS, STEPS = [10**k for k in range(7)], [10**k for k in range(5)]
SHORT, FEW = 10, 100  # steps where members grow, and members where steps do
MANY, LONG = 400_000, 100  # members and steps that are shared by processes
REPEATS = 3
RESULTS = Path(__file__).with_name("growth.json")


def fly(members: int, steps: int, workers: int = 1) -> None:
    """A sweep from starts around the truth."""
    starts = np.random.default_rng(0).uniform(50.0, 150.0, (members, 2))
    z = MODEL.h(np.array([100.0, 100.0]))
    priors = Gaussian(starts, 1e4 * np.eye(2))
    sweep(FILTERS["EKF"], priors, z, MODEL, steps, workers=workers, progress=False)


def megabytes() -> float:
    """The largest memory of this process so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def measure(members: int, steps: int) -> dict[str, float]:
    """Nanoseconds per update, the best of some, and megabytes."""
    fly(1, 1)
    before, spent = megabytes(), []
    for _ in range(REPEATS):
        start = time.process_time()
        fly(members, steps)
        spent.append(time.process_time() - start)
    memory = megabytes() - before
    return {"ns": float(f"{1e9 * min(spent) / (members * steps):.3g}"), "mb": round(memory)}


def shared(workers: int) -> float:
    """Seconds by the clock of a sweep by so many processes, which have been started before."""
    fly(MANY, 1, workers)
    spent = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        fly(MANY, LONG, workers)
        spent.append(time.perf_counter() - start)
    return round(min(spent), 2)


def main() -> None:
    """Measure, print and write ``growth.json``."""
    alone = multiprocessing.get_context("spawn")
    result = {"date": date.today().isoformat(), "short": SHORT, "few": FEW}
    series = {"members": [(n, SHORT) for n in MEMBERS], "steps": [(FEW, n) for n in STEPS]}
    for name, sizes in series.items():
        found = result[name] = {}
        for size in sizes:
            with alone.Pool(1) as pool:
                found[str(size[name == "steps"])] = pool.apply(measure, size)
        sys.stdout.write(f"{name}: {found}\n")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    result["processes"] = {str(n): shared(n) for n in range(1, cores + 1)}
    result["shared"] = {"members": MANY, "steps": LONG}
    sys.stdout.write(f"processes: {result['processes']}\n")
    RESULTS.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
