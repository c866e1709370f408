"""What a sweep returns: run's numbers, whatever the chunk."""

from dataclasses import dataclass, field
from functools import partial

import numpy as np
import pytest
from naive import covariances, quadratic
from numpy.testing import assert_array_equal
from sweeps import BASE, EKF, MODEL, assert_same, priors, quiet

from navfilters import FILTERS, Gaussian, SigmaPoints, SweepError, first_indefinite, run
from navfilters.models import Linear, RangeBearing
from navfilters.papers.perea2007.experiment import FILTERS as PAPER
from navfilters.papers.perea2007.experiment import position_error
from navfilters.runs import problems, records


def everything(state):
    distance = records.Distance(np.array(BASE.x_true))
    return records.estimate(state), records.definite(state), distance(state)


@pytest.mark.parametrize("steps", [0, 1, 2, 25])
@pytest.mark.parametrize("name", ["EKF", "B-EKF 4", "mtSOF", "UKF"])
def test_everything_kept_is_that_of_a_run(name, steps):
    got = quiet(
        FILTERS[name],
        priors(),
        BASE.z,
        MODEL,
        steps,
        record=everything,
        chunk=4,
    )
    wanted = run(FILTERS[name], priors(), BASE.z, MODEL, steps)
    history, definite, error = got.record
    assert isinstance(history, Gaussian)
    assert_same(history, wanted)
    assert_same(got.final, (wanted.mean[-1], wanted.cov[-1]))
    assert_array_equal(first_indefinite(definite), first_indefinite(wanted.cov))
    assert_array_equal(error, position_error(wanted.mean, BASE.x_true))


def test_only_what_is_asked_for_is_kept():
    got = quiet(EKF, priors(), BASE.z, MODEL, 3)
    assert isinstance(got.final, Gaussian)
    assert got.final is got.state.estimate
    assert got.record is None
    got = quiet(EKF, priors(), BASE.z, MODEL, 3, record=records.definite)
    assert got.record.dtype == bool
    assert got.record.shape == (4, 11)
    assert first_indefinite(got.record).tolist() == [-1] * 11


def test_where_the_papers_filters_lose_definiteness():
    """Sections V and VI: the mtSOF at its first update, the bumped one at the 23rd."""
    for name, step in (("mtSOF", 1), ("B-mtSOF", 23), ("EKF", -1)):
        got = quiet(PAPER[name], BASE.prior, BASE.z, MODEL, 30, record=records.definite)
        assert first_indefinite(got.record) == step


def test_one_configuration_has_no_batch_axes():
    got = quiet(EKF, BASE.prior, BASE.z, MODEL, 5, record=records.estimate)
    assert got.final.mean.shape == (2,)
    assert got.record.cov.shape == (6, 2, 2)
    wanted = run(EKF, Gaussian(BASE.prior.mean[None], BASE.prior.cov[None]), BASE.z, MODEL, 5)
    assert_array_equal(got.record.cov, wanted.cov[:, 0])


def test_a_truth_may_be_each_members_and_have_fewer_components():
    rng = np.random.default_rng(2)
    z = BASE.z + rng.normal(size=(4, 11, 2)) * [1.0, 0.01]
    truth = rng.normal(size=(11, 1))
    record = records.Distance(truth)
    got = quiet(EKF, priors(), z, MODEL, 4, record=record, z_per_step=True, chunk=3)
    mean = run(EKF, priors(), z, MODEL, 4, z_per_step=True).mean
    assert_array_equal(got.record, np.abs(mean[..., 0] - truth[:, 0]))
    assert_array_equal(run(EKF, priors(), z, MODEL, z_per_step=True, record=record), got.record)


def test_a_truth_has_no_more_components_than_the_state():
    record = records.Distance(np.ones(3))
    with pytest.raises(ValueError, match=r"truth must have shape .* k up to 2; found \(3,\)"):
        run(EKF, priors(), BASE.z, MODEL, 2, record=record)
    with pytest.raises(SweepError, match=r"truth must have shape .* k up to 2; found \(3,\)"):
        quiet(EKF, priors(), BASE.z, MODEL, 2, record=record)


@pytest.mark.parametrize("name", FILTERS)
def test_members_do_not_depend_on_chunk_or_order(name):
    wanted = quiet(FILTERS[name], priors(37), BASE.z, MODEL, 12).final
    for chunk in (1, 2, 5, 36, 1000):
        assert_same(quiet(FILTERS[name], priors(37), BASE.z, MODEL, 12, chunk=chunk).final, wanted)
    order = np.random.default_rng(1).permutation(37)
    shuffled = Gaussian(*(part[order] for part in priors(37)))
    got = quiet(FILTERS[name], shuffled, BASE.z, MODEL, 12, chunk=7).final
    assert_same(got, (part[order] for part in wanted))


FIVE = np.linspace(0.5, 2.5, 5)
MANY = {
    "mean": BASE.prior.mean * FIVE[:, None],
    "cov": BASE.prior.cov * FIVE[:, None, None],
    "z": BASE.z * FIVE[:, None] * [1.0, 0.4],
    "R": MODEL.R * FIVE[:, None, None],
    "bump": FIVE,
    "alpha": FIVE,
    "kappa": FIVE,
}


@pytest.mark.parametrize(
    "batched", [[key] for key in MANY] + [["mean", "cov"], ["z", "bump", "alpha"], [*MANY]]
)
def test_any_argument_may_be_a_batch(batched):
    """Options, models and measurements are dealt out with their configurations."""
    one = {"mean": BASE.prior.mean, "cov": BASE.prior.cov, "z": BASE.z, "R": MODEL.R}
    one |= {"bump": 1.0, "alpha": 0.9, "kappa": 1.0}

    def arguments(mean, cov, z, R, bump, alpha, kappa):
        filter_ = partial(FILTERS["B-UKF"], bump=bump, points=SigmaPoints(alpha, 2.0, kappa))
        return filter_, Gaussian(mean, cov), z, RangeBearing(R), 4

    given = arguments(**one | {key: MANY[key] for key in batched})
    got = quiet(*given, chunk=2).final
    wanted = run(*given)
    np.testing.assert_allclose(got.mean, wanted.mean[-1], rtol=1e-10)
    np.testing.assert_allclose(got.cov, wanted.cov[-1], rtol=0, atol=1e-13 * 1e4)


def test_batch_axes_form_a_grid():
    """Two priors by three noises by four bumps, in chunks that cut across."""
    prior = Gaussian(*(part[:2, None, None] for part in priors()))
    model = RangeBearing(MODEL.R * np.array([1.0, 10.0, 1e3])[:, None, None, None])
    bumped = partial(FILTERS["B-EKF 1"], bump=[0.0, 1.0, 2.0, 3.0])
    got = quiet(bumped, prior, BASE.z, model, 3, record=everything, chunk=5)
    history, definite, _ = got.record
    assert got.final.mean.shape == (2, 3, 4, 2)
    assert history.cov.shape == (4, 2, 3, 4, 2, 2)
    assert definite.shape == (4, 2, 3, 4)
    one = partial(FILTERS["B-EKF 1"], bump=2.0)
    alone = run(one, Gaussian(*(p[1] for p in priors())), BASE.z, RangeBearing(MODEL.R * 10.0), 3)
    np.testing.assert_allclose(history.mean[:, 1, 1, 2], alone.mean, rtol=1e-12)


def test_a_measurement_that_varies_is_dealt_out_too():
    z = BASE.z + np.random.default_rng(0).normal(size=(6, 11, 2)) * [1.0, 0.01]
    got = quiet(EKF, priors(), z, MODEL, 6, z_per_step=True, chunk=4).final
    wanted = run(EKF, priors(), z, MODEL, 6, z_per_step=True)
    assert_same(got, (wanted.mean[-1], wanted.cov[-1]))
    z = z[:, :1]
    got = quiet(EKF, priors(), z[:, 0], MODEL, 6, z_per_step=True, chunk=4).final
    wanted = run(EKF, priors(), z, MODEL, 6, z_per_step=True)
    np.testing.assert_allclose(got.mean, wanted.mean[-1], rtol=1e-12)


@pytest.mark.parametrize("steps", [4, 6])
def test_a_series_may_have_fewer_batch_axes_than_the_grid(steps):
    """With as many steps as members each had one measurement, the same at every step."""
    rng = np.random.default_rng(1)
    prior = Gaussian(rng.normal(BASE.prior.mean, 1.0, (6, 5, 2)), BASE.prior.cov)
    z = BASE.z + rng.normal(size=(steps, 5, 2)) * [1.0, 0.01]
    got = quiet(EKF, prior, z, MODEL, z_per_step=True, chunk=7, record=records.estimate).record
    wanted = run(EKF, prior, z, MODEL, z_per_step=True)
    assert_same(got, wanted)


def test_a_batch_of_linear_models():
    rng = np.random.default_rng(0)
    model = Linear(rng.normal(size=(5, 2, 2)), covariances(rng, (), 2))
    got = quiet(EKF, BASE.prior, [0.5, -0.5], model, 3, chunk=2).final
    wanted = run(
        EKF, Gaussian(np.tile(BASE.prior.mean, (5, 1)), BASE.prior.cov), [0.5, -0.5], model, 3
    )
    np.testing.assert_allclose(got.mean, wanted.mean[-1], rtol=1e-12)


def test_a_model_without_batch_axes_is_shared_whatever_it_holds():
    """Three configurations of a model whose arrays have three rows."""
    rng = np.random.default_rng(1)
    model = quadratic(rng, 3, 3)
    prior = Gaussian(rng.normal(size=(3, 3)), covariances(rng, (3,), 3))
    got = quiet(EKF, prior, np.ones(3), model, 2, chunk=2).final
    assert_same(got, (part[-1] for part in run(EKF, prior, np.ones(3), model, 2)))


@dataclass(frozen=True, eq=False)
class Offset:
    """h(x) = x + offset: a model with one vector per configuration."""

    R: np.ndarray
    offset: np.ndarray = field(metadata={"axes": 1})

    def h(self, x):
        return x + self.offset

    def jacobian(self, x):
        return np.eye(2)


def test_a_field_says_how_many_axes_one_value_has():
    rng = np.random.default_rng(2)
    model = Offset(covariances(rng, (5,), 2), rng.normal(size=(5, 2)))
    got = quiet(EKF, priors(5), BASE.z, model, 2, chunk=2).final
    assert_same(got, (part[-1] for part in run(EKF, priors(5), BASE.z, model, 2)))


def test_a_member_that_fails_is_nan_alone():
    """At the origin the EKF has no derivative: no warning, no exception."""
    mean = priors().mean.copy()
    mean[4] = 0.0
    got = quiet(EKF, Gaussian(mean, priors().cov), BASE.z, MODEL, 5, record=records.definite)
    healthy = quiet(EKF, priors(), BASE.z, MODEL, 5).final
    others = np.arange(11) != 4
    for ours, wanted in zip(got.final, healthy, strict=True):
        assert_array_equal(ours[others], wanted[others])
        assert np.isnan(ours[4]).all()
    assert first_indefinite(got.record).tolist() == [-1] * 4 + [1] + [-1] * 6


@dataclass(frozen=True)
class Whole:
    """Measures the state."""

    R: np.ndarray

    def h(self, x):
        return x

    def jacobian(self, x):
        return np.eye(2)


def test_a_model_is_looked_at_once_for_problems_that_differ_in_numbers_alone(monkeypatch):
    """Of another shape, one measurement for each configuration, they are another problem."""
    looked_at = []
    look = problems._probe_models
    monkeypatch.setattr(problems, "_probe_models", lambda *a: (looked_at.append(a), look(*a)))
    for looks, z in ((True, np.ones(2)), (False, np.zeros(2)), (True, np.ones((11, 2)))):
        looked_at.clear()
        got = quiet(EKF, priors(), z, Whole(np.eye(2)), 2)
        assert bool(looked_at) == looks
        wanted = run(EKF, priors(), z, Whole(np.eye(2)), 2)
        assert_same(got.final, (wanted.mean[-1], wanted.cov[-1]))
