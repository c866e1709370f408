"""What the allocator is told, so that temporary arrays do not come from the system each time."""

import ctypes
from contextlib import suppress
from functools import lru_cache

LARGER_THAN_TEMPORARIES = 2**23
"""Bytes of a block that is larger than any temporary array of a chunk that fits the cache."""

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
"""Their numbers in malloc.h of glibc."""


@lru_cache  # once in a process
def keep_freed_memory() -> None:
    """Let the allocator of GNU systems keep what temporary arrays give back.

    Else it returns the end of its heap to the system at every opportunity and asks for it again,
    page by page, in the next operation: more than half of the time of an update of 1e4 members. It
    would learn better from the first larger block that comes and goes, but not where a threshold is
    set from outside, as Dask does for its workers. Where the allocator is another, nothing happens.
    """
    with suppress(AttributeError, TypeError, OSError):  # no mallopt, or no handle of the program
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(M_MMAP_THRESHOLD, LARGER_THAN_TEMPORARIES)
        mallopt(M_TRIM_THRESHOLD, 2 * LARGER_THAN_TEMPORARIES)
