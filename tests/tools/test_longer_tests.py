"""Which tests take too long for ``make unit``: how they are found, and that each is there."""

import re
import subprocess
import sys

from browser import ROOT
from longer_tests import LIMIT, STORED

CONFTEST = """
from pathlib import Path

import longer_tests

longer_tests.STORED = Path(__file__).with_name("longer.txt")
pytest_plugins = ["longer_tests"]
"""
TESTS = f"""
import time

import pytest


def work():
    begun = time.process_time()
    while time.process_time() < begun + {1.5 * LIMIT}:
        pass


@pytest.fixture(scope="module")
def made():
    work()


@pytest.mark.parametrize("long", [True, False])
def test_cases(long):
    if long:
        work()


def test_first(made):
    pass


def test_second(made):
    pass


def test_short():
    pass
"""


def test_a_long_case_and_a_fixture_that_takes_long_are_found_and_others_forgotten(tmp_path):
    (tmp_path / "conftest.py").write_text(CONFTEST)
    (tmp_path / "test_it.py").write_text(TESTS)
    stored = tmp_path / "longer.txt"
    stored.write_text("test_it.py::test_short\ntest_other.py::test_that_did_not_run\n")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-n", "1"]
    path = {"PYTHONPATH": str(ROOT / "tools")}
    done = subprocess.run(
        command, cwd=tmp_path, env=path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout
    long = [f"test_it.py::test_{name}" for name in ("cases", "first", "second")]
    assert stored.read_text().splitlines() == [*long, "test_other.py::test_that_did_not_run"]


def test_those_that_are_stored_are_there():
    for name in STORED.read_text(encoding="utf-8").splitlines():
        file, _, function = name.partition("::")
        source = (ROOT / "tests" / file).read_text(encoding="utf-8")
        assert re.search(rf"^ *def {function}\(", source, re.MULTILINE), name
