"""The pictures of a report, each a string of SVG."""

from collections.abc import Callable
from functools import cache
from io import StringIO
from typing import Any

import numpy as np

from navfilters.crash.comparison import Course, band, champion, course, of_cure
from navfilters.crash.problem_checks import DIGIT, Followed, Map, Swept, starts, sweeps
from navfilters.crash.subject import Subject
from navfilters.estimators import FILTERS
from navfilters.numerics.extras import needed
from navfilters.types import Array

YOURS, EKF, BEST = (
    {"color": "#0072B2", "linestyle": "-", "linewidth": 2.2},
    {"color": "#D55E00", "linestyle": "--", "linewidth": 1.4},
    {"color": "#117755", "linestyle": "-.", "linewidth": 1.4},
)


def figures(kept: Any) -> list[tuple[str, str]]:
    """The pictures of a finding.

    Parameters
    ----------
    kept : mapping
        As of :class:`~navfilters.crash.report.Finding`.

    Returns
    -------
    list of tuple (SVG, description)

    Raises
    ------
    ImportError
        Without Matplotlib.
    """
    draw: dict[str, Callable[[Any], tuple[str, str]]] = {
        "map": _map,
        "sweeps": _sweeps,
        "runs": _runs,
    }
    return [draw[name](value) for name, value in kept.items()]


def _new(rows: int, columns: int, size: tuple[float, float], **options: Any) -> tuple[Any, Any]:
    needed("matplotlib", "navfilters[book]", "the pictures of a report")
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(rows, columns, **options)
    for ax in np.ravel(axes):
        ax.grid(True, color="0.9", linewidth=0.6)
        ax.spines[["top", "right"]].set_visible(False)
    return figure, axes


def _svg(figure: Any) -> str:
    from matplotlib import rc_context

    file = StringIO()
    with rc_context({"svg.hashsalt": "navfilters", "svg.fonttype": "path"}):
        figure.savefig(file, format="svg", metadata={"Date": None})
    text = file.getvalue()
    return text[text.index("<svg") :]


@cache
def _ekf(check: Callable[[Subject], Any]) -> Any:
    """What the book's EKF makes of a check."""
    subject = Subject(FILTERS["EKF"])
    list(check(subject))
    return subject.kept


def _map(found: Map) -> tuple[str, str]:
    figure, axes = _new(1, 2, (5.6, 3.3), sharey=True)
    names = "your filter", "the book's EKF"
    for ax, name, each in zip(axes, names, (found, _ekf(starts)["map"]), strict=True):
        x, y = (np.unique(each.mean[:, i]) for i in (0, 1))
        size = len(y), len(x)
        gain = np.where(np.isfinite(each.gain), each.gain, np.inf)
        shown = np.clip(np.log10(np.maximum(gain, 1e-99)), -4, 1).reshape(size)
        image = ax.pcolormesh(x, y, shown, cmap="cividis", vmin=-4, vmax=1)
        bad = each.mean[gain > DIGIT]
        ax.plot(*bad.T, "x", color="black", markersize=6, markeredgewidth=1.6)
        ax.plot(100, 100, "*", color="white", markeredgecolor="black", markersize=13)
        ax.set_title(f"{name}: {len(bad)} of {len(gain)} fail", fontsize=10)
        ax.set(xlabel="first estimate, x1 (units)", aspect="equal")
        ax.grid(False)
    axes[0].set_ylabel("first estimate, x2 (units)")
    bar = figure.colorbar(image, ax=axes, ticks=[-4, -3, -2, -1, 0, 1], shrink=0.85)
    bar.set_label("last error over the first")
    bar.ax.set_yticklabels(["1e-4", "1e-3", "0.01", "0.1", "1", "10"])
    return _svg(figure), (
        "Divergence map: what is left of the first error after 100 perfect measurements, from 64 "
        "first estimates. Crosses gain less than a digit; the star is the truth."
    )


def _sweeps(found: dict[str, Swept]) -> tuple[str, str]:
    figure, axes = _new(1, 2, (5.6, 3.1), sharey=True)
    labels = "deviation of the start (units)", "ratio of the noises (units/rad)"
    for ax, label, (name, mine) in zip(axes, labels, found.items(), strict=True):
        theirs = _ekf(sweeps)["sweeps"][name]
        ax.loglog(mine.parameter, _floored(mine.gain), **YOURS, marker="o", markersize=4)
        ax.loglog(mine.parameter, _floored(theirs.gain), **EKF)
        limit = np.maximum(DIGIT, 2 * mine.exact)
        ax.loglog(mine.parameter, limit, color="black", linewidth=1, linestyle=":")
        ax.set_xlabel(label)
    axes[0].set_ylabel("last error over the first")
    lines = axes[0].lines
    names = ["your filter", "the book's EKF", "limit"]
    figure.legend(lines, names, loc="outside upper center", ncols=3, frameon=False)
    return _svg(figure), (
        "Sweeps of Eq. (27): what is left of the first error after 100 perfect measurements. A "
        "gap is no number."
    )


def _floored(values: Array) -> Array:
    return np.where(np.isfinite(values), np.maximum(values, 1e-16), np.nan)


def _runs(found: Followed) -> tuple[str, str]:
    problem, runs = found.problem, found.runs
    best = champion(problem.name)
    mine = course(problem, found.history, runs)
    drawn: list[tuple[str, Course, dict[str, Any]]] = [
        ("your filter", mine, YOURS),
        ("the book's EKF", of_cure(problem.name, "EKF", runs), EKF),
    ]
    if best not in ("", "EKF"):
        drawn.append((f"its best honest one: {best}", of_cure(problem.name, best, runs), BEST))
    figure, axes = _new(3, 1, (5.6, 7.2), sharex=True)
    update = np.arange(len(mine.error))
    for name, each, look in drawn:
        axes[0].plot(update, each.error, label=name, **look)
        axes[1].plot(update, each.nees, **look)
        if each.nis is not None:
            axes[2].plot(update, each.nis, **look)
    thin = YOURS | {"linestyle": ":", "linewidth": 1.6}
    axes[0].plot(update, mine.claimed, label="what yours claims", **thin)
    n = found.history.estimate.cov.shape[-1] if problem.tested is None else len(problem.tested)
    _banded(axes[1], band(n, problem, runs))
    _banded(axes[2], band(problem.model.R.shape[-1], problem, runs))
    if mine.nis is None:
        axes[2].set_title("your filter tells no innovations", fontsize=9)
    axes[0].set_ylabel(f"error ({problem.unit})")
    axes[1].set_ylabel("NEES over its expectation")
    axes[2].set(ylabel="NIS over its expectation", xlabel="update")
    for ax in axes:
        ax.set_yscale("log")
        ax.yaxis.set_minor_formatter("")
    _within(axes[1])
    _within(axes[2])
    figure.legend(loc="outside upper center", ncols=2, frameon=False)
    return _svg(figure), (
        f"{problem.name}, {runs} runs: median error beside what the filter claims, and NEES and "
        "NIS over their expectations, with the bands in which 95 % of an honest filter's are."
    )


def _banded(ax: Any, ends: tuple[float, float]) -> None:
    ax.axhspan(*ends, color="0.85", zorder=0)
    ax.axhline(1.0, color="black", linewidth=0.8)


def _within(ax: Any) -> None:
    """The decades that are read, at least two: what lies outside ends at the edge."""
    low, high = ax.get_ylim()
    ax.set_ylim(min(max(low, 1e-3), 0.08), min(max(high, 12.0), 1e4))
