"""A plug-in of pytest: which tests take too long for ``make unit``, measured and stored anew.

A function is left out with all its cases if one of them takes longer than LIMIT, with the fixtures
that it would have to make alone.
"""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

LIMIT = 0.1
"""Seconds of processors: a test's own, and those of processes that it waited for."""

STORED = Path(__file__).resolve().parent.parent / "tests" / "longer.txt"

_shared: dict[str, float] = {}  # what fixtures took that several tests use
_longest: dict[str, float] = {}


def _used() -> float:
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef: Any) -> Iterator[None]:
    """One that several tests use counts for each of them."""
    begun = _used()
    made = yield
    if fixturedef.scope != "function":
        _shared[fixturedef.argname] = _used() - begun
    return made


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: Any) -> Iterator[None]:
    """From before the fixtures of a test until after them."""
    item.begun, item.known = _used(), sum(_shared.values())
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: Any, call: Any) -> Iterator[None]:
    """Told with the last report, which workers send to their parent; what is marked is known."""
    if call.when == "teardown" and not item.get_closest_marker("slow"):
        made_now = sum(_shared.values()) - item.known
        fixtures = sum(_shared.get(name, 0.0) for name in item.fixturenames)
        took = _used() - item.begun - made_now + fixtures
        item.user_properties.append(("processor", took))
    return (yield)


def pytest_runtest_logreport(report: Any) -> None:
    """The longest case of each function."""
    took = dict(report.user_properties).get("processor")
    if took is not None:
        name = report.nodeid.partition("[")[0].removeprefix("tests/")
        _longest[name] = max(took, _longest.get(name, 0.0))


def pytest_sessionfinish(session: Any) -> None:
    """In the place of what was stored, for the functions that ran."""
    if hasattr(session.config, "workerinput"):
        return
    before = STORED.read_text(encoding="utf-8").split("\n") if STORED.exists() else []
    longer = {name for name in before if name and name not in _longest}
    longer |= {name for name, took in _longest.items() if took > LIMIT}
    STORED.write_text("".join(f"{name}\n" for name in sorted(longer)), encoding="utf-8")
