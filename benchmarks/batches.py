"""A batch of Monte Carlo runs against a loop, and cost by size of state: part of ``make bench``.

Both do the same runs with the same random numbers, on one core, in turns. The loop makes only a few
of the runs, since each costs the same. Results are medians over the turns.

The second part makes linear updates of two measurements for states of several sizes. The third
splits the cost of a compiled series of one member into that of the call and that of an update, the
fourth times the arctangent that an update cannot do without, and the fifth takes one filter alone
under NumPy apart.
"""

import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from datetime import date
from pathlib import Path
from statistics import median

if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})  # before any library counts the cores

import jax
import numpy as np
import peers
import peers_moving
import problems
from filterpy.kalman import ExtendedKalmanFilter

from navfilters import FILTERS, Gaussian, run, sweep
from navfilters.models import Linear
from navfilters.numerics.small_matrices import matmul
from navfilters.papers import perea2007, pogorelsky2020, xiong2009

REPEATS = 5
RESULTS = Path(__file__).with_name("batches.json")


def orbit(runs: range) -> np.ndarray:
    """The EKF through two burns: 200 updates, 100 sub-steps of 1 s between them."""
    return xiong2009.rms_error("EKF", "B", runs)


def images(runs: range) -> np.ndarray:
    """The multiplicative EKF on radar images: 72 updates, 10 steps between them."""
    return pogorelsky2020.monte_carlo("TC-1", runs=list(runs)).errors[-1]


CONTESTS = {
    "orbit EKF, 20 runs": (orbit, range(20), 1),
    "radar MEKF, 100 runs": (images, range(100), 2),
}


def compare(experiment, runs: range, some: int) -> dict[str, float]:
    """Seconds for all runs as a batch, and for one after another, of which some are flown."""
    together, alone, ratios = [], [], []
    batch = experiment(runs)
    single = np.concatenate([experiment(range(i, i + 1)) for i in range(some)])
    apart = np.max(np.abs(batch[:some] - single) / np.abs(single))
    for _ in range(REPEATS):
        start = time.process_time()
        experiment(runs)
        together.append(time.process_time() - start)
        start = time.process_time()
        for i in range(some):
            experiment(range(i, i + 1))
        alone.append((time.process_time() - start) * len(runs) / some)
        ratios.append(alone[-1] / together[-1])
    return {
        "batch_s": round(median(together), 2),
        "loop_s": round(median(alone), 1),
        "loop_over_batch": round(median(ratios), 1),
        "apart": float(f"{apart:.1e}"),
    }


SIZES = (2, 3, 4, 6, 9, 12, 20, 30)
MEMBERS, STEPS = 10_000, 20


def grow(engine: str, n: int) -> float:
    """Nanoseconds per update of the EKF on a linear model with n states."""
    rng = np.random.default_rng(0)
    model = Linear(rng.normal(size=(2, n)), np.eye(2))
    priors = Gaussian(rng.normal(size=(MEMBERS, n)), np.tile(np.eye(n), (MEMBERS, 1, 1)))
    options = {"engine": engine, "workers": 1, "progress": False}
    spent = []
    for _ in range(REPEATS + 1):  # the first compiles
        start = time.process_time()
        sweep(FILTERS["EKF"], priors, np.ones(2), model, STEPS, **options)
        spent.append((time.process_time() - start) / (MEMBERS * STEPS) * 1e9)
    return round(median(spent[1:]), 1)


COMPILED = {"navfilters, JAX": peers_moving.ours("jax"), "dynamax": peers_moving.dynamax}
SHORT, TURNS = 10, 25


def split(problem: problems.Coasting | problems.Images) -> dict[str, dict[str, float]]:
    """Microseconds of a call and of each update, by a short and a long series of one member."""
    prior, lengths = problems.priors(problem, 1), (SHORT, problems.LONGEST)
    spent = {}
    for who, prepare in COMPILED.items():
        series = [prepare(prior, problem.z, problem, steps) for steps in lengths]
        times = []
        for go in series:
            go()  # compiles
        for _ in range(TURNS):
            for go in series:
                start = time.process_time()
                go()
                times.append((time.process_time() - start) * 1e6)
        short, long = median(times[::2]), median(times[1::2])
        update = (long - short) / (lengths[1] - lengths[0])
        spent[who] = {"call_us": round(short - SHORT * update), "update_us": round(update, 1)}
    return spent


TIMES = 2000


def arctangent() -> dict[str, float]:
    """Nanoseconds of one in a block, compiled by JAX and by NumPy: an EKF needs it at least."""
    y, x = np.random.default_rng(0).uniform(50.0, 150.0, (2, 512))

    def one(angle: jax.Array, _: None) -> tuple[jax.Array, None]:
        return 1e-9 * jax.numpy.arctan2(y + angle, x), None

    go = jax.jit(lambda angle: jax.lax.scan(one, angle, None, length=TIMES)[0])
    contenders = {
        "navfilters, JAX": lambda: go(x).block_until_ready(),
        "navfilters, NumPy": lambda: [np.arctan2(y, x) for _ in range(TIMES)],
    }
    found = {}
    for who, compute in contenders.items():
        spent = []
        for _ in range(REPEATS + 1):  # the first compiles
            start = time.process_time()
            compute()
            spent.append((time.process_time() - start) / (TIMES * len(x)) * 1e9)
        found[who] = round(median(spent[1:]), 1)
    return found


ALONE = 2000


def alone() -> dict[str, float]:
    """Microseconds under NumPy of an update of one filter, range and bearing, and of its parts."""
    setup = perea2007.Setup()
    prior, z, model = setup.prior, setup.z, setup.model
    H, R = model.jacobian(prior.mean), model.R

    larger = Linear(np.random.default_rng(0).normal(size=(3, 6)), np.eye(3))
    six, three = Gaussian(np.zeros(6), np.eye(6)), np.ones(3)

    def ours(name: str, form: str = "joseph") -> Callable[[int], object]:
        one = replace(FILTERS[name], form=form)
        return lambda times: run(one, prior, z, model, times)

    def theirs(
        h: Callable, jacobian: Callable, prior: Gaussian = prior, z: np.ndarray = z
    ) -> Callable[[int], object]:
        ekf = ExtendedKalmanFilter(len(prior.mean), len(z))
        ekf.R = R if len(z) == 2 else larger.R

        def updates(times: int) -> None:
            ekf.x, ekf.P = prior.mean.copy(), prior.cov.copy()
            for _ in range(times):
                ekf.update(z, jacobian, h)

        return updates

    def their_ukf(times: int) -> object:
        members = Gaussian(prior.mean[None], prior.cov[None])
        return peers.filterpy("UKF")(members, z, R, times)()

    def repeated(part: Callable[[], object]) -> Callable[[int], object]:
        return lambda times: [part() for _ in range(times)]

    parts = {
        "an update": ours("EKF"),
        "an update in the short form": ours("EKF", "short"),
        "filterpy with the same model": theirs(model.h, model.jacobian),
        "filterpy with a bare model": theirs(peers.h, peers.jacobian),
        "h and its Jacobian": repeated(lambda: (model.h(prior.mean), model.jacobian(prior.mean))),
        "the same, bare": repeated(lambda: (peers.h(prior.mean), peers.jacobian(prior.mean))),
        "a product of 2 by 2": repeated(lambda: matmul(H, R)),
        "the same by BLAS": repeated(lambda: H @ R),
        "an update of a UKF": ours("UKF"),
        "filterpy's UKF with a bare model": their_ukf,
        "an EKF of 6 states, 3 measurements": lambda times: run(
            FILTERS["EKF"], six, three, larger, times
        ),
        "filterpy with the same model of 6": theirs(larger.h, larger.jacobian, six, three),
    }
    spent: dict[str, list[float]] = {what: [] for what in parts}
    for _ in range(REPEATS + 1):  # the first fills caches
        for what, part in parts.items():
            start = time.process_time()
            part(ALONE)
            spent[what].append((time.process_time() - start) / ALONE * 1e6)
    return {what: float(f"{median(each[1:]):.2g}") for what, each in spent.items()}


def main() -> None:
    """Measure, print and write ``batches.json``."""
    jax.config.update("jax_enable_x64", True)
    result = {"date": date.today().isoformat(), "repeats": REPEATS, "results": {}, "sizes": {}}
    result["calls"] = {
        name: split(make())
        for name, make in (("orbit EKF", problems.coasting), ("MEKF", problems.images))
    }
    sys.stdout.write(f"one member, compiled: {result['calls']}\n")
    result["arctangent"] = arctangent()
    sys.stdout.write(f"ns of an arctangent: {result['arctangent']}\n")
    result["alone"] = alone()
    sys.stdout.write(f"us of one EKF: {result['alone']}\n")
    for name, contest in CONTESTS.items():
        found = result["results"][name] = compare(*contest)
        sys.stdout.write(
            f"{name:22} batch {found['batch_s']:6.2f} s, loop {found['loop_s']:6.1f} s: "
            f"{found['loop_over_batch']:.1f} times; apart {found['apart']:.0e}\n"
        )
    for engine in ("numpy", "jax"):
        found = result["sizes"][engine] = {str(n): grow(engine, n) for n in SIZES}
        sys.stdout.write(f"{engine}: ns per update by states {found}\n")
    RESULTS.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
