"""Table 1: ``python -m navfilters.papers.xiong2009 --variant B --seeds 20``; with ``--rivals`` the
fair comparison."""

import argparse
import sys
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from navfilters.numerics.extras import at_least, command
from navfilters.papers.xiong2009.experiment import ESTIMATORS, VARIANTS
from navfilters.papers.xiong2009.monte_carlo import rms_error
from navfilters.papers.xiong2009.rivals import AFTER, END, IN_BURNS, RIVALS, course, fly_rival
from navfilters.runs.progress import progress as progress_bar


def table(
    variant: str = "A",
    seeds: Sequence[int] = range(20),
    *,
    progress: Callable[[Iterable[Any]], Iterable[Any]] = iter,
) -> str:
    """Table 1 beside the paper's: median and range over seeds, of each filter, m.

    Parameters
    ----------
    variant : {"A", "B", "C", "D"}
    seeds : sequence of int
    progress : callable
        Wraps the iterable of filters.

    Returns
    -------
    str
        One line for each filter and each of its two sources.
    """
    lines = [f"{'':17}{'':10}" + "".join(f"{f'sigma_{i} (m)':>15}" for i in "xyzp")]
    for name, estimator in progress(ESTIMATORS.items()):
        ours = rms_error(name, variant, seeds)
        rows = {"median": np.median(ours, axis=0), "least": ours.min(axis=0)}
        rows |= {"largest": ours.max(axis=0), "paper": estimator.paper}
        for i, (label, row) in enumerate(rows.items()):
            numbers = "".join("-".rjust(15) if np.isnan(x) else f"{x:15.4g}" for x in row)
            lines.append(f"{'' if i else name:17}{label:10}{numbers}")
    return "\n".join(lines)


def comparison(
    variant: str = "A",
    seeds: Sequence[int] = range(24),
    *,
    progress: Callable[[Iterable[Any]], Iterable[Any]] = iter,
) -> str:
    """The paper's filters and their rivals: RMS errors over seeds, m, and mean NEES.

    Parameters
    ----------
    variant : {"A", "B", "C", "D"}
    seeds : sequence of int
    progress : callable
        Wraps the iterable of rivals.

    Returns
    -------
    str
        One line for each rival: errors through the burns, in the last 2000 s, and without burns
        (where those that are told of burns expect them); mean NEES of the same.
    """
    setup = VARIANTS[variant]
    flights = course(setup, seeds)
    columns = ("burns (m)", "end (m)", "quiet (m)", "NEES", "NEES", "NEES")
    lines = [f"{'':26}" + "".join(f"{column:>12}" for column in columns)]
    for name, rival in progress(RIVALS.items()):
        flown = fly_rival(rival, flights, setup)
        places = ((IN_BURNS, 0), (END, 0), (AFTER, 1))
        row = [flown.rms(updates)[0, k] for updates, k in places]
        row += [np.mean(flown.nees[updates, 0, k]) for updates, k in places]
        lines.append(f"{name:26}" + "".join(f"{x:12.4g}" for x in row))
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print Table 1, or the comparison.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line by default.
    """
    parser = argparse.ArgumentParser(
        prog="navfilters xiong2009", description="Table 1 of Xiong, Zhang and Liu (2009)."
    )
    parser.add_argument("--variant", choices=sorted(VARIANTS), default="A", help="noise reading")
    parser.add_argument("--seeds", type=int, default=20, help="number of runs")
    parser.add_argument("--rivals", action="store_true", help="other filters beside the paper's")
    chosen = parser.parse_args(arguments)
    at_least(parser, "--seeds", chosen.seeds, 1)
    text = (comparison if chosen.rivals else table)(
        chosen.variant, range(chosen.seeds), progress=progress_bar
    )
    sys.stdout.write(f"variant {chosen.variant}, {chosen.seeds} seeds\n{text}\n")


if __name__ == "__main__":
    command(main)
