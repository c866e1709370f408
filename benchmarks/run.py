"""Measure the library beside its peers on one core, and store the result: ``make bench``.

Three problems, the same numbers for all: the static one of Perea et al., a prior around theirs and
a perfect measurement at every step; and the two in motion of ``problems``. All contenders of a
filter and a batch size take turns; in each turn all are timed once. A result is the median over the
turns, of the time per update (with the prediction before it) and of its ratio to C's in that turn.
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
from typing import Any, NamedTuple

if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})  # before any library counts the cores

import jax
import limit
import numpy as np
import peers
import peers_moving
import problems

from navfilters import Gaussian
from navfilters.papers.perea2007.experiment import Setup

BATCHES = (1, 100, 10_000, 100_000)
RESULTS = Path(__file__).with_name("results.json")


class Problem(NamedTuple):
    """What is computed, by whom, and how long.

    Parameters
    ----------
    what : str
        In words.
    filters : tuple of str
        Keys of ``limit.compiled``, and of the result.
    steps : tuple of int
        For each size of ``BATCHES``, so that a turn lasts seconds.
    few : dict of str, int
        Updates that are enough of a contender without batches.
    arguments : callable
        members -> (prior, z, model), what all are given.
    contenders : callable
        (filter, C's functions by name) -> functions that prepare, by the name in the result.
    distance : callable
        (got, wanted), two Gaussians -> how far the means are apart, (members,).
    apart : str
        The same in words.
    note : str
        Where a contender does not do quite the same, and what its time is spent on.
    """

    what: str
    filters: tuple[str, ...]
    steps: tuple[int, ...]
    few: dict[str, int]
    arguments: Callable[[int], tuple[Gaussian, np.ndarray, Any]]
    contenders: Callable[[str, dict[str, Callable]], dict[str, Callable]]
    distance: Callable[[Gaussian, Gaussian], np.ndarray]
    apart: str
    note: str


def static(members: int) -> tuple[Gaussian, np.ndarray, np.ndarray]:
    """Priors about the paper's, its measurement and its noise."""
    setup = Setup()
    mean = np.random.default_rng(0).normal(setup.x0, 1.0, (members, 2))
    cov = np.tile(setup.prior.cov, (members, 1, 1))
    return Gaussian(mean, cov), np.array(setup.z), np.array(setup.model.R)


def at_rest(name: str, c: dict[str, Callable]) -> dict[str, Callable]:
    """Who takes part in the static problem."""
    return {
        "C": peers.limit(c[name]),
        "C, vectorised": peers.limit(c[f"{name}, vectorised"]),
        "navfilters, JAX": peers.ours(name, "jax"),
        "navfilters, NumPy": peers.ours(name, "numpy"),
        "dynamax": peers.dynamax(name),
        "filterpy": peers.filterpy(name),
        "Stone Soup": peers.stone_soup(name),
    }


def moving(make: Callable) -> Callable:
    """The arguments of a problem in motion."""
    problem = make()
    return lambda members: (problems.priors(problem, members), problem.z, problem)


def in_motion(name: str, c: dict[str, Callable]) -> dict[str, Callable]:
    """Who takes part in a problem in motion."""
    return {
        "C": peers.limit(c[name]),
        "navfilters, JAX": peers_moving.ours("jax"),
        "navfilters, NumPy": peers_moving.ours("numpy"),
        "dynamax": peers_moving.dynamax,
        "filterpy": peers_moving.filterpy,
        "Stone Soup": peers_moving.stone_soup,
    }


def relative(got: Gaussian, wanted: Gaussian) -> np.ndarray:
    """Distance of the means relative to that from the origin."""
    miss = np.linalg.norm(got.mean - wanted.mean, axis=-1)
    return miss / np.linalg.norm(wanted.mean, axis=-1)


IN_DEVIATIONS = "largest difference of a final mean's component from C's, in final deviations"
MODELS = (
    "filterpy and Stone Soup are given navfilters' model functions, which take most of their time "
    "when they are called for one member; dynamax derives its own Jacobians"
)

PROBLEMS = {
    "static": Problem(
        "static range-bearing update of Perea et al., 2 states",
        ("EKF", "UKF"),
        (1000, 1000, 300, 50),
        {"filterpy": 4000, "Stone Soup": 400},
        static,
        at_rest,
        relative,
        "distance of the final means from C's, relative to their distance from the origin",
        "Stone Soup's UKF averages bearings on the circle, as no other does",
    ),
    "orbit": Problem(
        "angles between stars and the Earth of Xiong et al., 6 states: 10 Runge-Kutta steps of "
        "10 s with their Jacobians, then 2 angles",
        ("orbit EKF",),
        (90, 90, 5, 2),
        {"filterpy": 180, "Stone Soup": 90},
        moving(problems.coasting),
        in_motion,
        problems.in_deviations,
        IN_DEVIATIONS,
        MODELS,
    ),
    "images": Problem(
        "radar images of Pogorelsky et al., 9 error states: 10 Runge-Kutta steps of 0.83 s with "
        "their Jacobians, then 4 measurements",
        ("MEKF",),
        (90, 90, 5, 2),
        {"filterpy": 90, "Stone Soup": 90},
        moving(problems.images),
        in_motion,
        problems.in_deviations,
        IN_DEVIATIONS,
        f"no peer has a multiplicative EKF: each updates the error state, and the quaternion is "
        f"reset outside of it; theirs is one process noise for an interval. {MODELS}",
    ),
}


def compare(
    problem: Problem, name: str, limits: dict[str, Callable], members: int, repeats: int
) -> dict[str, dict[str, float]]:
    """Times of all contenders for one filter and batch size.

    Returns
    -------
    dict
        By contender: ``ns`` per update, ``times_c`` and its quartiles, and ``apart``, the largest
        distance of its final means from C's.
    """
    prior, z, model = problem.arguments(members)
    planned = problem.steps[BATCHES.index(members)]
    go, updates, apart = {}, {}, {}
    for who, prepare in problem.contenders(name, limits).items():
        few = problem.few.get(who, members * planned)
        steps = min(planned, few)
        some = min(members, max(1, few // steps))
        mine = first(prior, some), z, model, steps
        go[who], updates[who] = prepare(*mine), some * steps
        got, wanted = Gaussian(*go[who]()), limits[name](*mine)  # the first call compiles
        apart[who] = np.max(problem.distance(got, wanted))
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
            "apart": float(f"{apart[who]:.1e}"),
        }
    return result


def first(prior: Gaussian, some: int) -> Gaussian:
    """The first members; a covariance without their axis is all members'."""
    return Gaussian(prior.mean[:some], prior.cov[:some] if prior.cov.ndim > 2 else prior.cov)


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
        "vectorised": " ".join(limit.WIDE),
        "device": jax.default_backend(),
    }


def main() -> None:
    """Measure, print a table and write ``results.json``."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--problems", nargs="*", choices=PROBLEMS, default=list(PROBLEMS))
    parser.add_argument("--batches", type=int, nargs="*", choices=BATCHES, default=list(BATCHES))
    parser.add_argument("--output", type=Path, default=RESULTS)
    chosen = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    packages = ("navfilters", "numpy", "jax", "dynamax", "filterpy", "stonesoup")
    result = {
        "date": date.today().isoformat(),
        "machine": machine(),
        "versions": {name: version(name) for name in packages},
        "repeats": chosen.repeats,
        "problems": {},
        "results": {},
    }
    with tempfile.TemporaryDirectory() as folder:
        limits = limit.compiled(Path(folder))
        for problem in (PROBLEMS[name] for name in chosen.problems):
            steps = dict(zip(BATCHES, problem.steps, strict=True))
            for name in problem.filters:
                result["problems"][name] = {
                    "what": problem.what,
                    "apart": problem.apart,
                    "note": problem.note,
                    "steps": {str(members): steps[members] for members in chosen.batches},
                }
                of_filter = result["results"].setdefault(name, {})
                for members in chosen.batches:
                    found = compare(problem, name, limits, members, chosen.repeats)
                    of_filter[str(members)] = found
                    show(name, members, found)
    chosen.output.write_text(json.dumps(result, indent=1) + "\n")


def show(name: str, members: int, result: dict[str, dict[str, float]]) -> None:
    """One line for each contender."""
    for who, r in result.items():
        line = f"{name:9}  {members:7d}  {who:18s} {r['ns']:12.1f} ns {r['times_c']:10.2f} x C"
        sys.stdout.write(f"{line}   {r['quartiles']}  {r['apart']}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
