"""Runs: one history, or many configurations, on either engine; and tests of consistency."""

from navfilters.runs.consistency import (
    chi_square_band,
    coverage,
    mean_nees,
    nees,
    nis,
    sample_deviation,
)

__all__ = ["chi_square_band", "coverage", "mean_nees", "nees", "nis", "sample_deviation"]
