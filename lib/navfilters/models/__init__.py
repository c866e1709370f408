"""Measurement models: frozen, checked when made, batched in front."""

from navfilters.models.augmented import Augmented
from navfilters.models.converted import ConvertedRangeBearing
from navfilters.models.linear import Linear
from navfilters.models.polar import InPolar, PolarState, to_cartesian, to_polar
from navfilters.models.range_bearing import RangeBearing

__all__ = [
    "Augmented",
    "ConvertedRangeBearing",
    "InPolar",
    "Linear",
    "PolarState",
    "RangeBearing",
    "to_cartesian",
    "to_polar",
]
