"""Readers of files of which each breaks in its own way at a byte that no valid file has."""

import os
import time
from pathlib import Path

from readers import Reader


def raises(path: Path) -> None:
    raise KeyError(path.name)


def hides_the_name(path: Path) -> None:
    del path
    raise ValueError("it is wrong")


def takes_memory(path: Path) -> None:
    del path
    bytearray(2**26)


def broken(what):
    """A reader that does so where the file does not begin as a valid one."""

    def read(path: Path) -> None:
        if not path.read_bytes().startswith(b"whole"):
            what(path)

    return Reader("file", "text", lambda path: [b"whole 1\n"], read, ValueError, ("navfilters",))


READERS = {
    "sound": broken(lambda path: None),
    "raises": broken(raises),
    "hides the name": broken(hides_the_name),
    "takes memory": broken(takes_memory),
    "ends the interpreter": broken(lambda path: os.abort()),
    "hangs": broken(lambda path: time.sleep(3600)),
}
