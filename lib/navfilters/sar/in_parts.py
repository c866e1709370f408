"""Work in parts, which fit the cache and go to two threads."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


def blocks(n: int, most: int) -> list[slice]:
    """Slices of n lines, so many in each at most.

    Parameters
    ----------
    n, most : int

    Returns
    -------
    list of slice
    """
    return [slice(i, min(i + most, n)) for i in range(0, n, most)]


def in_threads(work: Callable[[slice], None], parts: list[slice]) -> None:
    """Do all parts of some work, of which none writes what another does.

    Parameters
    ----------
    work : callable
    parts : list of slice
    """
    with ThreadPoolExecutor(2) as pool:
        for _ in pool.map(work, parts):
            pass  # here an error in a thread is raised
