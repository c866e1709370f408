"""The C loop of the benchmarks makes our updates, and the stored result is whole."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest
from naive import covariances
from numpy.testing import assert_allclose

from navfilters import FILTERS, Gaussian, sweep
from navfilters.experiments.perea2007 import Setup

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
BASE = Setup()

spec = importlib.util.spec_from_file_location("limit", BENCHMARKS / "limit.py")
limit = importlib.util.module_from_spec(spec)
spec.loader.exec_module(limit)


@pytest.fixture(scope="module")
def c(tmp_path_factory):
    return limit.compiled(tmp_path_factory.mktemp("limit"))


@pytest.mark.skipif(limit.compiler() is None, reason="needs a C compiler")
@pytest.mark.parametrize("engine", ["numpy", "jax"])
@pytest.mark.parametrize("name", ["EKF", "UKF"])
def test_the_limit_and_ours_are_the_same_update(c, name, engine):
    """To 1e-13 of the prior's size in one update."""
    rng = np.random.default_rng(0)
    prior = Gaussian(rng.normal(BASE.x0, 10.0, (50, 2)), 1e3 * covariances(rng, (50,), 2))
    R = np.array([[0.5, 0.02], [0.02, 0.01]])
    model = type(BASE.model)(R)
    got = sweep(FILTERS[name], prior, BASE.z, model, 1, engine=engine, progress=False).final
    wanted = c[name](prior, BASE.z, R, 1)
    assert_allclose(got.mean, wanted.mean, rtol=0, atol=1e-13 * 1e2)
    assert_allclose(got.cov, wanted.cov, rtol=0, atol=1e-13 * 1e4)


@pytest.mark.skipif(limit.compiler() is None, reason="needs a C compiler")
@pytest.mark.parametrize("name", ["EKF", "UKF"])
def test_a_hundred_updates_in_c_are_a_hundred_of_ours(c, name):
    """The paper's problem, where early rounding stays in P: so far that 1e-6 is the last bit's."""
    prior = Gaussian(BASE.prior.mean[None], BASE.prior.cov[None])
    got = sweep(FILTERS[name], prior, BASE.z, BASE.model, 100, progress=False).final
    wanted = c[name](prior, BASE.z, BASE.model.R, 100)
    assert_allclose(got.mean, wanted.mean, rtol=1e-6)
    assert_allclose(got.cov, wanted.cov, rtol=0, atol=1e-6 * np.abs(wanted.cov).max())


def test_the_stored_result_is_whole():
    """Every contender at every batch size, with the same numbers, and said when and on what."""
    stored = json.loads((BENCHMARKS / "results.json").read_text())
    assert {"date", "machine", "versions", "problem", "repeats", "steps"} <= set(stored)
    assert set(stored["results"]) == {"EKF", "UKF"}
    for name, batches in stored["results"].items():
        assert set(batches) == set(stored["steps"]) == {"1", "100", "10000", "100000"}
        for contenders in batches.values():
            assert len(contenders) == 6
            for who, result in contenders.items():
                assert result["ns"] > 0
                if (name, who) != ("UKF", "Stone Soup"):  # averages bearings on the circle
                    assert result["apart"] < 1e-5
