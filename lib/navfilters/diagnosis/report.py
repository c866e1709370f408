"""A diagnosis in words, as a picture, and as a command."""

import argparse
import json
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from navfilters.diagnosis.diagnose import Diagnosis, diagnose, moment
from navfilters.diagnosis.log_file import LogError, read_log
from navfilters.numerics.extras import needed
from navfilters.runs import stored_arrays


def text(found: Diagnosis, ignored: Sequence[str] = ()) -> str:
    """What was found, in lines.

    Parameters
    ----------
    found : Diagnosis
    ignored : sequence of str
        Columns that were not used.

    Returns
    -------
    str
    """
    updates = int(np.isfinite(found.nis).sum())
    first, last = (moment(found.time[i], found) for i in (0, -1))
    lines = [
        f"{updates} updates from {first} to {last}, in the log's unit of time",
        f"NIS over its degrees of freedom: {found.ratio:.3f} ({found.low:.3f} to {found.high:.3f})",
    ]
    for c in found.channels:
        shares = ", ".join(f"{s:.1%}" for s in c.within)
        lines.append(
            f"channel {c.number}: {c.count} measured, bias {c.bias:+.2f} deviations, variance in S "
            f"times {c.scale:.3g} ({c.low:.3g} to {c.high:.3g}) would fit, within 1, 2, 3 "
            f"deviations {shares}, correlation {c.correlation:+.2f}"
        )
    if found.nees_ratio is not None:
        lines.append(
            f"NEES over n: {found.nees_ratio:.3f} ({found.nees_low:.3f} to {found.nees_high:.3f})"
        )
    if ignored:
        lines.append(f"columns not used: {', '.join(ignored)}")
    verdict = [f"WRONG: {finding}" for finding in found.findings]
    return "\n".join([*lines, *(verdict or [f"nothing wrong at {found.confidence:.0%}"])])


def figure(found: Diagnosis) -> Any:
    """NIS over its degrees of freedom against time, with the windows that are outside their bands.

    Parameters
    ----------
    found : Diagnosis

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ImportError
        Without Matplotlib.
    """
    needed("matplotlib", "navfilters[book]", "a picture of a diagnosis")
    from matplotlib.figure import Figure

    picture = Figure(figsize=(8.0, 3.6), layout="constrained")
    ax = picture.subplots()
    value = found.nis / np.where(found.dof > 0, found.dof, 1)
    ax.plot(found.time, value, ".", color="0.6", markersize=3, label="each update")
    for first, last, above, below in found.windows:
        wrong = above > 1 or below < 1
        level = np.nanmean(value[(found.time >= first) & (found.time <= last)])
        look, width, color = ("-", 3, "#D55E00") if wrong else ("--", 2, "#0072B2")
        ax.plot([first, last], [level, level], look, color=color, linewidth=width)
    ax.axhline(1.0, color="black", linewidth=0.8)
    ax.set(xlabel="time", ylabel="NIS over degrees of freedom", yscale="log")
    ax.set_title("windows: dashed inside their band, thick outside", fontsize=10)
    return picture


def main(arguments: Sequence[str] | None = None) -> int:
    """Read a log, say what is wrong with it.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line by default.

    Returns
    -------
    int
        0 if nothing was found, 1 if something was.
    """
    parser = argparse.ArgumentParser(
        prog="navfilters diagnose",
        description="Test a filter's log: NIS, bias, whiteness, coverage, and NEES with a truth.",
        epilog="Columns: time, innovation_i, S_ij; error_i, P_ij where a truth is known.",
    )
    parser.add_argument("log", type=Path, help="a CSV file with a header, or a Parquet file")
    parser.add_argument(
        "--angle",
        action="append",
        default=[],
        type=_angle,
        metavar="CHANNEL[:PERIOD]",
        help="a channel that wraps; its period is 2 pi by default",
    )
    parser.add_argument("--window", type=int, default=50, help="updates in a window")
    parser.add_argument("--confidence", type=float, default=0.95)
    parser.add_argument("--json", type=Path, help="write the numbers to this file")
    parser.add_argument("--plot", type=Path, help="write a picture to this file")
    chosen = parser.parse_args(arguments)
    if chosen.plot:
        needed("matplotlib", "navfilters[book]", "a picture of a diagnosis")
    try:
        log = read_log(chosen.log)
        found = diagnose(
            log,
            angles=dict(chosen.angle),
            window=chosen.window,
            confidence=chosen.confidence,
        )
    except (LogError, ValueError) as error:
        parser.error(str(error))
    except OSError as error:
        parser.error(f"{chosen.log}: {error.strerror}")
    sys.stdout.write(text(found, log.ignored) + "\n")
    try:
        if chosen.json:
            numbers = json.dumps(found.summary(), indent=1) + "\n"
            stored_arrays.write(chosen.json, numbers.encode())
        if chosen.plot:
            figure(found).savefig(chosen.plot)
    except OSError as error:
        parser.error(str(error))
    return int(not found.consistent)


def _angle(given: str) -> tuple[int, float]:
    channel, _, period = given.partition(":")
    try:
        return int(channel), float(period) if period else 2 * math.pi
    except ValueError:
        raise argparse.ArgumentTypeError(f"2 or 2:360 is meant; found {given!r}") from None
