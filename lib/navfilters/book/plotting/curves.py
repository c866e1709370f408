"""Curves of errors, sweeps and ellipses."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from navfilters.numerics.extras import missing

try:
    import matplotlib.pyplot as plt
    from matplotlib.axes import Axes
except ImportError as error:
    raise missing("matplotlib", "navfilters[book]", "plotting", error) from None
from navfilters.book.plotting.styles import BOUND, STYLES, TRUTH, lay_out


def error_axes(ax: Axes, *, log_k: bool = True) -> None:
    """Axes of position error against update number, logarithmic as in the paper.

    Parameters
    ----------
    ax : Axes
    log_k : bool
        Whether the update number is logarithmic too.
    """
    ax.set(xlabel="update k", ylabel="position error (units)", yscale="log")
    if log_k:
        ax.set_xscale("log")


def curve(ax: Axes, name: str, x: Any, y: Any, **changes: Any) -> None:
    """One filter's curve in its own style, with some twelve markers spread evenly over the axis.

    Parameters
    ----------
    ax : Axes
        Its x scale must be set already.
    name : str
        A key of ``STYLES``; also the curve's label.
    x, y : array-like (k,)
    **changes
        Matplotlib keywords that replace those of the style.
    """
    x, y = np.asarray(x, float), np.asarray(y, float)
    place = np.log(np.maximum(x, 1e-300)) if ax.get_xscale() == "log" else x
    wanted = np.linspace(place[0], place[-1], 12)
    marks = sorted({int(np.abs(place - w).argmin()) for w in wanted})
    style = {"label": name, "markevery": marks, "markerfacecolor": "white", **STYLES[name]}
    ax.plot(x, y, **{**style, **changes})


def label_ends(ax: Axes, *, gap: float = 11.0, names: Mapping[str, str] | None = None) -> None:
    """Write each curve's name to the right of where it ends, moved apart where they would touch.

    Parameters
    ----------
    ax : Axes
        With final limits and scales.
    gap : float
        Least distance between two names, points.
    names : mapping, optional
        Other text for some of the labels.
    """
    figure = ax.get_figure(root=True)
    assert figure is not None
    lay_out(figure)
    lines = [
        line
        for line in ax.get_lines()
        if not str(line.get_label()).startswith("_")
        and np.isfinite(np.asarray(line.get_ydata(), float)).any()
    ]
    scale = figure.dpi / 72
    low, high = ax.bbox.y0 / scale, ax.bbox.y1 / scale
    ends = []
    for line in lines:
        x, y = (np.asarray(v, float) for v in (line.get_xdata(), line.get_ydata()))
        last = np.flatnonzero(np.isfinite(y))[-1]
        height = ax.transData.transform((x[last], y[last]))[1] / scale
        ends.append((min(max(height, low), high), line))
    ends.sort(key=lambda end: end[0])
    heights = _spread([end[0] for end in ends], gap, low, high)
    for height, (_, line) in zip(heights, ends, strict=True):
        label = str(line.get_label())
        ax.annotate(
            (names or {}).get(label, label),
            (1.0, (height - low) / (high - low)),
            xycoords="axes fraction",
            xytext=(6, 0),
            textcoords="offset points",
            color=line.get_color(),
            fontsize=9,
            va="center",
            annotation_clip=False,
        )


def _spread(heights: Sequence[float], gap: float, low: float, high: float) -> list[float]:
    """Sorted heights moved as little as it takes to be a gap apart between low and high."""
    placed = list(heights)
    for _ in range(200):
        for i in range(len(placed) - 1):
            lack = gap - (placed[i + 1] - placed[i])
            if lack > 0:
                placed[i] -= lack / 2
                placed[i + 1] += lack / 2
        placed = [
            min(max(y, low + i * gap), high - (len(placed) - 1 - i) * gap)
            for i, y in enumerate(placed)
        ]
    return placed


def ellipse_points(mean: Any, cov: Any, size: float = 1.0, points: int = 400) -> np.ndarray:
    """Points on the ellipse (x - mean)^T cov^-1 (x - mean) = size^2.

    Parameters
    ----------
    mean : array-like (2,)
    cov : array-like (2, 2)
        Symmetric positive definite.
    size : float
        Its half axes, in deviations.
    points : int

    Returns
    -------
    array (points, 2)
    """
    w, V = np.linalg.eigh(np.asarray(cov, float))
    t = np.linspace(0, 2 * np.pi, points)
    circle = np.stack([np.cos(t), np.sin(t)])
    return np.asarray(mean) + size * ((V * np.sqrt(w)) @ circle).T


def ellipse(ax: Axes, mean: Any, cov: Any, size: float = 1.0, **style: Any) -> None:
    """Draw a covariance as its ellipse.

    Parameters
    ----------
    ax : Axes
    mean : array-like (2,)
    cov : array-like (2, 2)
    size : float
        Its half axes, in deviations.
    **style
        Matplotlib keywords of the line.
    """
    line = {"color": TRUTH, "linewidth": 1.2, **style}
    ax.plot(*ellipse_points(mean, cov, size).T, **line)


def mark_failures(ax: Axes, x: Any, failed: Any, name: str, row: int = 0) -> int:
    """Mark the members of a sweep that failed on the upper edge of the axes.

    Parameters
    ----------
    ax : Axes
    x : array-like (k,)
    failed : bool array-like (k,)
    name : str
        The filter, for its colour and marker.
    row : int
        How many rows of marks lie above.

    Returns
    -------
    int
        How many failed.
    """
    x, failed = np.asarray(x), np.asarray(failed, bool)
    if not failed.any():
        return 0  # an unclipped line without points would break the figure's layout
    ax.plot(
        x[failed],
        np.full(failed.sum(), 0.985 - 0.03 * row),
        transform=ax.get_xaxis_transform(),
        linestyle="none",
        marker="x",
        color=STYLES[name]["color"],
        clip_on=False,
        label=f"_{name} failed",
    )
    return int(failed.sum())


def at_floor(y: Any, floor: float) -> np.ndarray:
    """Exact zeros moved to a floor, so that a logarithmic axis has a place for them.

    Parameters
    ----------
    y : array-like
    floor : float

    Returns
    -------
    array
    """
    y = np.asarray(y, float)
    return np.where(y == 0, floor, y)


def panels(rows: int, columns: int, **keywords: Any) -> tuple[Any, Sequence[Axes]]:
    """A figure of several axes, as a flat list.

    Parameters
    ----------
    rows, columns : int
    **keywords
        Those of ``matplotlib.pyplot.subplots``.

    Returns
    -------
    tuple of Figure, list of Axes
    """
    figure, axes = plt.subplots(rows, columns, squeeze=False, **keywords)
    return figure, list(axes.flat)


_FAMILIES = (
    ("EKF", "B-EKF 1", "B-EKF 2", "B-EKF 3", "B-EKF 4"),
    ("mtSOF", "B-mtSOF"),
    ("UKF", "B-UKF", "UKFz"),
)


def sweep_panels(
    x: Any, results: Mapping[str, Any], xlabel: str, *, floor: float, log_x: bool = True
) -> tuple[Any, Sequence[Axes]]:
    """The indicator I of ten filters over a sweep, one panel for each family, one axis for all.

    Exact zeros are drawn at the floor; failed members as crosses on the upper edge, and counted
    there.

    Parameters
    ----------
    x : array-like (k,)
    results : mapping of str to array (k,)
        I of each filter; NaN where it failed.
    xlabel : str
    floor : float
        Lower limit of the vertical axis.
    log_x : bool

    Returns
    -------
    tuple of Figure, list of Axes
    """
    figure, axes = panels(3, 1, figsize=(7.0, 8.2), sharex=True, sharey=True)
    for ax, family in zip(axes, _FAMILIES, strict=True):
        ax.set(yscale="log", ylim=(floor, 30), ylabel="improvement I", xlim=(min(x), max(x)))
        if log_x:
            ax.set_xscale("log")
        ax.axhline(1.0, color=BOUND, linewidth=1)
        for row, name in enumerate(family):
            y = np.asarray(results[name], float)
            curve(ax, name, x, at_floor(y, floor), linewidth=1.3)
            count = mark_failures(ax, x, np.isnan(y), name, row)
            if count:
                ax.set_title(f"{name}: {count} of {y.size} failed", fontsize=9, loc="right")
    axes[-1].set_xlabel(xlabel)
    for ax in axes:
        label_ends(ax)
    return figure, axes
