"""Considered states: the printed partition, the covariance of a linear estimator, and failures."""

from functools import partial

import numpy as np
import pytest
from naive import covariances
from numpy.testing import assert_allclose, assert_array_equal
from polar_models import engines
from ruled import Matched

from navfilters import FILTERS, Filter, Gaussian, run, sweep, unscented
from navfilters.estimators import (
    AdaptiveRobust,
    considering,
    iterated,
    once,
    recalibrated,
    recursive,
)
from navfilters.estimators.variants import Underweighting, bump_linear, bump_state
from navfilters.models import Augmented, Linear, RangeBearing

EKF = FILTERS["EKF"]


def problem():
    """Two states and a bias, of three; the bias does not move."""
    rng = np.random.default_rng(2)
    G = np.eye(3)
    G[:2, :2] = 0.9 * np.linalg.qr(rng.normal(size=(2, 2)))[0]
    dynamics = Matched(G, np.eye(3), np.diag([0.2, 0.1, 0.0]))
    model = Linear(rng.normal(size=(2, 3)), covariances(rng, (), 2))
    prior = Gaussian(rng.normal(size=(4, 3)), covariances(rng, (4,), 3))
    return prior, rng.normal(size=(8, 4, 2)), model, dynamics


def printed(x, P, z, model, dynamics):
    """The partitioned equations: A of the states, C of states and bias, B of the bias."""
    H, J = model.H[:, :2], model.H[:, 2:]
    F, Q = dynamics.G[:2, :2], dynamics.Q[:2, :2]
    A, C, B = P[:2, :2], P[:2, 2:], P[2:, 2:]
    b, x = x[2:], x[:2]
    for measured in z:
        x, A, C = F @ x, F @ A @ F.T + Q, F @ C
        S = H @ A @ H.T + H @ C @ J.T + J @ C.T @ H.T + J @ B @ J.T + model.R
        K = (A @ H.T + C @ J.T) @ np.linalg.inv(S)
        x = x + K @ (measured - H @ x - J @ b)
        A, C = A - K @ S @ K.T, C - K @ (H @ C + J @ B)
        yield np.concatenate([x, b]), np.block([[A, C], [C.T, B]])


def test_every_step_is_the_printed_one():
    prior, z, model, dynamics = problem()
    got = run(considering(EKF, [2]), prior, z, model, dynamics=dynamics, z_per_step=True)
    for i in range(4):
        steps = printed(prior.mean[i], prior.cov[i], z[:, i], model, dynamics)
        for k, (x, P) in enumerate(steps, 1):
            assert_allclose(got.mean[k, i], x, rtol=1e-10, atol=1e-13)
            assert_allclose(got.cov[k, i], P, rtol=1e-10, atol=1e-13)


@pytest.mark.parametrize("correction", [once, iterated, recalibrated])
@pytest.mark.parametrize(
    "stages",
    [
        {},
        {"moments": unscented},
        {"variant": partial(bump_linear, bump=0.7)},
        {"variant": Underweighting(0.7, 1)},
        {"variant": bump_state},
        {"rule": AdaptiveRobust()},
    ],
)
def test_it_says_what_it_is_on_a_linear_model(stages, correction):
    prior, z, model, _ = problem()
    filter_ = considering(Filter(**stages, correction=correction), [0, 2])
    wanted = filter_.linear_limit(prior, z[0], model)
    got = filter_.update(filter_.init(prior), z[0], model).estimate
    assert_allclose(got.mean, wanted.mean, rtol=1e-7, atol=1e-10)
    assert_allclose(got.cov, wanted.cov, rtol=1e-7, atol=1e-10)


def test_its_limit_is_the_printed_partition():
    prior, z, model, _ = problem()
    still = Matched(np.eye(3), np.eye(3), np.zeros((3, 3)))
    got = considering(EKF, [2]).linear_limit(prior, z[0], model)
    for i in range(4):
        ((x, P),) = printed(prior.mean[i], prior.cov[i], z[:1, i], model, still)
        assert_allclose(got.mean[i], x, rtol=1e-10, atol=1e-13)
        assert_allclose(got.cov[i], P, rtol=1e-10, atol=1e-13)


def test_its_covariance_is_that_of_the_linear_estimator_that_it_is():
    """Its weights are found by unit measurements; no formula of a filter takes part."""
    prior, z, model, _ = problem()
    one = Gaussian(np.zeros(3), prior.cov[0])
    steps = 5
    units = np.eye(2 * steps).reshape(2 * steps, steps, 2).swapaxes(0, 1)
    go = partial(run, considering(EKF, [2]), z_per_step=True)
    weights = go(one, units, model).mean[-1].T  # (3, 2 steps)
    cov = go(one, z[:steps, 0], model).cov[-1]
    H = np.tile(model.H, (steps, 1))
    rest = np.eye(3) - weights @ H
    wanted = rest @ one.cov @ rest.T + weights @ np.kron(np.eye(steps), model.R) @ weights.T
    assert_allclose(cov, wanted, rtol=1e-10)


def test_it_is_never_better_than_the_filter_that_estimates_the_bias():
    prior, z, model, dynamics = problem()
    options = {"dynamics": dynamics, "z_per_step": True}
    full, considered = (
        run(f, prior, z, model, **options).cov for f in (EKF, considering(EKF, [2]))
    )
    assert np.linalg.eigvalsh(considered - full).min() > -1e-12
    assert_allclose(considered[-1, :, 2, 2], prior.cov[:, 2, 2], rtol=1e-12)


def test_a_constant_bias_puts_a_floor_under_the_variance():
    """A scalar with bias b: after many updates the variance is var b, and without it 0."""
    model = Linear([[1.0, 1.0]], [[1.0]])
    prior = Gaussian(np.zeros(2), np.diag([1e6, 4.0]))
    history = run(considering(EKF, [1]), prior, np.array([5.0]), model, 400)
    assert_allclose(history.cov[-1, 0, 0], 4.0 + 1 / 400, rtol=1e-5)
    assert_array_equal(history.mean[:, 1], 0.0)


@engines
def test_sigma_points_and_bumps_on_both_engines(engine):
    """On a linear model all moments agree; range and bearing with a bias of the range compiles."""
    prior, z, model, dynamics = problem()
    options = {"dynamics": dynamics, "z_per_step": True}
    wanted = run(considering(EKF, [2]), prior, z, model, **options)
    ukf = run(considering(FILTERS["UKF"], [2]), prior, z, model, **options)
    assert_allclose(ukf.mean, wanted.mean, rtol=1e-7, atol=1e-9)
    assert_allclose(ukf.cov, wanted.cov, rtol=1e-7, atol=1e-9)
    biased = Augmented(RangeBearing(np.diag([0.1, 1e-3])), 2, [[0, 0, 1.0], [0, 0, 0]])
    start = Gaussian(np.array([30.0, 40.0, 0.0]), np.diag([4.0, 4.0, 1.0]))
    sent = biased.h(np.array([31.0, 39.0, 0.5])) + np.zeros((5, 3, 1))
    sent[2, 1] = sent[1, 0, 1] = np.nan
    for filter_ in (EKF, Filter(unscented, rule=AdaptiveRobust()), Filter(variant=bump_linear)):
        one = run(considering(filter_, [2]), start, sent, biased, z_per_step=True)
        many = sweep(
            considering(filter_, [2]),
            start,
            sent,
            biased,
            z_per_step=True,
            engine=engine,
            progress=False,
        ).final
        assert_allclose(many.mean, one.mean[-1], rtol=1e-9)
        assert_allclose(many.cov, one.cov[-1], rtol=1e-9, atol=1e-12)
        assert_array_equal(one.mean[..., 2], 0.0)


def test_a_variant_that_depends_on_the_step_still_does():
    prior, z, model, _ = problem()
    bumped = considering(Filter(variant=Underweighting(5.0, 1)), [2])
    always = considering(Filter(variant=partial(bump_linear, bump=5.0)), [2])
    got, first, later = (
        run(f, prior, z, model, z_per_step=True).cov
        for f in (bumped, always, considering(EKF, [2]))
    )
    assert_array_equal(got[1], first[1])
    assert (got[2] != first[2]).any()
    assert (got[1] != later[1]).any()


def test_all_considered_leaves_the_state():
    prior, z, model, _ = problem()
    filter_ = considering(EKF, range(3))
    state = filter_.update(filter_.init(prior), z[0], model)
    assert_array_equal(state.estimate.mean, prior.mean)
    assert_allclose(state.estimate.cov, prior.cov, rtol=1e-14)


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: considering("EKF", [1]), TypeError, "estimator must be a Filter; found str"),
        (
            lambda: considering(Filter(form="short"), [1]),
            ValueError,
            "form 'joseph'; found 'short'",
        ),
        (
            lambda: considering(Filter(correction=partial(recursive, updates=3)), [1]),
            ValueError,
            "gain from P_xz; recursive updates do not",
        ),
        (lambda: considering(EKF, []), ValueError, "states must be at least one number"),
        (lambda: considering(EKF, [-1]), ValueError, "states must be an integer of at least 0"),
        (lambda: considering(EKF, [True]), ValueError, "states must be an integer of at least 0"),
    ],
)
def test_what_cannot_be_considered_is_named(make, error, message):
    with pytest.raises(error, match=message):
        make()


def test_a_state_that_there_is_not_is_named():
    prior, z, model, _ = problem()
    filter_ = considering(EKF, [3])
    with pytest.raises(ValueError, match="states must be below 3, their number; found 3"):
        filter_.update(filter_.init(prior), z[0], model)
