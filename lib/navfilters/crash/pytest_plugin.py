"""A fixture for a team's own tests: ``pytest_plugins = ["navfilters.crash.pytest_plugin"]``."""

from collections.abc import Callable, Iterable
from typing import Any

import pytest

from navfilters.crash.suite import crash_test as tested


@pytest.fixture
def crash_test() -> Callable[..., None]:
    """A function that fails the test, with the whole report, if a filter fails a check."""

    def check(filter: Any, suite: str | Iterable[str] = "correct") -> None:
        report = tested(filter, suite, progress=False)
        if not report.passed:
            pytest.fail(str(report), pytrace=False)

    return check
