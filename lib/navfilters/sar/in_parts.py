"""Work in parts, which fit the cache and go to two threads."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Part = TypeVar("Part")
Result = TypeVar("Result")


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


def in_threads(work: Callable[[Part], Result], parts: Iterable[Part]) -> list[Result]:
    """Do all parts of some work, of which none writes what another does.

    Where ``OPENBLAS_NUM_THREADS`` is 1, there is a process for each core, and no second thread.

    Parameters
    ----------
    work : callable
    parts : iterable
        Slices of an array; or whole images, which have parts of their own.

    Returns
    -------
    list
        What the work returns of each.
    """
    if os.environ.get("OPENBLAS_NUM_THREADS") == "1":
        return [work(part) for part in parts]
    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(work, parts))  # here an error in a thread is raised
