"""Numbers as the pages print them."""

import math

MARKS = {-1: "▽", 0: "●", 1: "▲"}
"""Too cautious, honest, over-confident."""


def three_digits(x: float) -> str:
    """A number of three significant digits, such as 2,010.

    Parameters
    ----------
    x : float
        100 or more; what is smaller is rounded to whole units.

    Returns
    -------
    str
    """
    return f"{float(f'{x:.3g}'):,.0f}"


def compact(x: float) -> str:
    """A positive number in three or four characters.

    Parameters
    ----------
    x : float

    Returns
    -------
    str
    """
    if math.isnan(x):
        return ""
    if x >= 1e99:
        return "∞"
    if x >= 999.5:
        return f"1e{math.log10(x):.0f}"
    if x >= 9.95:
        return f"{x:.0f}"
    return f"{x:.1f}" if x >= 0.095 else "<.1"
