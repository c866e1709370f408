"""A folder that one process at a time may write."""

import errno
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

LOCK = ".lock"
"""An empty file that stays in the folder. What counts is the system's lock on it."""

if sys.platform == "win32":
    import msvcrt

    def _lock(file: int) -> None:
        msvcrt.locking(file, msvcrt.LK_NBLCK, 1)

    REFUSED: type[OSError] = OSError
else:
    import fcntl

    def _lock(file: int) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)

    REFUSED: type[OSError] = BlockingIOError


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """A folder for this call alone. The system ends a lock with its process, however that ends.

    Parameters
    ----------
    folder : Path
        Made if it does not exist.

    Raises
    ------
    OSError
        It cannot be made or written, or another is at work in it (BlockingIOError); naming it.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = (folder / LOCK).open("a")
    except OSError as error:
        needed = f"a folder that can be written is needed ({error.strerror}); found"
        raise OSError(error.errno, needed, str(folder)) from error
    with file:
        try:
            _lock(file.fileno())
        except REFUSED:
            where = "another process works in this folder; wait for its end or use another folder"
            raise BlockingIOError(errno.EAGAIN, where, str(folder)) from None
        except OSError:  # a file system without locks: as good as it gets there
            pass
        yield
