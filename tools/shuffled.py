"""A plug-in of pytest: all tests mixed in a random order; NAVFILTERS_ORDER is its seed."""

import os
import random
from typing import Any

import pytest

SEED = os.environ.setdefault("NAVFILTERS_ORDER", str(random.randrange(10**6)))
"""Drawn once; workers have it from their parent, since all must have the same order."""


def pytest_report_header() -> str:
    """Told, so that a failure can be had again."""
    return f"random order: NAVFILTERS_ORDER={SEED} repeats it"


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[Any]) -> None:
    """Whole files and their fixtures are torn apart too."""
    random.Random(SEED).shuffle(items)
