"""A plug-in of pytest: a kernel whose port was taken while it started is started again.

Jupyter looks for free ports, and the kernel binds them a second later. If another program takes one
in between, the kernel dies, or, where it was the port of outputs, lives and never answers.
"""

from collections.abc import Callable
from typing import Any

import nbval.kernel
import pytest

STARTS = 3
PATIENCE = 20.0
"""Seconds for a start, in the place of nbval's 60."""


def again(start: Callable[..., Any]) -> Callable[..., Any]:
    """The same start, tried up to three times."""

    def start_again(**options: Any) -> Any:
        for _ in range(STARTS - 1):
            try:
                return start(**options)
            except RuntimeError:  # nbval has logged it
                continue
        return start(**options)

    return start_again


def pytest_configure(config: pytest.Config) -> None:
    """In every worker."""
    config.option.nbval_kernel_startup_timeout = PATIENCE
    nbval.kernel.start_new_kernel = again(nbval.kernel.start_new_kernel)
