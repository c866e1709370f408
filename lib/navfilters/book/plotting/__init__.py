"""Figures: one identity per filter, curves, maps and diagrams."""

from navfilters.book.plotting.curves import (
    at_floor,
    curve,
    ellipse,
    ellipse_points,
    error_axes,
    label_ends,
    mark_failures,
    panels,
    sweep_panels,
)
from navfilters.book.plotting.drawings import block_diagram, coastlines, map_panels
from navfilters.book.plotting.matrices import honesty_matrix
from navfilters.book.plotting.spreads import nees_tails, nine_errors
from navfilters.book.plotting.styles import (
    BOUND,
    EKF,
    MEASUREMENT,
    ROBUST,
    SECOND_ORDER,
    STATIONS,
    STYLES,
    TRUTH,
    UKF,
    use_style,
)

__all__ = [
    "BOUND",
    "EKF",
    "MEASUREMENT",
    "ROBUST",
    "SECOND_ORDER",
    "STATIONS",
    "STYLES",
    "TRUTH",
    "UKF",
    "at_floor",
    "block_diagram",
    "coastlines",
    "curve",
    "ellipse",
    "ellipse_points",
    "error_axes",
    "honesty_matrix",
    "label_ends",
    "map_panels",
    "mark_failures",
    "nees_tails",
    "nine_errors",
    "panels",
    "sweep_panels",
    "use_style",
]
