"""What ``import navfilters`` gives, and what it leaves until it is asked for."""

import subprocess
import sys

import pytest

import navfilters
import navfilters.crash
import navfilters.diagnosis


def test_crash_test_and_diagnose_stand_at_the_top():
    assert navfilters.crash_test is navfilters.crash.crash_test
    assert navfilters.diagnose is navfilters.diagnosis.diagnose
    assert {"crash_test", "diagnose"} <= set(dir(navfilters))


def test_every_name_of_all_is_there():
    everything: dict[str, object] = {}
    exec("from navfilters import *", everything)
    assert set(navfilters.__all__) <= set(everything)


def test_importing_the_library_brings_no_experiment_with_it():
    code = (
        "import sys, navfilters\n"
        "print([m for m in sys.modules if m.startswith(\n"
        "    ('navfilters.crash', 'navfilters.papers', 'navfilters.diagnosis'))])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_another_name_is_refused_as_by_any_module():
    with pytest.raises(AttributeError, match="module 'navfilters' has no attribute 'crashtest'"):
        _ = navfilters.crashtest
