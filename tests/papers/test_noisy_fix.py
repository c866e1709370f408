"""The noisy fix: runs, references and scores, against one run by hand and closed forms."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import stats

from navfilters import Gaussian, run
from navfilters.models import RangeBearing
from navfilters.oracles import perea2007 as oracle
from navfilters.papers.perea2007 import (
    FILTERS,
    Setup,
    false_information,
    isotropic,
    noise_table,
    noisy_fix,
)
from navfilters.papers.perea2007 import __main__ as command
from navfilters.papers.perea2007.noisy_fix import Belief

SETUP = Setup()
MODEL = SETUP.model
X_TRUE = np.array(SETUP.x_true)


def test_measurements_have_the_models_noise_and_do_not_depend_on_how_many_runs():
    z = noisy_fix.measurements(X_TRUE, MODEL, 50, 400, seed=3)
    assert z.shape == (50, 400, 2)
    scaled = (z - MODEL.h(X_TRUE)) / np.sqrt(np.diag(MODEL.R))
    assert_allclose(scaled.std(axis=(0, 1)), 1.0, atol=0.02)
    assert abs(np.corrcoef(scaled.reshape(-1, 2).T)[0, 1]) < 0.03
    assert_array_equal(noisy_fix.measurements(X_TRUE, MODEL, 50, 7, seed=3), z[:, :7])
    each = noisy_fix.measurements([[100.0, 0.0], [0.0, 50.0]], MODEL, 5, 2)
    assert_allclose(each.mean(axis=0)[:, 0], [100.0, 50.0], atol=0.02)


def test_following_is_running(monkeypatch):
    """Also over blocks, and told how far it is."""
    z = noisy_fix.measurements(X_TRUE, MODEL, 12, 5)
    monkeypatch.setattr(noisy_fix, "BLOCK", 2)
    told = []
    found = noisy_fix.follow(FILTERS["UKFz"], SETUP.prior, z, MODEL, (3, 12), done=told.append)
    history = run(FILTERS["UKFz"], SETUP.prior, z, MODEL, z_per_step=True)
    assert_allclose(found.mean, history.mean[[3, 12]], rtol=1e-12)
    assert_allclose(found.cov, history.cov[[3, 12]], rtol=1e-9)
    before = history.mean[11]
    assert_allclose(found.innovation[1], z[11] - MODEL.h(before), rtol=1e-12)
    assert told == [2, 2, 1]


def test_a_filter_that_loses_its_covariance_is_followed_all_the_same():
    z = noisy_fix.measurements(X_TRUE, MODEL, 3, 4)
    found = noisy_fix.follow(FILTERS["mtSOF"], SETUP.prior, z, MODEL, (1, 3))
    assert (np.linalg.det(found.cov[0]) < 0).all()
    score = noisy_fix.score(found, X_TRUE, MODEL)
    assert np.isnan(score.nees[0]).all()
    assert score.lost[0].all()


@pytest.mark.parametrize("name", FILTERS)
def test_three_noisy_updates_are_those_of_the_oracle(name):
    z = noisy_fix.measurements(X_TRUE, MODEL, 3, 1, seed=5)
    found = noisy_fix.follow(FILTERS[name], SETUP.prior, z, MODEL, (3,))
    x = tuple(oracle.mpf(v) for v in SETUP.x0)
    p = tuple(oracle.mpf(v) for v in (SETUP.sigma**2, 0, SETUP.sigma**2))
    R = tuple(oracle.mpf(float(v)) for v in np.diag(MODEL.R))
    for z_k in z[:, 0]:
        if name == "B-EKF 4":
            p = (oracle.spectral_norm(p), oracle.mpf(0), oracle.spectral_norm(p))
        moments = oracle.measurement_moments(name, x, p, R)
        x, p = oracle.update(x, p, [oracle.mpf(float(v)) for v in z_k], *moments)
    assert_allclose(found.mean[0, 0], [float(v) for v in x], rtol=1e-8)
    P = [float(v) for v in (p[0], p[1], p[1], p[2])]
    assert_allclose(found.cov[0, 0].ravel(), P, rtol=1e-6)


def test_least_squares_without_a_prior_is_the_mean_of_the_measurements():
    z = noisy_fix.measurements(X_TRUE, MODEL, 20, 3)
    found = noisy_fix.batch(isotropic(X_TRUE, 1e9), z, MODEL, (1, 20))
    assert_allclose(MODEL.h(found.mean), np.stack([z[0], z.mean(axis=0)]), rtol=1e-12)
    H = MODEL.jacobian(found.mean)
    per_update = H @ found.cov @ H.mT * np.array([1, 20])[:, None, None, None]
    assert_allclose(per_update, np.broadcast_to(MODEL.R, per_update.shape), atol=1e-10)


def test_least_squares_with_a_prior_is_where_the_cost_is_least():
    from scipy.optimize import minimize

    prior = Gaussian(np.array([90.0, 120.0]), np.array([[30.0, 5.0], [5.0, 80.0]]))
    model = RangeBearing(np.diag([4.0, 0.02]))
    z = noisy_fix.measurements(X_TRUE, model, 6, 1)

    def cost(x):
        misfit = stats.norm.logpdf(z[:, 0], model.h(x), np.sqrt(np.diag(model.R))).sum()
        return -misfit - stats.multivariate_normal.logpdf(x, *prior)

    best = minimize(cost, X_TRUE, method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-10})
    assert_allclose(noisy_fix.batch(prior, z, model, (6,)).mean[0, 0], best.x, rtol=1e-6)


def test_scores_of_a_linear_case_are_chi_square():
    """So small a covariance that the arc is straight."""
    rng = np.random.default_rng(0)
    cov = np.array([[2e-6, 1e-6], [1e-6, 3e-6]])
    mean = rng.multivariate_normal(X_TRUE, cov, 3000)
    score = noisy_fix.score(Belief(mean, np.broadcast_to(cov, (3000, 2, 2))), X_TRUE, MODEL)
    for q in (score.nees, score.nees_measured):
        assert stats.kstest(q, stats.chi2(2).cdf).pvalue > 0.01
    assert_allclose(score.error, np.hypot(*(mean - X_TRUE).T))
    assert score.lost.mean() < 0.01
    assert np.isnan(score.nis).all()
    away = Belief(X_TRUE + np.array([0.007, 0.0]), cov)
    assert noisy_fix.score(away, X_TRUE, MODEL).lost
    assert stats.chi2.ppf(0.95, 2) == pytest.approx(noisy_fix.EDGE)


def test_the_bound_is_that_of_the_information():
    H = MODEL.jacobian(X_TRUE)
    one = np.trace(np.linalg.inv(H.T @ np.linalg.inv(MODEL.R) @ H))
    assert_allclose(noisy_fix.bound(X_TRUE, MODEL, (1, 9)) ** 2, one / np.array([1, 9]))


def test_false_information_is_the_mean_of_running_means():
    """By simulation of the moves; and the closed form without a prior."""
    rng = np.random.default_rng(1)
    r, sigma, sigma_r, sigma_theta, n = 100.0, 3.0, 0.01, 0.02, 40
    x = sigma * rng.normal(size=20_000)
    z = x + r * sigma_theta * rng.normal(size=(n, x.size))
    weight = np.arange(1, n + 1)[:, None] / (r * sigma_theta) ** 2
    mean = np.cumsum(z, axis=0) / (r * sigma_theta) ** 2 / (1 / sigma**2 + weight)
    moves = ((mean - mean[-1]) / (r * sigma_r)) ** 2
    true = 1 / sigma**2 + n / (r * sigma_theta) ** 2
    for first in (1, 8):
        found = false_information(r, sigma, sigma_r, sigma_theta, n, first)
        assert_allclose(found**2, moves[first - 1 :].sum(axis=0).mean() / true, rtol=0.03)

    many = np.array([2, 10, 1000])
    harmonic = np.array([np.sum(1 / np.arange(1, k + 1)) for k in many])
    vague = false_information(r, np.inf, sigma_r, sigma_theta, many)
    expected = r * sigma_theta**2 / sigma_r * np.sqrt((harmonic - 1) / many)
    assert_allclose(vague, expected, rtol=1e-12)


def test_the_table_has_a_line_for_each_and_its_numbers():
    rng = np.random.default_rng(0)
    shape = len(noisy_fix.UPDATES), 400
    error, q = rng.exponential(size=shape), rng.chisquare(2, size=(3, *shape))
    q[2] = np.nan
    q[0, -1, 0] = np.nan
    one = noisy_fix.Score(error, *q, lost=rng.random(shape) < 0.3)
    bad = one._replace(nees=np.full(shape, np.nan), nees_measured=np.full(shape, np.nan))
    lines = noise_table.table({"one": one, "bad": bad}, SETUP, 1000).splitlines()
    limit = noisy_fix.bound(X_TRUE, MODEL, (1000,))
    expected = [np.sqrt(np.mean(error[-1] ** 2)), np.median(error[-1])] / limit
    name, rms, median, *_, outside, _, nis, lost = lines[2].split()
    assert name == "one"
    assert_allclose([float(rms), float(median)], expected, rtol=0.05)
    assert outside == f"{np.mean(~(q[0, -1] < 5.9915)):.0%}"
    assert (nis, lost) == ("–", f"{one.lost[-1].mean():.0%}")
    assert noise_table.rows({"one": one}, SETUP, 1000)[0] == tuple(lines[2].split())
    assert len(noise_table.COLUMNS) == len(lines[2].split())
    assert lines[3].split()[4:8] == ["–", "–", "100%", "100%"]


def test_the_command_prints_every_table(capsys):
    command.main(["--noise", "2"])
    out = capsys.readouterr().out
    assert [line.split()[1] for line in out.splitlines() if line.startswith("after")] == [
        str(n) for n in noisy_fix.UPDATES
    ]


def test_the_command_refuses_no_runs(capsys):
    with pytest.raises(SystemExit):
        command.main(["--noise", "0"])
    assert "--noise must be at least 1; found 0" in capsys.readouterr().err
