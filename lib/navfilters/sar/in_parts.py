"""Work in parts, which fit the cache and go to two threads."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from threading import Lock, Semaphore
from typing import TypeVar

Part = TypeVar("Part")
Result = TypeVar("Result")

_SECOND_CORE = Semaphore()
"""Held while two threads are at work."""


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

    Two threads at most are at work, however deep parts are made of parts: what one of them calls
    has a second thread as soon as the other has nothing left. Where ``OPENBLAS_NUM_THREADS`` is 1,
    there is a process for each core, and no second thread.

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
    numbered, done = list(enumerate(parts)), dict[int, Result]()
    alone = os.environ.get("OPENBLAS_NUM_THREADS") == "1"
    if alone or not _SECOND_CORE.acquire(blocking=False):
        return [work(part) for _, part in numbered]
    todo, first_to_end = iter(numbered), Lock()

    def share() -> None:
        try:
            for k, part in todo:  # each thread takes the next
                done[k] = work(part)
        except BaseException:
            list(todo)  # nothing is left to do
            raise
        finally:
            if first_to_end.acquire(blocking=False):
                _SECOND_CORE.release()

    with ThreadPoolExecutor(1) as pool:
        other = pool.submit(share)
        share()
        other.result()  # here an error in that thread is raised
    return [done[k] for k, _ in numbered]
