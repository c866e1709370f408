"""One deterministic hypothesis profile, so that a failure is everybody's; JAX if it is there.

``--quick`` leaves out what is marked slow, and the functions that ``longer.txt`` names.
"""

import importlib.util
import os
import re
from pathlib import Path

import pytest
import xla
from hypothesis import settings

# Read when JAX is imported. XLA_FLAGS= make coverage compiles everything as users do.
os.environ["JAX_ENABLE_X64"] = "1"
os.environ.setdefault("XLA_FLAGS", " ".join(xla.QUICKLY))

settings.register_profile(
    "deterministic", derandomize=True, deadline=None, max_examples=50, database=None
)
settings.load_profile("deterministic")

# JAX has no wheels for Macs with Intel processors, and requirements-test.in asks for none there.
HAS_JAX = importlib.util.find_spec("jax") is not None
WITH_JAX = [
    path
    for path in Path(__file__).parent.rglob("test_*.py")
    if re.search(r"^import jax$", path.read_text(encoding="utf-8"), re.M)
]
collect_ignore = [] if HAS_JAX else WITH_JAX
LONGER = {
    f"tests/{name}"
    for name in Path(__file__).with_name("longer.txt").read_text(encoding="utf-8").splitlines()
}


def pytest_addoption(parser):
    parser.addoption("--quick", action="store_true", help="without the tests that take long")


def pytest_report_header():
    if not HAS_JAX:
        return f"without JAX, {len(WITH_JAX)} files and all tests of its engine are left out"
    return None


def takes_long(item):
    return item.get_closest_marker("slow") or item.nodeid.partition("[")[0] in LONGER


def pytest_collection_modifyitems(config, items):
    if config.getoption("--quick"):
        config.hook.pytest_deselected(items=[item for item in items if takes_long(item)])
        items[:] = [item for item in items if not takes_long(item)]
    for item in items:
        engine = item.callspec.params.get("engine") if hasattr(item, "callspec") else None
        if engine == "jax" and not HAS_JAX:
            item.add_marker(pytest.mark.skip(reason="needs JAX"))


@pytest.fixture
def compiled_as_users_do(monkeypatch):
    """The engine's programs with all of XLA's optimisations."""
    stages = pytest.importorskip("jax").stages
    compiled = pytest.importorskip("navfilters.runs.compiled")
    compile_ = stages.Lowered.compile
    monkeypatch.setattr(stages.Lowered, "compile", lambda self: compile_(self, xla.AS_USERS_DO))
    compiled._program.cache_clear()
    yield
    compiled._program.cache_clear()
