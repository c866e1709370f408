"""Measure the library beside its peers on one core, and store the result: ``make bench``.

The problem is perea2007's static one: a prior around the paper's, and its perfect measurement at
every step. All contenders of a filter and a batch size take turns; in each turn all are timed once.
A result is the median over the turns, of the time per update and of its ratio to C's in that turn.
Time is the processor's for this process, so that others on the machine disturb it less; no
contender waits for anything. Contenders that make one update after another for one member after
another cost the same per update for any batch: of them a few members are enough.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from datetime import date
from importlib.metadata import version
from pathlib import Path
from statistics import median, quantiles

if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})  # before any library counts the cores

import jax
import limit
import numpy as np
import peers

from navfilters import Gaussian
from navfilters.experiments.perea2007 import Setup

STEPS = {1: 1000, 100: 1000, 10_000: 300, 100_000: 50}
FEW = {"filterpy": 4000, "Stone Soup": 400}
"""Updates that are enough of a contender without batches."""

RESULTS = Path(__file__).with_name("results.json")


def contenders(name: str, c: Callable) -> dict[str, Callable]:
    """Who takes part, by the name in the result."""
    return {
        "C": peers.limit(c),
        "navfilters, JAX": peers.ours(name, "jax"),
        "navfilters, NumPy": peers.ours(name, "numpy"),
        "dynamax": peers.dynamax(name),
        "filterpy": peers.filterpy(name),
        "Stone Soup": peers.stone_soup(name),
    }


def problem(members: int) -> tuple[Gaussian, np.ndarray, np.ndarray]:
    """Priors about the paper's, its measurement and its noise."""
    setup = Setup()
    mean = np.random.default_rng(0).normal(setup.x0, 1.0, (members, 2))
    cov = np.tile(setup.prior.cov, (members, 1, 1))
    return Gaussian(mean, cov), np.array(setup.z), np.array(setup.model.R)


def compare(name: str, c: Callable, members: int, repeats: int) -> dict[str, dict[str, float]]:
    """Times of all contenders for one filter and batch size.

    Returns
    -------
    dict
        By contender: ``ns`` per update, ``times_c`` and its quartiles, and ``apart``, the largest
        distance of its final means from C's, relative to their distance from the origin.
    """
    (mean, cov), z, R = problem(members)
    go, updates, apart = {}, {}, {}
    for who, prepare in contenders(name, c).items():
        steps = min(STEPS[members], FEW.get(who, STEPS[members]))
        some = min(members, max(1, FEW.get(who, members * steps) // steps))
        mine = Gaussian(mean[:some], cov[:some]), z, R, steps
        go[who], updates[who] = prepare(*mine), some * steps
        got, wanted = go[who]()[0], c(*mine).mean  # the first call compiles
        apart[who] = np.linalg.norm(got - wanted, axis=-1) / np.linalg.norm(wanted, axis=-1)
    times: dict[str, list[float]] = {who: [] for who in go}
    for _ in range(repeats):
        for who, run in go.items():
            start = time.process_time()
            run()
            times[who].append((time.process_time() - start) / updates[who] * 1e9)
    result = {}
    for who, spent in times.items():
        ratios = [mine / c for mine, c in zip(spent, times["C"], strict=True)]
        low, middle, high = quantiles(ratios, n=4)
        result[who] = {
            "ns": round(median(spent), 1),
            "times_c": round(middle, 3),
            "quartiles": [round(low, 3), round(high, 3)],
            "apart": float(f"{np.max(apart[who]):.1e}"),
        }
    return result


def machine() -> dict[str, str]:
    """What it ran on, in words."""
    cpu = platform.processor() or platform.machine()
    if Path("/proc/cpuinfo").exists():
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        cpu = next((x.split(":")[1].strip() for x in lines if x.startswith("model name")), cpu)
    c = subprocess.run([limit.compiler(), "--version"], capture_output=True, text=True, check=True)
    return {
        "processor": f"{cpu}, one core of {os.cpu_count()}, {platform.machine()}",
        "system": platform.system(),
        "python": platform.python_version(),
        "compiler": f"{c.stdout.splitlines()[0]}, {' '.join(limit.FLAGS)}",
        "device": jax.default_backend(),
    }


def main() -> None:
    """Measure, print a table and write ``results.json``."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--batches", type=int, nargs="*", choices=STEPS, default=list(STEPS))
    parser.add_argument("--output", type=Path, default=RESULTS)
    chosen = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    packages = ("navfilters", "numpy", "jax", "dynamax", "filterpy", "stonesoup")
    result = {
        "date": date.today().isoformat(),
        "machine": machine(),
        "versions": {name: version(name) for name in packages},
        "problem": "static range-bearing update of perea2007, 2 states",
        "repeats": chosen.repeats,
        "steps": {str(members): STEPS[members] for members in chosen.batches},
        "results": {},
    }
    with tempfile.TemporaryDirectory() as folder:
        limits = limit.compiled(Path(folder))
        for name in ("EKF", "UKF"):
            of_filter = result["results"].setdefault(name, {})
            for members in chosen.batches:
                of_filter[str(members)] = compare(name, limits[name], members, chosen.repeats)
                show(name, members, of_filter[str(members)])
    chosen.output.write_text(json.dumps(result, indent=1) + "\n")


def show(name: str, members: int, result: dict[str, dict[str, float]]) -> None:
    """One line for each contender."""
    for who, r in result.items():
        line = f"{name}  {members:7d}  {who:18s} {r['ns']:12.1f} ns {r['times_c']:10.2f} x C"
        sys.stdout.write(f"{line}   {r['quartiles']}  {r['apart']}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
