"""Perea, How, Breger and Elosegui (2007): range and bearing of a fixed point."""

from navfilters.papers.perea2007.experiment import (
    FILTERS,
    Setup,
    deviations,
    improvement,
    isotropic,
    position_error,
)
from navfilters.papers.perea2007.recycling import false_information

__all__ = [
    "FILTERS",
    "Setup",
    "deviations",
    "false_information",
    "improvement",
    "isotropic",
    "position_error",
]
