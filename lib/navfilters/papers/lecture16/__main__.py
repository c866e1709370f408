"""The lecture's three filters on the shaken pendulum: ``python -m navfilters.papers.lecture16``."""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from navfilters.estimators.catalogue import FILTERS
from navfilters.estimators.continuous import extended_kalman_bucy, linearized_kalman_bucy
from navfilters.numerics.extras import at_least, command
from navfilters.papers.lecture16.pendulum import Setup
from navfilters.papers.lecture16.sampling import discretised, sampled
from navfilters.runs.loop import run
from navfilters.runs.progress import bar
from navfilters.types import Array

TOLERANCES: dict[str, Any] = {"method": "RK45", "rtol": 1e-5, "atol": 1e-5}


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the error of the angle of each filter beside what it claims.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line by default.
    """
    parser = argparse.ArgumentParser(
        prog="navfilters lecture16", description="Three filters on a shaken pendulum."
    )
    parser.add_argument("--runs", type=int, default=8, help="with noise of their own")
    parser.add_argument(
        "--released", type=float, default=Setup.released, help="true angle at the start, rad"
    )
    parser.add_argument("--step", type=float, default=0.005, help="of the discrete EKF, s")
    chosen = parser.parse_args(arguments)
    at_least(parser, "--runs", chosen.runs, 1)
    if not 0 < chosen.step <= Setup.duration / 4:
        parser.error(f"--step must be above 0 and at most 5 s; found {chosen.step:g}")
    if not abs(chosen.released) <= np.pi:
        parser.error(f"--released must be within pi of 0; found {chosen.released:g}")
    setup, found = replace(Setup(), released=chosen.released), []
    with bar(chosen.runs) as done:
        for seed in range(1, chosen.runs + 1):
            found.append(errors(setup, seed, chosen.step))
            done(1)
    sys.stdout.write(
        f"Released at {setup.released:g} rad; over the second half of {setup.duration:g} s,\n"
        f"root mean square over {chosen.runs} runs (rad):\n\n"
        "filter    error   claimed\n"
    )
    for name in found[0]:
        error, claimed = np.sqrt(np.mean([np.square(one[name]) for one in found], axis=0))
        sys.stdout.write(f"{name:7}{error:8.3f}{claimed:10.3f}\n")


def errors(setup: Setup, seed: int, dt: float) -> dict[str, tuple[float, float]]:
    """Each filter's error of the angle over the second half, and the deviation that it claims, rad.

    Parameters
    ----------
    setup : Setup
    seed : int
        Of the noise.
    dt : float
        Step of the discrete EKF, s.

    Returns
    -------
    dict
        Two root mean squares by name: CT-LKF, CT-EKF, DT-EKF.
    """
    truth, y = setup.experiment(seed)
    system, prior, t = setup.system, setup.prior, np.linspace(0.0, setup.duration, 401)
    linearized = linearized_kalman_bucy(
        system, setup.reference(), prior, y, t, setup.control, **TOLERANCES
    )
    extended = extended_kalman_bucy(system, prior, y, t, setup.control, **TOLERANCES)
    steps = np.arange(int(setup.duration / dt + 1e-9) + 1) * dt
    discrete = discretised(system, dt)
    history = run(
        FILTERS["EKF"],
        prior,
        sampled(y, steps[1:]),
        discrete.sensor,
        dynamics=discrete.dynamics(sampled(setup.control, steps[:-1])),
        z_per_step=True,
    )

    def late(times: Array, mean: Array, cov: Array) -> tuple[float, float]:
        half = times >= setup.duration / 2
        miss = mean[half, 0] - sampled(truth, times[half])[:, 0]
        return float(np.sqrt(np.mean(miss**2))), float(np.sqrt(cov[half, 0, 0].mean()))

    return {
        "CT-LKF": late(t, linearized.mean, linearized.cov),
        "CT-EKF": late(t, extended.mean, extended.cov),
        "DT-EKF": late(steps, history.mean, history.cov),
    }


if __name__ == "__main__":
    command(main)
