"""A plug-in of pytest that keeps what nbval executed; see ``executed``."""

from pathlib import Path
from time import perf_counter
from typing import Any

import executed
import nbformat
import pytest

STARTED: dict[Path, float] = {}


def pytest_configure(config: pytest.Config) -> None:
    """Once, before any worker begins."""
    if not hasattr(config, "workerinput"):
        executed.begin()


def pytest_runtest_setup(item: Any) -> None:
    """The clock of a notebook runs from its first cell."""
    STARTED.setdefault(item.path, perf_counter())


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(item: Any, nextitem: Any) -> None:
    """After its last cell a notebook is kept, if all of them ran."""
    if nextitem is not None and nextitem.path == item.path:
        return
    notebook = item.parent.nb
    cells = {test.cell_num: test for test in item.session.items if test.path == item.path}
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    for number, cell in enumerate(code):
        if number not in cells or cells[number].test_outputs is None:
            return
        cell.outputs = cells[number].test_outputs
    notebook.metadata["seconds"] = perf_counter() - STARTED[item.path]
    path = executed.place(item.path)
    path.parent.mkdir(parents=True, exist_ok=True)
    nbformat.write(notebook, path)
