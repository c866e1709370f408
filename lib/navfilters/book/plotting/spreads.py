"""Errors of many runs beside what a filter predicts of them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from navfilters.book.plotting.curves import panels
from navfilters.book.plotting.styles import BOUND, EKF, MEASUREMENT, SECOND_ORDER, TRUTH, UKF
from navfilters.numerics.chi_square import quantile

SPREADS: dict[str, dict[str, Any]] = {
    "predicted": {"color": MEASUREMENT, "linestyle": "-", "linewidth": 2.4},
    "sample": {"color": UKF, "linestyle": "--", "linewidth": 1.6},
    "sample, predicted geometry": {"color": SECOND_ORDER, "linestyle": "-.", "linewidth": 1.4},
    "sample, open loop": {"color": EKF, "linestyle": ":", "linewidth": 3.0},
}
"""Matplotlib keywords of each kind of deviation."""


def nine_errors(
    times: Any,
    errors: Any,
    mean: Any,
    deviations: Mapping[str, Any],
    limits: Sequence[float],
    *,
    marker: str = "",
) -> Any:
    """The nine errors of a SAR navigation over time, one panel a component.

    Grey is a run, the dashed line in the middle the mean, and the coloured ones are three
    deviations to each side.

    Parameters
    ----------
    times : array (t,)
        s.
    errors : array (t, runs, 9)
        Position, m, velocity, m/s, misalignment, rad; the last is drawn in degrees.
    mean : array (t, 9)
    deviations : mapping of str to array (t, 9)
        By keys of ``SPREADS``.
    limits : sequence of float
        Of the three rows: m, m/s, deg.
    marker : str
        At each time, where there are few.

    Returns
    -------
    Figure
    """
    figure, axes = panels(3, 3, figsize=(8.0, 6.4), sharex=True, sharey="row")
    units = ("position", "m", 1.0), ("velocity", "m/s", 1.0), ("misalignment", "deg", np.rad2deg(1))
    for i, ax in enumerate(axes):
        (what, unit, scale), limit = units[i // 3], limits[i // 3]
        ax.plot(times, scale * errors[..., i], color="0.8", linewidth=0.4, antialiased=False)
        style: dict[str, Any] = {
            "color": TRUTH,
            "linestyle": (0, (2, 2)),
            "linewidth": 1.2,
            "marker": marker,
        }
        ax.plot(times, scale * mean[:, i], label="mean", **style)
        for name, found in deviations.items():
            bound, line = 3 * scale * found[:, i], {"marker": marker, **SPREADS[name]}
            ax.plot(times, bound, label=name, **line)
            ax.plot(times, -bound, **line)
        ax.set(xlim=(0, times[-1]), ylim=(-limit, limit))
        if i < 3:
            ax.set_title("xyz"[i], fontsize=10)
        if i % 3 == 0:
            ax.set_ylabel(f"{what} ({unit})")
        if i >= 6:
            ax.set_xlabel("time (s)")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return figure


def nees_tails(
    values: Mapping[str, Any], styles: Mapping[str, Mapping[str, Any]], dof: int = 9
) -> Any:
    """The fraction of the runs whose NEES exceeds a value.

    Dotted is the chi-square distribution of a consistent filter, grey its bound of one percent.

    Parameters
    ----------
    values : mapping of str to array (runs,)
    styles : mapping of str to mapping
        Matplotlib keywords of each line.
    dof : int

    Returns
    -------
    Figure
    """
    from scipy.special import chdtrc  # which most figures need not import

    figure, (ax,) = panels(1, 1, figsize=(7.0, 3.8))
    grid = np.linspace(0, 60, 200)
    right = chdtrc(dof, grid)
    ax.plot(grid, right, linestyle=":", color=TRUTH, label="chi-square")
    for name, each in values.items():
        fraction = 1 - np.arange(len(each)) / len(each)
        ax.step(np.sort(each), fraction, label=name, **styles[name])
    ax.axvline(quantile(0.99, dof), color=BOUND, linewidth=1)
    ax.set(yscale="log", xlim=(0, 160), ylim=(1.5e-3, 1.2))
    ax.set(xlabel="NEES", ylabel="fraction above")
    ax.legend()
    return figure
