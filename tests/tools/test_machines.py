"""Variants change what they say they change, and say where they cannot."""

import os
import subprocess
import sys
from pathlib import Path

import machines
import pytest

BY_NAME = {variant.name: variant for variant in machines.variants()}
SHOW = (
    "from numpy._core import _multiarray_umath as c; "
    "print(*[f for f in c.__cpu_dispatch__ if c.__cpu_features__.get(f)])"
)


def run(code, variant):
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        capture_output=True,
        text=True,
        env=os.environ | variant.environment,
        cwd=Path(machines.__file__).parent,
    )
    assert done.stderr == ""
    return done.stdout.split()


def test_the_first_is_the_machine_as_it_is():
    first = machines.variants()[0]
    assert (first.environment, first.skipped) == ({}, "")


@pytest.mark.parametrize(
    ("name", "level"), [("NumPy without AVX-512", "X86_V4"), ("an old machine", "X86_V3")]
)
def test_numpy_loses_the_level_and_all_above_without_a_warning(name, level):
    if not machines.numpy_features(level):
        pytest.skip(f"NumPy has no {level} here")
    left = run(SHOW, BY_NAME[name])
    assert level not in left
    assert {"X86_V3"} - {level} >= set(left)


def test_a_level_that_numpy_does_not_know_leaves_nothing_to_switch_off():
    assert machines.numpy_features("ASIMD9") == []


def test_openblas_takes_another_kernel():
    name = next(name for name in BY_NAME if name.startswith("OpenBLAS"))
    if BY_NAME[name].skipped:
        pytest.skip(BY_NAME[name].skipped)
    other = run("import machines; print(*machines.blas_kernels())", BY_NAME[name])
    assert set(other) & machines.blas_kernels() == set()
