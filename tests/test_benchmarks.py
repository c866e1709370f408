"""The C loops of the benchmarks make our updates, and the stored result is whole."""

import json
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from naive import covariances
from numpy.testing import assert_allclose

from navfilters import FILTERS, Gaussian, sweep
from navfilters.papers.perea2007.experiment import Setup
from navfilters.papers.pogorelsky2020.experiment import NOMINAL

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
BASE = Setup()

sys.path.insert(0, str(BENCHMARKS))
import limit  # noqa: E402
import problems  # noqa: E402

sys.path.remove(str(BENCHMARKS))

needs_c = pytest.mark.skipif(limit.compiler() is None, reason="needs a C compiler")
MOVING = {"orbit EKF": cache(problems.coasting), "MEKF": cache(problems.images)}


@pytest.fixture(scope="module")
def c(tmp_path_factory):
    return limit.compiled(tmp_path_factory.mktemp("limit"))


@needs_c
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


@needs_c
@pytest.mark.parametrize("members", [1, 50, 64, 130])
@pytest.mark.parametrize("name", ["EKF", "UKF"])
def test_the_vectorised_limit_makes_the_same_update(c, name, members):
    """Whole blocks of members and a last one that is not; to 1e-12: it is built to be fast."""
    rng = np.random.default_rng(1)
    mean = rng.normal(BASE.x0, 10.0, (members, 2))
    prior = Gaussian(mean, 1e3 * covariances(rng, (members,), 2))
    got, wanted = (c[name + kind](prior, BASE.z, BASE.model.R, 1) for kind in (", vectorised", ""))
    assert_allclose(got.mean, wanted.mean, rtol=0, atol=1e-12 * 1e2)
    assert_allclose(got.cov, wanted.cov, rtol=0, atol=1e-12 * 1e4)


@needs_c
@pytest.mark.parametrize("name", ["EKF", "UKF"])
def test_a_hundred_updates_in_c_are_a_hundred_of_ours(c, name):
    """The paper's problem, where early rounding stays in P: so far that 1e-6 is the last bit's."""
    prior = Gaussian(BASE.prior.mean[None], BASE.prior.cov[None])
    got = sweep(FILTERS[name], prior, BASE.z, BASE.model, 100, progress=False).final
    wanted = c[name](prior, BASE.z, BASE.model.R, 100)
    assert_allclose(got.mean, wanted.mean, rtol=1e-6)
    assert_allclose(got.cov, wanted.cov, rtol=0, atol=1e-6 * np.abs(wanted.cov).max())


def correlated(problem, members):
    """Priors with a full covariance of their own each, so that no element may be left out."""
    mean, cov = problem.first
    drawn = problems.priors(problem, members).mean
    own = covariances(np.random.default_rng(1), (members,), len(mean))
    scale = np.sqrt(np.diag(cov) / np.diagonal(own, axis1=-2, axis2=-1))
    return Gaussian(drawn, scale[..., :, None] * own * scale[..., None, :])


def assert_same(got, wanted, rounding):
    """Means to ``rounding`` deviations, covariances to a hundredth of it as correlations.

    A mean is off by the rounding of a state of 1e7 m or of a distance of 1e6 m, and by that of the
    gain times a residual of many deviations, which a covariance is not.
    """
    sigma = np.sqrt(np.diagonal(wanted.cov, axis1=-2, axis2=-1))
    assert (sigma > 0).all()
    assert np.max(problems.in_deviations(got, wanted)) < rounding
    pair = sigma[..., :, None] * sigma[..., None, :]
    assert_allclose(got.cov / pair, wanted.cov / pair, rtol=0, atol=rounding / 100)


# In deviations. Orbit: 1e7 m rounds by 2e-9 m in each of 100 sub-steps, of deviations above 300 m.
# Images: S holds the prior's 1e6 m^2 over R's 1 m^2, so that a gain of residuals of 1000 deviations
# has lost six of 16 digits.
ROUNDING = {"orbit EKF": 1e-9, "MEKF": 1e-7}


@needs_c
@pytest.mark.parametrize(
    ("engine", "steps"),
    [("numpy", 1), ("numpy", 10), pytest.param("jax", 10, marks=pytest.mark.slow)],
)
@pytest.mark.parametrize("name", MOVING)
def test_the_limit_and_ours_are_the_same_flight(c, name, steps, engine):
    problem = MOVING[name]()
    prior = correlated(problem, 5)
    got = problem.ours(prior, problem.z, steps, engine)
    assert_same(got, c[name](prior, problem.z, problem, steps), ROUNDING[name])


@needs_c
@pytest.mark.parametrize("name", MOVING)
def test_what_the_peers_are_told_is_the_same_problem(c, name):
    """An EKF from the textbook, on a problem's methods alone, for one member."""
    problem, steps = MOVING[name](), 10
    (mean,), (P,) = correlated(problem, 1)
    x, q = problem.fold(mean, NOMINAL)
    for z in problem.z[:steps]:
        assert_allclose(problem.move(x), problem.transition(x)[0], rtol=1e-14)
        x, F = problem.transition(x)
        P = F @ P @ F.T + problem.Q
        H, R = problem.jacobian(x, q, z), problem.noise(x, q, z)
        K = np.linalg.solve(H @ P @ H.T + R, H @ P).T
        keep = np.eye(len(x)) - K @ H
        P = keep @ P @ keep.T + K @ R @ K.T
        x, q = problem.fold(x + K @ (problem.measured(z) - problem.h(x, q, z)), q)
    wanted = c[name](correlated(problem, 1), problem.z, problem, steps)
    assert_same(Gaussian(problem.unfold(x, q)[None], P[None]), wanted, ROUNDING[name])


# F against the exact derivative of all sub-steps, with n = 1.1e-3 rad/s. Orbit: what the midpoint's
# exponential leaves out, (n h)^2 n T / 12 for h = 10 and T = 100 s, some times over for gravity's
# gradient. Images: the series ends before h^3 A^3 / 6, so that (n h)^2 T / 3 s lacks in position by
# velocity, for h = 0.83 and T = 8.3 s; a hundredth of it in deviations of 10 m/s and 1000 m.
DERIVED = {"orbit EKF": 1e-5, "MEKF": 1e-7}


@pytest.mark.parametrize("name", MOVING)
def test_the_jacobians_are_those_that_a_peer_derives(name):
    """In first deviations, against central differences, which are good to 1e-8 in a hundredth."""
    problem = MOVING[name]()
    x, z, sigma = problem.first.mean, problem.z[0], np.sqrt(np.diag(problem.first.cov))

    def differences(f, x):
        steps = 0.01 * np.diag(sigma)
        return np.stack([(f(x + step) - f(x - step)) / 0.02 for step in steps], axis=-1)

    ahead, F = problem.transition(x)
    in_sigma = (F * sigma - differences(problem.move, x)) / sigma[:, None]
    assert np.abs(in_sigma).max() < DERIVED[name]
    x, q = problem.fold(ahead, NOMINAL)
    H = problem.jacobian(x, q, z) * sigma
    scale = np.abs(H).max(axis=1, keepdims=True)
    other = differences(lambda x: problem.h(x, q, z), x)
    assert_allclose(other / scale, H / scale, rtol=0, atol=1e-6)


@needs_c
@pytest.mark.parametrize("name", MOVING)
def test_the_filters_work(c, name):
    """Perfect measurements: they are certain of more, and as right as they are certain."""
    problem, steps = MOVING[name](), problems.LONGEST
    found = c[name](problems.priors(problem, 200), problem.z, problem, steps)
    truth = problem.first.mean
    for _ in range(steps):
        truth = problem.move(truth)
    sigma = np.sqrt(np.diagonal(found.cov, axis1=-2, axis2=-1))
    assert (sigma[:, :6] < np.sqrt(np.diag(problem.first.cov))[:6] / 3).all()
    assert np.max(np.abs(found.mean - truth) / sigma) < 5


# What a contender's final means may be apart from C's. At rest: rounding that stays in P, and what
# dynamax adds to S. In motion rounding only, more of it where P is subtracted from; but
# dynamax has its own F. Orbit: DERIVED in each of 90 intervals, on errors of ten last deviations.
# Images: DERIVED of 1000 m against the metre that the range leaves, in ten such updates.
APART = {"EKF": 1e-5, "UKF": 1e-5, "orbit EKF": 1e-8, "MEKF": 1e-5}
DYNAMAX = APART | {"orbit EKF": 1e-2, "MEKF": 1e-3}


def test_the_stored_result_is_whole():
    """Every contender at every batch size, with the same numbers, and said when and on what."""
    stored = json.loads((BENCHMARKS / "results.json").read_text())
    assert {"date", "machine", "versions", "repeats", "problems"} <= set(stored)
    assert set(stored["results"]) == set(stored["problems"]) == set(APART)
    for name, batches in stored["results"].items():
        assert {"what", "apart", "note", "steps"} == set(stored["problems"][name])
        assert set(batches) == set(stored["problems"][name]["steps"])
        assert set(batches) == {"1", "100", "10000", "100000"}
        for contenders in batches.values():
            assert len(contenders) == (7 if name in ("EKF", "UKF") else 6)
            for who, result in contenders.items():
                assert result["ns"] > 0
                if (name, who) == ("UKF", "Stone Soup"):  # averages bearings on the circle
                    continue
                bounds = DYNAMAX if who == "dynamax" else APART
                assert result["apart"] < bounds[name]


def test_the_stored_growth_is_whole_and_its_memory_that_of_what_comes_back():
    """At most 200 bytes a member, of which 104 are the start, the state and its innovation."""
    stored = json.loads((BENCHMARKS / "growth.json").read_text())
    assert list(stored["members"]) == [str(10**k) for k in range(7)]
    assert list(stored["steps"]) == [str(10**k) for k in range(5)]
    assert "1" in stored["processes"]
    assert stored["members"]["1000000"]["mb"] < 200
    assert max(found["mb"] for found in stored["steps"].values()) < 20
