"""Which options a stage of a filter takes."""

import inspect
from collections.abc import Callable
from functools import lru_cache


@lru_cache  # a signature costs as much as half an update of one member
def keywords(function: Callable) -> tuple[str, ...]:
    """Names of a function's options."""
    parameters = inspect.signature(function).parameters.values()
    return tuple(p.name for p in parameters if p.default is not p.empty)


def accepted(function: Callable, options: dict) -> dict:
    """Those of the options that a function takes."""
    return {name: options[name] for name in keywords(function) if name in options}
