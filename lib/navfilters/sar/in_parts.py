"""Work in parts, which fit the cache and go to two threads."""

import os
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

    Where ``OPENBLAS_NUM_THREADS`` is 1, there is a process for each core, and no second thread.

    Parameters
    ----------
    work : callable
    parts : list of slice
    """
    if os.environ.get("OPENBLAS_NUM_THREADS") == "1":
        for part in parts:
            work(part)
        return
    with ThreadPoolExecutor(2) as pool:
        for _ in pool.map(work, parts):
            pass  # here an error in a thread is raised
