"""Old names: importing one says the new one, and the new one exists."""

import importlib
import subprocess
import sys

import pytest

from navfilters import FILTERS, _moved, run, sweep


@pytest.mark.parametrize("old", _moved.MOVED)
def test_an_old_module_says_where_it_went(old):
    with pytest.raises(ImportError, match=r"has moved: since version 0\.2 it is navfilters\."):
        importlib.import_module(f"navfilters.{old}")
    for place in _moved.MOVED[old].split(", "):
        importlib.import_module(f"navfilters.{place}")


@pytest.mark.parametrize(
    ("line", "new"),
    [
        ("from navfilters import claims", "navfilters.book.claims"),
        ("from navfilters.experiments import xiong2009", "navfilters.papers"),
        ("from navfilters.linalg import matmul", "navfilters.numerics.small_matrices"),
        ("import navfilters.models.orbit", "navfilters.space"),
        (
            "from navfilters.discrete import extended_kalman_filter",
            "dynamics=system.dynamics(u), z_per_step=True)",
        ),
    ],
)
def test_an_old_line_of_a_notebook(line, new):
    done = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert new in done.stderr.splitlines()[-1]


@pytest.mark.parametrize("go", [run, sweep])
@pytest.mark.parametrize("name", _moved.KEYWORDS)
def test_an_old_keyword_says_the_new_one(go, name):
    with pytest.raises(TypeError, match=rf"{name}.*since version 0\.2 that is (z_per_step|record)"):
        go(FILTERS["EKF"], None, None, None, **{name: True})
    with pytest.raises(TypeError, match=r"unexpected keyword argument 'colour'$"):
        go(FILTERS["EKF"], None, None, None, colour=1)


def test_what_never_was_is_missing_as_ever():
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("navfilters.nothing")
