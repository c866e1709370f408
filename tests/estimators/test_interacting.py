"""The IMM against filterpy's, its limits, and what it says of its modes."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from filterpy.kalman import IMMEstimator, KalmanFilter
from moving import Swing
from naive import covariances
from numpy.testing import assert_allclose, assert_array_equal
from polar_models import engines
from ruled import Matched

from navfilters import FILTERS, Filter, Gaussian, run, sweep
from navfilters.estimators import AdaptiveRobust, InteractingModels, Modes
from navfilters.models import Linear

SWITCHING = np.array([[0.9, 0.1], [0.3, 0.7]])
FIRST = np.array([0.2, 0.8])


def problem(steps=25, members=3):
    """Two motions with two noises."""
    rng = np.random.default_rng(9)
    G = [0.95 * np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2)]
    modes = Modes(
        [Matched(g, np.eye(3), q * np.eye(3)) for g, q in zip(G, (0.1, 2.0), strict=True)]
    )
    sensor = Linear(rng.normal(size=(2, 3)), covariances(rng, (), 2))
    prior = Gaussian(rng.normal(size=(members, 3)), covariances(rng, (members,), 3))
    return prior, 3 * rng.normal(size=(steps, members, 2)), sensor, modes


def states_of(filter_, prior, z, sensor, modes):
    return run(filter_, prior, z, sensor, dynamics=modes, z_per_step=True, record=lambda s: s)


def test_every_step_is_filterpys():
    """Mixed means, covariances and mode probabilities over 25 steps of three members."""
    prior, z, sensor, modes = problem()
    got = states_of(InteractingModels(switching=SWITCHING, probabilities=FIRST), *problem())
    for i in range(3):
        peers = []
        for mode in modes.modes:
            peer = KalmanFilter(3, 2)
            peer.x, peer.P = prior.mean[i].copy(), prior.cov[i].copy()
            peer.F, peer.Q, peer.H, peer.R = mode.G, mode.Q, sensor.H, sensor.R
            peers.append(peer)
        whole = IMMEstimator(peers, FIRST, SWITCHING)
        for k, measured in enumerate(z[:, i], 1):
            whole.predict()
            whole.update(measured)
            assert_allclose(got.estimate.mean[k, i], whole.x, rtol=1e-8, atol=1e-10)
            assert_allclose(got.estimate.cov[k, i], whole.P, rtol=1e-8, atol=1e-10)
            assert_allclose(got.memory.probabilities[k, i], whole.mu, rtol=1e-7)


def test_modes_that_are_the_same_are_the_filter():
    prior, z, sensor, modes = problem()
    same = Modes([modes.modes[1]] * 2)
    got = states_of(InteractingModels(switching=SWITCHING), prior, z, sensor, same)
    one = run(FILTERS["EKF"], prior, z, sensor, dynamics=modes.modes[1], z_per_step=True)
    assert_allclose(got.estimate.mean, one.mean, rtol=1e-9, atol=1e-12)
    assert_allclose(got.estimate.cov, one.cov, rtol=1e-9, atol=1e-12)
    stationary = np.array([0.75, 0.25])  # of SWITCHING
    assert_allclose(got.memory.probabilities[-1], np.broadcast_to(stationary, (3, 2)), atol=1e-6)


def test_a_mode_that_never_leaves_and_is_certain_is_its_filter():
    prior, z, sensor, modes = problem()
    sure = InteractingModels(switching=np.eye(2), probabilities=[1.0, 0.0])
    got = states_of(sure, prior, z, sensor, modes)
    one = run(FILTERS["EKF"], prior, z, sensor, dynamics=modes.modes[0], z_per_step=True)
    assert_allclose(got.estimate.mean, one.mean, rtol=1e-12)
    assert_array_equal(got.memory.probabilities[-1], np.tile([1.0, 0.0], (3, 1)))


def test_it_finds_the_mode_that_is_true():
    """Twenty quiet steps, then twenty with a hundred times the noise."""
    rng = np.random.default_rng(1)
    quiet = Matched(np.eye(1), np.eye(1), 0.01 * np.eye(1))
    modes = Modes([quiet, replace(quiet, Q=25.0 * np.eye(1))])
    steps = rng.normal(size=(40, 50, 1)) * np.repeat([0.1, 5.0], 20)[:, None, None]
    z = np.cumsum(steps, axis=0) + rng.normal(size=steps.shape) * 0.5
    prior = Gaussian(np.zeros((50, 1)), np.eye(1))
    got = states_of(InteractingModels(), prior, z, Linear([[1.0]], [[0.25]]), modes)
    loud = got.memory.probabilities[..., 1].mean(axis=1)
    assert loud[10:21].max() < 0.2
    assert loud[25:].min() > 0.8


def test_nothing_measured_leaves_the_predicted_probabilities():
    prior, z, sensor, modes = problem()
    z[4, 1] = np.nan
    z[7, 2, 0] = np.nan
    filter_ = InteractingModels(switching=SWITCHING)
    got = states_of(filter_, prior, z, sensor, modes)
    assert_allclose(
        got.memory.probabilities[5, 1], got.memory.probabilities[4, 1] @ SWITCHING, rtol=1e-12
    )
    assert np.isfinite(got.estimate.mean).all()
    assert got.missed[-1].tolist() == [0, 1, 0]
    assert np.isnan(got.innovation[5, 1]).all()
    assert np.isnan(got.innovation[8, 2]).tolist() == [True, False]
    assert np.isfinite(got.S[1:]).all()
    whole = states_of(filter_, *problem())
    assert_array_equal(got.estimate.mean[:, 0], whole.estimate.mean[:, 0])


def test_a_member_that_is_nan_stays_alone():
    prior, z, sensor, modes = problem()
    bad = Gaussian(np.where(np.arange(3)[:, None] == 1, np.nan, prior.mean), prior.cov)
    filter_ = InteractingModels(switching=SWITCHING)
    state, clean = (filter_.step(filter_.init(p), z[0], sensor, modes) for p in (bad, prior))
    assert np.isnan(state.estimate.mean[1]).all()
    assert_array_equal(state.estimate.mean[[0, 2]], clean.estimate.mean[[0, 2]])


@engines
@pytest.mark.parametrize("name", ["EKF", "UKF"])
def test_run_and_sweep_on_both_engines(name, engine):
    """Nonlinear motion, a rule in each mode, and one matrix of switching for each member."""
    rng = np.random.default_rng(5)
    prior, z, sensor, _ = problem()
    z[3, 1] = z[6, 2, 0] = np.nan
    G = 0.9 * np.linalg.qr(rng.normal(size=(3, 3)))[0]
    modes = Modes([Swing(G, q * np.eye(3)) for q in (0.1, 5.0)])
    stay = np.array([0.7, 0.9, 0.99])[:, None]
    switching = np.stack([np.hstack([stay, 1 - stay]), np.hstack([1 - stay, stay])], axis=-2)
    inner = Filter(FILTERS[name].moments, rule=AdaptiveRobust())
    filter_ = InteractingModels(inner, switching)
    one = states_of(filter_, prior, z, sensor, modes)
    many = sweep(
        filter_, prior, z, sensor, dynamics=modes, z_per_step=True, engine=engine, progress=False
    )
    assert_allclose(many.final.mean, one.estimate.mean[-1], rtol=1e-8)
    assert_allclose(many.state.memory.probabilities, one.memory.probabilities[-1], rtol=1e-7)
    alone = InteractingModels(inner, switching[2])
    third = states_of(alone, Gaussian(prior.mean[2], prior.cov[2]), z[:, 2], sensor, modes)
    assert_allclose(one.estimate.mean[:, 2], third.estimate.mean, rtol=1e-9, atol=1e-12)


class Curved(Swing):
    def retract(self, x, dx):
        return x + dx


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: InteractingModels("EKF"), TypeError, "estimator must be a Filter; found str"),
        (lambda: InteractingModels(switching=[[1.0]]), ValueError, "switching must have shape"),
        (
            lambda: InteractingModels(switching=np.ones((2, 2))),
            ValueError,
            "switching must be at le",
        ),
        (
            lambda: InteractingModels(probabilities=[0.5, 0.2, 0.3]),
            ValueError,
            r"probabilities must have shape \(..., 2\); found \(3,\)",
        ),
        (
            lambda: InteractingModels(probabilities=[1.5, -0.5]),
            ValueError,
            "probabilities must be at least 0 and sum to 1",
        ),
        (lambda: Modes([Swing(np.eye(2), np.eye(2))]), ValueError, "modes must be at least two"),
        (
            lambda: Modes([Swing(np.eye(2), np.eye(2)), Swing(np.eye(2), np.ones((4, 2, 2)))]),
            ValueError,
            r"modes must have Q with as many axes; found \[2, 3\]",
        ),
        (lambda: Modes([Curved(np.eye(2), np.eye(2))] * 2), ValueError, "found retract in Curved"),
    ],
)
def test_parameters_are_checked_when_it_is_made(make, error, message):
    with pytest.raises(error, match=message):
        make()


def test_modes_go_to_another_process_and_pass_for_the_first_elsewhere():
    prior, z, sensor, modes = problem()
    again = pickle.loads(pickle.dumps(modes))
    options = {"dynamics": again, "z_per_step": True}
    got = run(FILTERS["EKF"], prior, z, sensor, **options)
    wanted = run(FILTERS["EKF"], prior, z, sensor, **options | {"dynamics": modes.modes[0]})
    assert_array_equal(got.mean, wanted.mean)
    assert not hasattr(modes, "propagate")


def test_dynamics_that_are_not_modes_are_named():
    prior, z, sensor, modes = problem()
    filter_ = InteractingModels()
    with pytest.raises(TypeError, match="dynamics must be Modes; found Matched"):
        filter_.step(filter_.init(prior), z[0], sensor, modes.modes[0])
    with pytest.raises(ValueError, match="dynamics must have 2 modes, as switching; found 3"):
        filter_.step(filter_.init(prior), z[0], sensor, Modes([modes.modes[0]] * 3))
