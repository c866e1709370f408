"""The NEES at the end of the runs of Pogorelsky et al., as numbers and in words."""

import numpy as np

from navfilters.numerics.chi_square import quantile
from navfilters.papers.pogorelsky2020.open_loop import MonteCarlo
from navfilters.runs.consistency import nees
from navfilters.types import Array


def final_nees(result: MonteCarlo) -> Array:
    """NEES of each run at the last time.

    Parameters
    ----------
    result : MonteCarlo

    Returns
    -------
    array (runs,)
    """
    return nees(result.errors[-1], result.covariances[-1])


def nees_summary(values: Array, dof: int = 9) -> tuple[float, float, float, float]:
    """Mean, half its 95 % interval, median, and percent above the bound of one in a hundred.

    Parameters
    ----------
    values : array (runs,)
    dof : int
        Degrees of freedom of a consistent filter.

    Returns
    -------
    tuple of four floats
    """
    half = 1.96 * values.std() / np.sqrt(len(values))
    above = 100 * np.mean(values > quantile(0.99, dof))
    return float(values.mean()), float(half), float(np.median(values)), float(above)


def nees_line(values: Array, dof: int = 9) -> str:
    """The numbers of ``nees_summary`` as a line of text.

    Parameters
    ----------
    values, dof : array (runs,), int
        As of :func:`nees_summary`.

    Returns
    -------
    str
    """
    mean, half, median, above = nees_summary(values, dof)
    return f"{mean:5.1f} ± {half:.1f}, median {median:4.1f}, {above:4.1f} %"
