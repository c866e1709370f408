"""Progress on stderr for the commands."""

import importlib
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any


def progress(updates: Iterable[Any]) -> Iterator[Any]:
    """An iterable, reported on as it is used.

    Parameters
    ----------
    updates : iterable
        Of finite length.

    Returns
    -------
    iterator
        The same.
    """
    updates = list(updates)
    with bar(len(updates)) as done:
        for update in updates:
            yield update
            done(1)


@contextmanager
def bar(total: int) -> Iterator[Callable[[int], None]]:
    """tqdm's bar with the time left where it is installed, a counter otherwise; both on stderr.

    Parameters
    ----------
    total : int
        Units of work.

    Yields
    ------
    callable
        To be told how many units more are done.
    """
    try:
        tqdm = importlib.import_module("tqdm").tqdm
    except ImportError:
        with _counter(total) as done:
            yield done
    else:
        with tqdm(total=total, leave=False, smoothing=0.1) as shown:
            yield shown.update


@contextmanager
def _counter(total: int) -> Iterator[Callable[[int], None]]:
    reached = 0

    def done(units: int) -> None:
        nonlocal reached
        reached += units
        sys.stderr.write(f"\r{reached}/{total}")
        sys.stderr.flush()

    yield done
    sys.stderr.write("\r\033[K")
    sys.stderr.flush()
