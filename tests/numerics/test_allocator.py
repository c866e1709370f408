"""A long computation does not fetch its temporary arrays from the system again and again."""

import os
import platform
import subprocess
import sys

import pytest

resource = pytest.importorskip("resource")  # of POSIX

FAULTS = """
import resource
import numpy as np
from navfilters import FILTERS, Gaussian, run, sweep
from navfilters.papers.perea2007 import Setup

base, many = Setup(), 10_000
priors = Gaussian(np.tile(base.x0, (many, 1)), np.tile(base.prior.cov, (many, 1, 1)))

def faults(steps):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    {call}
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

faults(1)
print((faults(42) - faults(2)) / 40)
"""
CALLS = {
    "sweep": "sweep(FILTERS['UKF'], priors, base.z, base.model, steps, workers=1, progress=False)",
    "run": "run(FILTERS['UKF'], priors, base.z, base.model, steps)",
}
HISTORY = 2 * 10_000 * 6 * 8 / resource.getpagesize()  # of a step: its state, and its place in all
DASK = {"MALLOC_TRIM_THRESHOLD_": "65536"}
"""What its workers begin with: a process then returns all it can to the system."""
KEPT = {"sweep": 0, "run": HISTORY}


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="a habit of the GNU allocator")
@pytest.mark.parametrize("told", [{}, DASK], ids=["here", "on a worker of Dask"])
@pytest.mark.parametrize("name", CALLS)
def test_temporaries_do_not_come_from_the_system(name, told):
    """Pages per update of 1e4 members: more than a thousand without the request to keep them."""
    script, environment = FAULTS.format(call=CALLS[name]), {**os.environ, **told}
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
    )
    assert float(done.stdout) < KEPT[name] + 100
