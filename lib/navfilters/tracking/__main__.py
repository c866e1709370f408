"""All filters on the satellite that leaked: ``python -m navfilters.tracking --draws 100``."""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from navfilters.estimators import (
    FILTERS,
    LATER_FILTERS,
    AdaptiveRobust,
    GatedInflation,
    Robust,
    SigmaPoints,
    StrongTracking,
)
from navfilters.estimators.variants import Underweighting
from navfilters.numerics.extras import command
from navfilters.tracking.trials import STARTS, trial
from navfilters.tracking.w3b import flight

_EKF = FILTERS["EKF"]
CURES = {
    **{name: FILTERS[name] for name in ("EKF", "B-EKF 1", "mtSOF", "B-mtSOF")},
    **{name: FILTERS[name].having(points=SigmaPoints(kappa=0.0)) for name in ("UKF", "B-UKF")},
    "underweighted EKF": replace(_EKF, variant=Underweighting(0.2, 10)),
    **{name: LATER_FILTERS[name] for name in ("IEKF", "RUF", "GSOF")},
    "gate": replace(_EKF, rule=GatedInflation(probability=0.99)),
    "AREKF": replace(_EKF, rule=AdaptiveRobust(alpha=0.2, rho=0.0)),
    "AREKF, rho = 0.98": replace(_EKF, rule=AdaptiveRobust(alpha=0.2)),
    "STF": replace(_EKF, rule=StrongTracking(rho=0.0, beta=5.0)),
    "REKF": replace(_EKF, rule=Robust(gamma=2e4)),
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Fly every filter from every start, with and without a leak, and print how it ends.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line by default.
    """
    parser = argparse.ArgumentParser(
        prog="navfilters w3b", description="Every filter on the satellite that leaked."
    )
    parser.add_argument("--draws", type=int, default=8, help="starts of each size")
    parser.add_argument("--steps", type=int, help="so many of the 860 numbers; by default all")
    parser.add_argument("--filters", nargs="*", choices=CURES, default=list(CURES))
    chosen = parser.parse_args(arguments)
    if chosen.draws < 1 or (chosen.steps is not None and chosen.steps < 1):
        parser.error(
            f"--draws and --steps must be at least 1; found {chosen.draws}, {chosen.steps}"
        )
    real = trial(flight())
    leak = np.array([False, True])[:, None]
    starts = real.starts(STARTS, chosen.draws, leak=leak)
    sys.stdout.write("filter              leak   start (km)   astray   distance   deviation (m)\n")
    for name in chosen.filters:
        flown = real.fly(CURES[name], starts, steps=chosen.steps)
        distance, spread = real.errors(flown)[-1], flown.spread[-1]
        for j, known in enumerate(("no", "state")):
            for i, scale in enumerate(STARTS):
                d, s = distance[j, i], spread[j, i]
                astray = (~(d <= 3 * s)).sum()
                middle = [float(np.median(np.where(np.isnan(x), np.inf, x))) for x in (d, s)]
                sys.stdout.write(
                    f"{name:19} {known:5} {scale / 1e3:10.0f} {astray:5} of {chosen.draws:<3} "
                    f"{middle[0]:9.3g} {middle[1]:11.3g}\n"
                )


if __name__ == "__main__":
    command(main)
