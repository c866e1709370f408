"""Which options a stage of a filter takes."""

import inspect
from collections.abc import Callable
from functools import lru_cache
from typing import Any


@lru_cache  # a signature costs as much as half an update of one member
def keywords(function: Callable[..., Any]) -> tuple[str, ...]:
    """Names of a function's options."""
    parameters = inspect.signature(function).parameters.values()
    return tuple(p.name for p in parameters if p.default is not p.empty)


def accepted(function: Callable[..., Any], options: dict[str, Any]) -> dict[str, Any]:
    """Those of the options that a function takes."""
    return {name: options[name] for name in keywords(function) if name in options}
