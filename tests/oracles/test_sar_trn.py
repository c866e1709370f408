"""The SAR experiment against an independent one: other integrator, frame, attitude, algebra."""

import ast
import inspect

import numpy as np
import pytest
from numpy.testing import assert_allclose

from navfilters.oracles import sar_trn as oracle
from navfilters.papers import pogorelsky2020

pytestmark = pytest.mark.slow


def both(case, updates, seed):
    """Errors and covariances of one run by ours and by the oracle, from the same draws."""
    setup, noise = pogorelsky2020.CASES[case], pogorelsky2020.noise([7], updates, seed)
    drawn = {
        "initial": np.sqrt(np.diag(setup.P0)) * noise.first[0],
        "feature": noise.pixel[0] * setup.pixel @ oracle.enu(*oracle.HOUSTON).T,
        "range": setup.sigma_range * noise.slant_range[0],
        "speed": setup.sigma_speed * noise.speed[0],
        "walk": np.sqrt(setup.psd_mu * setup.interval) * noise.walk[0],
    }
    ours = pogorelsky2020.monte_carlo(setup, updates, runs=[7], seed=seed)
    return (
        ours.errors[: updates + 1, 0],
        ours.covariances[: updates + 1, 0],
        *oracle.run(case, updates, drawn),
    )


@pytest.mark.parametrize(("case", "updates"), [("TC-1", 72), ("TC-2", 25)])
def test_a_run_is_the_oracles(case, updates):
    error, P, expected, P_expected = both(case, updates, seed=3)
    size = np.sqrt(np.diagonal(P_expected, axis1=-2, axis2=-1))
    assert_allclose(error / size, expected / size, atol=1e-4)
    assert_allclose(
        P / size[:, :, None] / size[:, None, :],
        P_expected / size[:, :, None] / size[:, None, :],
        atol=1e-5,
    )


def test_the_truth_is_the_oracles():
    times = np.arange(0, 601, 100.0)
    flight = pogorelsky2020.truth()
    r, v = oracle.truth(times)
    at = np.rint(times / (600 / 72)).astype(int)
    assert_allclose(flight.x[at, :3], r, atol=1e-4)
    assert_allclose(flight.x[at, 3:], v, atol=1e-7)


def test_the_oracle_imports_nothing_of_ours():
    tree = ast.parse(inspect.getsource(oracle))
    imported = [
        name
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
        for name in (
            [a.name for a in node.names] if isinstance(node, ast.Import) else [node.module]
        )
    ]
    assert not [name for name in imported if name.startswith("navfilters")]
