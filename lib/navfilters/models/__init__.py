"""Measurement models: frozen, checked when made, batched in front."""

from navfilters.models.linear import Linear
from navfilters.models.range_bearing import RangeBearing

__all__ = ["Linear", "RangeBearing"]
