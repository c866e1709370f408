"""Bands of averages of chi-square variables."""

from typing import Any

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.chi_square import quantile


def chi_square_band(dof: int, runs: Any = 1, confidence: float = 0.95) -> tuple[Any, Any]:
    """Where the average over runs of a chi-square variable lies.

    Parameters
    ----------
    dof : int
        Degrees of freedom of each.
    runs : int or int array (...)
        How many are averaged.
    confidence : float
        Probability of the band, half of the rest on each side.

    Returns
    -------
    tuple of float or array (...)
        Lower and upper end.

    Raises
    ------
    ValueError
        A confidence not between 0 and 1, or fewer than one run or degree of freedom.
    """
    tail = tail_of(confidence)
    one, many = validation.number("dof", dof), validation.real_array("runs", runs, "")
    if one < 1 or np.any(many < 1):
        raise ValueError(f"dof and runs must be at least 1; found {dof} and {np.min(runs)}")
    total = one * many
    return tuple(quantile(p, total) / many for p in (tail, 1 - tail))


def tail_of(confidence: float) -> float:
    confidence = validation.number("confidence", confidence)
    if not 0 < confidence < 1:
        raise ValueError(f"confidence must be between 0 and 1; found {confidence}")
    return (1 - confidence) / 2
