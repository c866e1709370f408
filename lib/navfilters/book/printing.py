"""Numbers as the pages print them."""


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
