"""A matrix of pairs, each with two numbers: how large an error is, and how honest its filter."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from navfilters.book.printing import MARKS, compact
from navfilters.numerics.extras import missing

try:
    import matplotlib.pyplot as plt
    from matplotlib.axes import Axes
    from matplotlib.patches import Rectangle
except ImportError as error:
    raise missing("matplotlib", "navfilters[book]", "plotting", error) from None


def honesty_matrix(
    rows: Sequence[str],
    columns: Sequence[str],
    ratio: Any,
    honesty: Any,
    honest: Any,
    *,
    lost: Any = False,
    lines: Sequence[int] = (),
    worst: float = 1e3,
) -> tuple[Any, Axes]:
    """Cells with an error above and an honesty below, shaded by the error, framed where honest.

    Parameters
    ----------
    rows, columns : sequence of str
    ratio, honesty : array-like (rows, columns)
        Error over a reference, NEES over its expectation, above 1000 without its number; NaN where
        there is no pair.
    honest : int array-like (rows, columns)
        -1, 0 or 1: see ``MARKS``.
    lost : bool array-like (rows, columns)
        Pairs of which only that is known.
    lines : sequence of int
        Rows above which a line is drawn.
    worst : float
        Ratio from which cells are darkest.

    Returns
    -------
    tuple of Figure, Axes
    """
    ratio, honesty = np.asarray(ratio, float), np.asarray(honesty, float)
    lost = np.broadcast_to(np.asarray(lost, bool), ratio.shape)
    figure, ax = plt.subplots(figsize=(4.3, 0.9 + 0.275 * len(rows)))
    shades = plt.get_cmap("YlOrBr")
    with np.errstate(all="ignore"):
        level = np.where(lost, 1.0, np.clip(np.log10(ratio) / np.log10(worst), 0, 1))
    for i, j in np.ndindex(ratio.shape):
        if np.isnan(ratio[i, j]):
            ax.text(j, i, "–", ha="center", va="center", fontsize=7, color="0.5")
            continue
        shade = shades(0.95 * level[i, j]) if level[i, j] > 0 else (1.0, 1.0, 1.0, 1.0)
        ax.add_patch(Rectangle((j - 0.5, i - 0.5), 1, 1, facecolor=shade, edgecolor="0.8", lw=0.4))
        ink = "white" if np.dot(shade[:3], (0.3, 0.6, 0.1)) < 0.5 else "black"
        text: dict[str, Any] = {"ha": "center", "va": "center", "color": ink}
        if lost[i, j]:
            ax.text(j, i, "lost", fontsize=6.5, **text)
            continue
        ax.text(j, i - 0.23, compact(ratio[i, j]), fontsize=7, fontweight="bold", **text)
        mark = MARKS[int(honest[i][j])]
        below = ">1000" if honesty[i, j] > 1000 else compact(honesty[i, j])
        ax.text(j, i + 0.24, f"{mark}{below}", fontsize=5.8, **text)
        if honest[i][j] == 0:
            inner = Rectangle((j - 0.45, i - 0.45), 0.9, 0.9, fill=False, edgecolor=ink, lw=1.1)
            ax.add_patch(inner)
    for row in lines:
        ax.axhline(row - 0.5, color="black", linewidth=0.8)
    ax.set(xlim=(-0.5, len(columns) - 0.5), ylim=(len(rows) - 0.5, -0.5))
    ax.set_xticks(range(len(columns)), columns, rotation=60, ha="left", fontsize=7)
    ax.set_yticks(range(len(rows)), rows, fontsize=7)
    ax.tick_params(length=0, pad=1, top=False, labeltop=True, labelbottom=False)
    ax.grid(False)
    ax.spines[:].set_visible(False)
    return figure, ax
