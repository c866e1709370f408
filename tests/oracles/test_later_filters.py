"""The later filters against their oracle: sixty digits one by one, and doubles in many runs."""

import ast
import inspect
from dataclasses import replace

import numpy as np
import pytest
from untraced import untraced

from navfilters import FILTERS, Gaussian, run
from navfilters.estimators import LATER_FILTERS, bump_circular
from navfilters.models import RangeBearing
from navfilters.oracles import later_filters as oracle

ALL = FILTERS | LATER_FILTERS
SETUPS = {
    "baseline": ((100.0, 100.0), (20.0, 80.0), 100.0, (2.5e-5, 6e-3)),
    "across the jump": ((-60.0, -8.0), (-80.0, 20.0), 30.0, (0.04, 1e-3)),
    "comparable noises": ((150.0, -60.0), (120.0, -20.0), 30.0, (100.0, 0.01)),
}
KEEP = [1, 2, 10, 60]


def problem(x_true, x0, sigma, R):
    model = RangeBearing(np.diag(R))
    return Gaussian(np.array(x0), sigma**2 * np.eye(2)), model.h(np.array(x_true)), model


@pytest.mark.parametrize("setup", SETUPS)
@pytest.mark.parametrize("name", [*oracle.NAMES, "SR-EKF"])
def test_sixty_digits(name, setup):
    x_true, x0, sigma, R = SETUPS[setup]
    prior, z, model = problem(*SETUPS[setup])
    twin = "EKF" if name == "SR-EKF" else name
    with untraced():
        exact = oracle.history(twin, x0, sigma, R, tuple(map(float, z)), steps=60, keep=KEEP)
    got = run(ALL[name], prior, z, model, 60)
    for k, (x, (p11, p12, p22)) in zip(KEEP, exact, strict=True):
        error = np.linalg.norm(np.array(x, float) - x_true)
        P = np.array([[p11, p12], [p12, p22]], float)
        assert np.abs(got.mean[k] - np.array(x, float)).max() < 1e-6 * error
        assert np.abs(got.cov[k] - P).max() < 1e-6 * np.abs(P).max()


BUMPED = [name for name in oracle.NAMES if name != "RUF"]


@pytest.mark.parametrize(
    ("name", "circular"), [(n, False) for n in oracle.NAMES] + [(n, True) for n in BUMPED]
)
def test_many_runs(name, circular):
    prior, z, model = problem(*SETUPS["baseline"])
    noise = np.random.default_rng(0).standard_normal((8, 20, 2))
    z = z + noise * np.sqrt(np.diagonal(model.R))
    _, x0, sigma, R = SETUPS["baseline"]
    mean, cov = oracle.runs(name, x0, sigma, R, z, circular=circular)
    filter_ = replace(ALL[name], variant=bump_circular) if circular else ALL[name]
    got = run(filter_, prior, z, model, z_per_step=True)
    # Full steps of the iterated EKF amplify rounding in a run that they throw far away.
    apart = np.abs(got.mean[1:] - mean).max(axis=(0, 2))
    assert np.median(apart) < 1e-6
    assert (apart < 1e-2).all()
    size = np.abs(cov).max(axis=(-2, -1), keepdims=True)
    assert np.median(np.abs(got.cov[1:] - cov) / size) < 1e-6


def test_an_unknown_name_is_refused():
    with pytest.raises(ValueError, match="unknown filter 'UD'; the names are EKF, GSOF"):
        oracle.history("UD", (1, 1), 1, (1, 1), (1, 1), steps=1)


def test_it_shares_nothing_with_the_package():
    tree = ast.parse(inspect.getsource(oracle))
    imported = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)} | {
        a.name for node in ast.walk(tree) if isinstance(node, ast.Import) for a in node.names
    }
    assert imported == {"mpmath", "numpy", "navfilters.oracles.two_by_two"}
