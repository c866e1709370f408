"""Progress on stderr for the commands."""

import importlib
import sys
from collections.abc import Iterable


def progress(updates: Iterable) -> Iterable:
    """tqdm's bar where it is installed, a counter otherwise; both on stderr.

    Parameters
    ----------
    updates : iterable
        Of known length.

    Returns
    -------
    iterable
        The same, reported on as it is used.
    """
    try:
        bar = importlib.import_module("tqdm").tqdm
    except ImportError:
        return _counted(list(updates))
    return bar(updates, leave=False)


def _counted(updates: list) -> Iterable:
    for i, update in enumerate(updates, start=1):
        sys.stderr.write(f"\r{i}/{len(updates)}" if i < len(updates) else "\r\033[K")
        sys.stderr.flush()
        yield update
