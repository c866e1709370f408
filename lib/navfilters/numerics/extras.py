"""What is not NumPy or SciPy, and one line on how to get it."""

import importlib
import sys
from argparse import ArgumentParser
from collections.abc import Callable
from typing import Any

_NAMES = {"cv2": "OpenCV", "jax": "JAX", "mpl_toolkits.basemap_data": "basemap-data"}


def needed(module: str, install: str, what: str) -> Any:
    """A module of an optional dependency.

    Parameters
    ----------
    module : str
    install : str
        What to tell pip.
    what : str
        That needs it; for the message.

    Returns
    -------
    module

    Raises
    ------
    ImportError
        As :func:`missing`.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise missing(module, install, what, error) from None


def missing(module: str, install: str, what: str, error: ImportError) -> ImportError:
    """The error in one line: the module is not installed, or it is and has an error of its own.

    Parameters
    ----------
    module, install, what : str
        As for :func:`needed`.
    error : ImportError

    Returns
    -------
    ImportError
    """
    name = _NAMES.get(module, module.split(".")[0])
    if error.name and f"{module}.".startswith(f"{error.name}."):
        return ImportError(f"{what} needs {name}: pip install {install}")
    return ImportError(f"{what} needs {name}, which is installed but not importable: {error}")


def at_least(parser: ArgumentParser, option: str, value: int, least: int) -> None:
    """End a command whose option is too small, with its usage.

    Parameters
    ----------
    parser : argparse.ArgumentParser
    option : str
        With its dashes.
    value, least : int
        What was given, and what is needed.

    Raises
    ------
    SystemExit
        Naming the option, the value found and what is needed.
    """
    if value < least:
        parser.error(f"{option} must be at least {least}; found {value}")


def command(main: Callable[[], None]) -> None:
    """Run a command; what is not installed ends it with one line.

    Parameters
    ----------
    main : callable
    """
    try:
        main()
    except ImportError as error:
        sys.exit(f"{error}")
