"""Histories: shapes, broadcasting, the paper's printed states."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from histories import BASE, EKF, MODEL, NOISES, PRIORS, history
from naive import covariances
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Gaussian, SigmaPoints, first_indefinite, run
from navfilters.models import Linear, RangeBearing
from navfilters.papers.perea2007.experiment import isotropic


def test_the_papers_first_two_states():
    """Section IV: (77.36, 126.43) and (55.32, 131.94)."""
    mean, _ = history(steps=2)
    assert mean.round(2).tolist() == [[20.0, 80.0], [77.36, 126.43], [55.32, 131.94]]


@pytest.mark.parametrize("steps", [0, 1, 7, np.int64(3)])
def test_the_prior_comes_first_and_every_step_is_kept(steps):
    mean, cov = history(steps=steps)
    assert mean.shape == (steps + 1, 2)
    assert cov.shape == (steps + 1, 2, 2)
    assert_array_equal(mean[0], BASE.prior.mean)
    assert_array_equal(cov[0], BASE.prior.cov)


def test_each_state_is_one_update_of_the_one_before():
    mean, cov = history("B-EKF 1", steps=6)
    for k in range(6):
        state = FILTERS["B-EKF 1"](Gaussian(mean[k], cov[k]), BASE.z, MODEL)
        assert_array_equal(mean[k + 1], state.mean)
        assert_array_equal(cov[k + 1], state.cov)


def test_a_thousand_steps_by_default():
    assert run(lambda prior, z, model: prior, BASE.prior, BASE.z, MODEL).mean.shape == (1001, 2)


def test_z_per_step_takes_one_measurement_per_step():
    z = BASE.z + np.arange(4)[:, None] * [1.0, 0.01]
    got = history(z=z, steps=4, z_per_step=True)
    state = BASE.prior
    for k in range(4):
        state = EKF(state, z[k], MODEL)
        assert_array_equal(got.mean[k + 1], state.mean)


def test_a_measurement_that_varies_may_be_batched_too():
    z = BASE.z + np.arange(4)[:, None, None] * np.ones((3, 1)) * [1.0, 0.01] + np.ones((3, 1))
    got = history(z=z, steps=4, z_per_step=True)
    assert got.mean.shape == (5, 3, 2)
    assert_allclose(got.mean[:, 1], history(z=z[:, 1], steps=4, z_per_step=True).mean, rtol=1e-12)


def test_no_step_needs_no_measurement():
    """steps = 0 with z (0, m) is a history of the prior alone."""
    mean, cov = history(z=np.zeros((0, 2)), steps=0, z_per_step=True)
    assert_array_equal(mean, BASE.prior.mean[None])
    assert_array_equal(cov, BASE.prior.cov[None])


def test_no_step_has_the_batch_axes_all_the_same():
    """The axes that only the measurement or the model has."""
    z = BASE.z + np.zeros((5, 1))
    assert history(z=z, steps=0).mean.shape == (1, 5, 2)
    assert history(z=z, steps=0).cov.shape == (1, 5, 2, 2)


@pytest.mark.parametrize("steps", [0, 2])
def test_an_empty_batch_has_an_empty_history(steps):
    """A chunk of a sweep that holds no member is no error."""
    mean, cov = history(prior=Gaussian(np.zeros((0, 2)), np.zeros((0, 2, 2))), steps=steps)
    assert mean.shape == (steps + 1, 0, 2)
    assert cov.shape == (steps + 1, 0, 2, 2)


@pytest.mark.parametrize("convert", [list, tuple, np.float32])
def test_lists_and_other_precisions_are_taken(convert):
    prior = Gaussian(convert([20.0, 80.0]), [[1e4, 0], [0, 1e4]])
    mean, cov = history(prior=prior, z=BASE.z.tolist())
    assert mean.dtype == cov.dtype == np.float64
    assert_array_equal(mean, history().mean)


def test_inputs_are_left_alone():
    prior = Gaussian(BASE.prior.mean.copy(), BASE.prior.cov.copy())
    z = BASE.z.copy()
    got = history("B-EKF 4", prior=prior, z=z)
    got.mean[:], got.cov[:] = 0.0, 0.0
    assert_array_equal(prior.mean, BASE.prior.mean)
    assert_array_equal(prior.cov, BASE.prior.cov)
    assert_array_equal(z, BASE.z)


FIVE = np.linspace(0.5, 2.5, 5)  # as many members as two states have sigma points
MANY = {
    "mean": BASE.prior.mean * FIVE[:, None],
    "cov": BASE.prior.cov * FIVE[:, None, None],
    "z": BASE.z * FIVE[:, None] * [1.0, 0.4],
    "R": MODEL.R * FIVE[:, None, None],
    "bump": FIVE,
}


@pytest.mark.parametrize("name", ["B-EKF 1", "B-UKF"])
@pytest.mark.parametrize(
    "batched", [[key] for key in MANY] + [["mean", "cov"], ["z", "bump"], [*MANY]], ids=" ".join
)
def test_any_argument_may_be_a_batch(name, batched):
    """Members of the batch are those run alone; the other arguments are shared."""
    shared = {"mean": BASE.prior.mean, "cov": BASE.prior.cov, "z": BASE.z, "R": MODEL.R, "bump": 1}

    def go(mean, cov, z, R, bump):
        estimator = partial(FILTERS[name], bump=bump)
        return run(estimator, Gaussian(mean, cov), z, RangeBearing(R), 4)

    got = go(**shared | {key: MANY[key] for key in batched})
    assert got.mean.shape == (5, 5, 2)
    assert got.cov.shape == (5, 5, 2, 2)
    for i in range(5):
        alone = go(**shared | {key: MANY[key][i] for key in batched})
        assert_allclose(got.mean[:, i], alone.mean, rtol=1e-10)
        assert_allclose(got.cov[:, i], alone.cov, rtol=0, atol=1e-13 * 1e4)


def test_batch_axes_form_a_grid():
    """Two priors by three noises by four bumps."""
    prior = Gaussian(PRIORS.mean[:2, None, None], PRIORS.cov[:2, None, None])
    bump = np.linspace(0.0, 3.0, 4)
    model = RangeBearing(NOISES[:, None])
    got = run(partial(FILTERS["B-EKF 1"], bump=bump), prior, BASE.z, model, steps=3)
    assert got.mean.shape == (4, 2, 3, 4, 2)
    one = Gaussian(PRIORS.mean[1], PRIORS.cov[1])
    alone = run(
        partial(FILTERS["B-EKF 1"], bump=bump[3]), one, BASE.z, RangeBearing(NOISES[2]), steps=3
    )
    assert_allclose(got.mean[:, 1, 2, 3], alone.mean, rtol=1e-10)


@pytest.mark.parametrize("steps", [1, 2])
@pytest.mark.parametrize("model", [MODEL, Linear(np.eye(2), np.eye(2))], ids=["curved", "linear"])
def test_mean_and_covariance_have_the_same_batch_axes(model, steps):
    """Five measurements are five members, also where every member has the same covariance."""
    z = BASE.z + np.arange(5)[:, None] * [1.0, 0.01]
    got = run(EKF, BASE.prior, z, model, steps)
    assert got.mean.shape == (steps + 1, 5, 2)
    assert got.cov.shape == (steps + 1, 5, 2, 2)
    assert first_indefinite(got.cov).shape == (5,)


def test_options_come_by_partial():
    points = SigmaPoints(0.8, 2.0, 3.3, "symmetric")
    got = run(partial(FILTERS["UKF"], points=points), BASE.prior, BASE.z, MODEL, 3)
    state = BASE.prior
    for k in range(3):
        state = FILTERS["UKF"](state, BASE.z, MODEL, points=points)
        assert_array_equal(got.mean[k + 1], state.mean)


def test_a_batch_of_linear_models_with_one_prior():
    """The members' H in front, for a filter that draws sigma points too; 2 n + 1 = 5 of them."""
    rng = np.random.default_rng(0)
    model = Linear(rng.normal(size=(5, 2, 2)), covariances(rng, (5,), 2))
    prior, z = isotropic([1.0, 2.0], 3.0), np.array([0.5, -0.5])
    got, wanted = (run(FILTERS[name], prior, z, model, 3) for name in ("UKF", "EKF"))
    assert got.mean.shape == (4, 5, 2)
    assert_allclose(got.mean, wanted.mean, rtol=1e-10)


def test_a_member_that_fails_is_nan_from_there_and_alone():
    """No warning, no exception: at the origin the EKF has no derivative."""
    mean = PRIORS.mean.copy()
    mean[1] = 0.0
    healthy = history(prior=PRIORS)
    got = history(prior=Gaussian(mean, PRIORS.cov))
    for ours, wanted in zip(got, healthy, strict=True):
        assert_array_equal(ours[:, [0, 2]], wanted[:, [0, 2]])
        assert np.isnan(ours[1:, 1]).all()
        assert np.isfinite(ours[0]).all()


@pytest.mark.parametrize(("name", "step"), [("mtSOF", 1), ("B-mtSOF", 23), ("EKF", -1)])
def test_where_the_papers_filters_lose_definiteness(name, step):
    """Sections V and VI: the mtSOF at its first update, the bumped one at the 23rd."""
    assert first_indefinite(history(name, steps=1000).cov) == step


def test_first_indefinite_counts_from_the_prior_and_per_member():
    good, bad = np.eye(2), np.diag([1.0, -1.0])
    cov = np.stack(
        [
            [good, bad, good, good],
            [good, good, good, bad],
            [good, bad, bad * np.nan, good],
        ]
    )
    with np.errstate(all="ignore"):
        assert first_indefinite(cov).tolist() == [-1, 0, 2, 1]


def test_a_nan_covariance_is_not_definite():
    cov = np.stack([np.eye(3), np.full((3, 3), np.nan), np.eye(3)])
    assert first_indefinite(cov) == 1
    assert first_indefinite(cov[:1]) == -1


def test_a_singular_covariance_is_not_definite():
    assert first_indefinite(np.stack([np.eye(2), np.ones((2, 2))])) == 1


@pytest.mark.parametrize("shape", [(2, 2), (4, 2, 3), (3,)])
def test_first_indefinite_needs_a_history(shape):
    with pytest.raises(ValueError, match=r"cov must have shape .steps \+ 1, ..., n, n.; found .*"):
        first_indefinite(np.ones(shape))


def test_as_many_steps_as_measurements_by_default():
    z = BASE.z + np.arange(4)[:, None] * [1.0, 0.01]
    assert_array_equal(
        history(z=z, steps=None, z_per_step=True).mean, history(z=z, steps=4, z_per_step=True).mean
    )


def test_any_model_with_the_protocols_names_will_do():
    """A model is what has R, h and jacobian."""
    model = SimpleNamespace(R=MODEL.R, h=MODEL.h, jacobian=MODEL.jacobian)
    assert_array_equal(history(model=model).mean, history().mean)
