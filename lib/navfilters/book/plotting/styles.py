"""One identity per filter through the whole book."""

from typing import Any

from navfilters.numerics.extras import missing

try:
    import matplotlib.pyplot as plt
except ImportError as error:
    raise missing("matplotlib", "navfilters[book]", "plotting", error) from None


EKF, SECOND_ORDER, UKF, MEASUREMENT = "#D55E00", "#009E73", "#0072B2", "#E69F00"

ROBUST, CORRECTED, LATER = "#CC79A7", "#882255", "#56B4E9"

TOLD, MIXED, FADING = "#332288", "#7F5A2A", "#AA4499"

TRUTH, BOUND = "black", "0.55"

_DASHES: dict[str, Any] = {
    "plain": "-",
    "dashed": (0, (5, 2)),
    "dotted": (0, (1, 1.4)),
    "dash-dot": (0, (6, 2, 1, 2)),
    "long dash": (0, (11, 3)),
    "dash-dot-dot": (0, (6, 2, 1, 2, 1, 2)),
    "short dash": (0, (2.5, 1.5)),
}

_VARIANTS = {
    "EKF": (EKF, "plain", "o"),
    "B-EKF 1": (EKF, "dashed", "s"),
    "underweighted EKF": (EKF, "short dash", "X"),
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
    "SR-EKF": (EKF, "dash-dot-dot", "P"),
    "GSOF": (SECOND_ORDER, "dotted", "^"),
    "CKF": (UKF, "dotted", "^"),
    "IEKF": (CORRECTED, "plain", "o"),
    "RUF": (CORRECTED, "dashed", "s"),
    "IPLF": (CORRECTED, "dotted", "^"),
    "RC-EKF": (CORRECTED, "dash-dot", "D"),
    "RC-UKF": (CORRECTED, "long dash", "v"),
    "gate": (ROBUST, "dash-dot", "D"),
    "IMM": (LATER, "plain", "o"),
    "VB": (LATER, "dashed", "s"),
    "considered": (LATER, "dash-dot", "D"),
    "converted": (LATER, "dotted", "^"),
    "converted at mean": (LATER, "dash-dot-dot", "P"),
    "polar": (LATER, "long dash", "v"),
    "AREKF, tuned": (ROBUST, "long dash", "X"),
    "strong tracking": (ROBUST, "dotted", "^"),
    "strong tracking, softened": (FADING, "dashed", "D"),
    "constant Q": (MIXED, "plain", "s"),
    "thrust as state": (MIXED, "dashed", "D"),
    "IMM, strength": (MIXED, "dash-dot", "*"),
    "timed Q": (TOLD, "plain", "s"),
    "timed thrust vector": (TOLD, "dashed", "D"),
    "timed strength": (TOLD, "dash-dot", "*"),
}

STYLES: dict[str, dict[str, Any]] = {
    name: {"color": color, "linestyle": _DASHES[dash], "marker": marker}
    for name, (color, dash, marker) in _VARIANTS.items()
}
"""Matplotlib keywords of each filter."""

STATIONS: dict[str, dict[str, Any]] = {
    name: {"color": color, "marker": marker, "markersize": 3.5, "linestyle": "none"}
    for name, color, marker in (
        ("Uralla", "#0072B2", "o"),
        ("Kumsan", "#D55E00", "^"),
        ("Pretoria", "#009E73", "s"),
        ("Fucino", "#CC79A7", "x"),
        ("CastleRock", "black", "+"),
    )
}
"""Matplotlib keywords of each ground station."""


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
    if "inline" in plt.get_backend():
        _draw_to_show()


def _draw_to_show() -> None:
    """Let a notebook draw a cell's figures when it shows them, and pyplot not once before."""
    from IPython import get_ipython

    shell = get_ipython()
    if shell is None:  # a script that a notebook started has its backend
        return
    plt.switch_backend(plt.get_backend())  # else the first figure does, and connects again
    plt.uninstall_repl_displayhook()
    hooks = shell.events.callbacks["post_execute"]
    if _lay_all_out not in hooks:
        hooks.insert(0, _lay_all_out)  # registered, it would come when they have been shown


def _lay_all_out() -> None:
    """What figures keep of a drawing: a constrained layout is still better the second time."""
    for number in plt.get_fignums():
        lay_out(plt.figure(number))


def lay_out(figure: Any) -> None:
    """Put a figure's axes where a drawing would, which costs half of it if there is a layout."""
    if engine := figure.get_layout_engine():
        engine.execute(figure)
    else:
        figure.draw_without_rendering()
