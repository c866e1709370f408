"""The honesty of every combination, on a few runs."""

import numpy as np
from scipy import stats

from navfilters.estimators import LATER_FILTERS
from navfilters.oracles import later_filters as oracle
from navfilters.papers.perea2007 import Setup, later_filters


def test_runs_are_those_of_the_oracle():
    setup = Setup()
    given = later_filters.experiment(setup, 20, 10)
    got = later_filters.follow(LATER_FILTERS["RC-EKF"], setup, given, (1, 10))
    R = setup.range_variance, setup.bearing_variance
    mean, cov = oracle.runs("RC-EKF", given.start.T, setup.sigma, R, given.z)
    error = mean[[0, 9]] - setup.x_true
    square = np.einsum("kri,krij,krj->kr", error, np.linalg.inv(cov[[0, 9]]), error)
    np.testing.assert_allclose(got.error, np.linalg.norm(error, axis=-1), rtol=1e-6)
    np.testing.assert_allclose(got.nees, square, rtol=1e-4)
    np.testing.assert_array_equal(got.outside, (square > stats.chi2.ppf(0.99, 2)).mean(axis=-1))


def test_noises_are_drawn_first_and_then_the_starts():
    """What a seed gives is a number that the library promises."""
    setup, rng = Setup(), np.random.default_rng(3)
    given = later_filters.experiment(setup, 4, 2, seed=3)
    R = setup.range_variance, setup.bearing_variance
    np.testing.assert_allclose(given.z - setup.z, rng.standard_normal((2, 4, 2)) * np.sqrt(R))
    start = (given.start - setup.x_true) / setup.sigma
    np.testing.assert_allclose(start, rng.standard_normal((4, 2)))


def test_the_command_prints_every_combination(capsys):
    later_filters.main(["--runs", "2", "--updates", "2"])
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(later_filters.combinations()) == 2 * (3 * 4 + 1)
    assert lines[0].startswith("once, first order, unchanged")
