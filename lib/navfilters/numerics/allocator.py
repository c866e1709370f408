"""What the allocator is told, so that temporary arrays do not come from the system each time."""

from functools import lru_cache

import numpy as np

LARGER_THAN_TEMPORARIES = 2**20
"""Elements of a block that is larger than any temporary array of a chunk that fits the cache."""


@lru_cache  # once in a process
def keep_freed_memory() -> None:
    """Let the allocator of GNU systems keep what temporary arrays give back.

    Until it has seen a larger block come and go, it returns the end of its heap to the system at
    every opportunity and asks for it again, page by page, in the next operation: more than half of
    the time of an update of 1e4 members. Where the allocator is another, nothing happens.
    """
    np.empty(LARGER_THAN_TEMPORARIES)
