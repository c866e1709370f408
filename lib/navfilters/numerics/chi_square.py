"""Quantiles of chi-square variables."""

from navfilters.types import Array


def quantile(p: float, dof: Array) -> Array:
    """Below which a chi-square variable is with a probability.

    Parameters
    ----------
    p : float
    dof : float or array (...)
        Degrees of freedom.

    Returns
    -------
    float or array (...)
        As of scipy.stats, which takes longer to import than the rest of the library.
    """
    from scipy.special import gammaincinv  # filters need no SciPy to be imported

    return 2 * gammaincinv(dof / 2, p)
