"""The shaken pendulum: what it is, and what the lecture's three filters make of it."""

from dataclasses import FrozenInstanceError, replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from discrete_systems import ekf, predict
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import solve_continuous_are, solve_discrete_are

from navfilters import FILTERS, Gaussian, sweep
from navfilters.estimators.continuous import (
    ContinuousSystem,
    extended_kalman_bucy,
    linearized_kalman_bucy,
    reference_residual,
)
from navfilters.numerics.complex_step import complex_step
from navfilters.papers.lecture16 import (
    Setup,
    band_limited_noise,
    discretised,
    experiments,
    sampled,
)
from navfilters.papers.lecture16.noise import sum_of_sines
from navfilters.runs import records
from navfilters.runs.consistency import nees

NEAR, FAR = Setup(duration=8.0), Setup(duration=8.0, released=1.2)
AT = np.array([0.7, -1.3]), np.array([0.2]), np.array([0.4, -0.6]), 1.5
SENSING = AT[0], np.array([0.03]), 1.5


def discrete(setup, y, dt):
    """The DT-EKF's history on the grid of dt."""
    k = np.arange(1, round(setup.duration / dt) + 1)
    u = sampled(setup.control, (k - 1) * dt)
    return ekf(discretised(setup.system, dt), setup.prior, sampled(y, k * dt), u)


@pytest.fixture(scope="module", params=[NEAR, FAR], ids=["on its plan", "off its plan"])
def results(request):
    """Truth and the estimates of all three at 10 times a second."""
    setup = request.param
    x, y = setup.experiment(seed=1)
    t = np.linspace(0, setup.duration, 81)
    at = setup.prior, y, t, setup.control
    lkf = linearized_kalman_bucy(setup.system, setup.reference(), *at, rtol=1e-6, atol=1e-6)
    continuous = extended_kalman_bucy(setup.system, *at, rtol=1e-6, atol=1e-6)
    history = discrete(setup, y, 0.004)
    every = Gaussian(history.mean[::25], history.cov[::25])
    return setup, sampled(x, t), {"CT-LKF": lkf, "CT-EKF": continuous, "DT-EKF": every}


def sigmas(truth, got):
    """Largest error of the angle in the filter's own deviations."""
    return np.max(np.abs(got.mean - truth)[:, 0] / np.sqrt(got.cov[:, 0, 0]))


def test_a_filter_works_near_its_linearisation_and_fails_away_from_it(results):
    setup, truth, estimates = results
    assert sigmas(truth, estimates["CT-EKF"]) < 3.5
    assert sigmas(truth, estimates["DT-EKF"]) < 3.5
    if setup is NEAR:
        assert sigmas(truth, estimates["CT-LKF"]) < 3.5
    else:
        assert sigmas(truth, estimates["CT-LKF"]) > 9
        error = np.abs(estimates["CT-LKF"].mean - truth)[:, 0]
        assert error[40:].max() > 0.25  # rad, where the EKF is right to 0.1


def test_the_truth_leaves_its_reference():
    x, _ = FAR.experiment(seed=1)
    t = np.linspace(0, 8, 200)
    planned = sampled(FAR.reference().x, t)
    assert np.abs(sampled(x, t) - planned)[:, 0].max() > 0.9
    x, _ = NEAR.experiment(seed=1)
    assert np.abs(sampled(x, t) - planned)[:, 0].max() < 0.5


def test_two_hundred_runs_are_as_uncertain_as_the_filter_says():
    """DT-EKF, all runs as one batch: the mean of e^T P^-1 e is 2, the size of the state."""
    setup = replace(FAR, duration=2.0)
    rng = np.random.default_rng(0)
    guesses = rng.standard_normal((200, 2)) * setup.deviation
    runs = [setup.experiment(seed) for seed in range(10)]
    dt = 0.004
    k = np.arange(1, 501)
    y = np.stack([sampled(y, k * dt) for _, y in runs], axis=1)[:, None]
    prior = Gaussian(setup.prior.mean - setup.guess + guesses.reshape(20, 10, 2), setup.prior.cov)
    u = sampled(setup.control, (k - 1) * dt)[:, None, None]
    got = ekf(discretised(setup.system, dt), prior, y, u)
    error = got.mean[-1] - np.array([x(2.0) for x, _ in runs])
    assert got.mean.shape == (501, 20, 10, 2)
    nees = np.einsum("...i,...ij,...j", error, np.linalg.inv(got.cov[-1]), error)
    assert 1.2 < nees.mean() < 3.2


@pytest.mark.parametrize("released", [0.5, 1.2])
def test_the_discrete_filter_tends_to_the_continuous_one_with_order_one(released):
    setup = Setup(duration=3.0, released=released)
    _, y = setup.experiment(seed=0)
    t = np.linspace(0, 3, 26)
    wanted = extended_kalman_bucy(
        setup.system, setup.prior, y, t, setup.control, rtol=1e-10, atol=1e-10
    )
    steps = np.array([8e-3, 4e-3, 2e-3])
    histories = [discrete(setup, y, dt) for dt in steps]
    for name in ("mean", "cov"):
        coarse, middle, fine = (
            getattr(h, name)[np.round(t / dt).astype(int)]
            for h, dt in zip(histories, steps, strict=True)
        )
        exact = getattr(wanted, name)
        error = [np.abs(h - exact).max() for h in (coarse, middle, fine)]
        assert 0.9 < np.polyfit(np.log(steps), np.log(error), 1)[0] < 1.1
        # Two extrapolations to dt = 0 arrive there without knowing the continuous filter.
        limit = (8 * fine - 6 * middle + coarse) / 3
        assert np.abs(limit - exact).max() < error[-1] / 100


def linearised(setup):
    """The pendulum about its rest, as a linear system: every filter's limit."""
    at = np.zeros(2), np.zeros(1), np.zeros(2), 0.0
    A, B, L = setup.A(*at), np.array([[0.0], [1.0]]), setup.L(*at)
    C, M = setup.C(np.zeros(2), np.zeros(1), 0.0), setup.M(np.zeros(2), np.zeros(1), 0.0)
    system = setup.system
    return ContinuousSystem(
        lambda x, u, w, t: A @ x + B @ u + L @ w, lambda x, v, t: C @ x + M @ v, system.Q, system.R
    ), (A, C, L @ system.Q @ L.T, M @ system.R @ M.T)


def test_discretised_noise_keeps_its_effect():
    """The discrete steady state is the continuous one's to order dt; with Q itself, 0."""
    linear, (A, C, Q, R) = linearised(Setup())
    wanted = solve_continuous_are(A.T, C.T, Q, R)
    errors = []
    for dt in (2e-3, 1e-3):
        system = discretised(linear, dt)
        got = ekf(system, Gaussian(np.zeros(2), wanted), np.zeros((20, 1)), np.zeros((20, 1)))
        F = np.eye(2) + dt * A
        steady = solve_discrete_are(F.T, C.T, dt * Q, R / dt)
        last = Gaussian(
            got.mean[-1], steady - steady @ C.T @ C @ steady / (C @ steady @ C.T + R / dt)
        )
        assert_allclose(predict(system, last, np.zeros(1), 0).cov, steady, rtol=1e-9)
        errors.append(np.abs(steady / wanted - 1)[0, 0])
    assert 0.9 < np.log2(errors[0] / errors[1]) < 1.1
    assert errors[1] < 0.05


@pytest.mark.parametrize(
    ("given", "function", "position", "at"),
    [
        ("A", "f", 0, AT),
        ("B", "f", 1, AT),
        ("L", "f", 2, AT),
        ("C", "h", 0, SENSING),
        ("M", "h", 1, SENSING),
    ],
)
def test_jacobians(given, function, position, at):
    """By hand, by complex step, by JAX."""
    setup = Setup(sensor=(1.7, 0.4), length=1.3)
    at = tuple(at)
    got = getattr(setup.system, given)(*at)
    f = getattr(setup, function)
    step = complex_step(lambda z: f(*at[:position], z, *at[position + 1 :]), at[position])
    assert_allclose(step, got, rtol=1e-14, atol=1e-15)
    automatic = jax.jit(jax.jacfwd(f, position))(*map(jnp.asarray, at))
    assert_allclose(automatic, got, rtol=1e-14, atol=1e-15)


def test_the_gains_depend_on_the_state():
    setup = Setup()
    still, w, v = np.zeros(1), np.zeros(2), np.zeros(1)
    at = [np.array([angle, 0.0]) for angle in (0.0, np.pi / 2)]
    assert_allclose([setup.L(x, still, w, 0.0)[1] for x in at], [[-1, 0], [0, -1]], atol=1e-15)
    assert_allclose([setup.M(x, v, 0.0)[0, 0] for x in at], [np.sqrt(5), 1.0])


def test_without_noise_energy_is_lost_to_damping_alone():
    """Against the energy's own balance: d(v^2/2 - g/l cos a)/dt = -damping v^2."""
    x = Setup(drive=0.0, damping=0.0).reference().x
    t = np.linspace(0, 20, 50)
    angle, rate = sampled(x, t).T
    energy = rate**2 / 2 - Setup().gravity * np.cos(angle)
    assert_allclose(energy, energy[0], rtol=1e-8)
    damped = sampled(Setup(drive=0.0).reference().x, t)
    assert np.abs(damped[-10:, 0]).max() < 0.35


def test_the_reference_satisfies_its_dynamics():
    _, residual = reference_residual(FAR.system, FAR.reference(), np.linspace(0, 8, 3))
    assert np.abs(residual).max() < 1e-6


def test_noise_has_the_density_it_should():
    """Mean square 2 b S; and integrated over a second, as white noise: variance S."""
    S, bandwidth = np.repeat([0.04, 1.0], 20), 5.0
    noise = band_limited_noise(np.random.default_rng(0), np.sqrt(S), bandwidth, 100.0)
    w = noise(np.arange(0, 100, 0.02)) / np.sqrt(S)
    square = (w**2).mean(axis=0).reshape(2, 20).mean(axis=1)
    assert_allclose(square, 2 * bandwidth, rtol=0.05)
    seconds = w.reshape(100, 50, 2, 20).sum(axis=1) * 0.02
    assert_allclose((seconds**2).mean(axis=(0, 2)), 1, rtol=0.08)


def test_a_noise_is_its_cosines_and_sines_at_however_many_times():
    """Its digits do not depend on how many are asked for; added up by hand."""
    waves = np.random.default_rng(0).standard_normal((2 * 37, 3))
    noise, t = sum_of_sines(waves, 11.0), np.linspace(0, 11, 60)
    found = noise(t)
    assert_array_equal(noise(t[:7]), found[:7])
    assert_allclose(noise(t.reshape(12, 5)), found.reshape(12, 5, 3), rtol=1e-12)
    phase = 2 * np.pi * np.multiply.outer(t, np.arange(37) + 0.5) / 11.0
    wanted = np.zeros((60, 3))
    for k in range(37):
        wanted += np.cos(phase[:, k, None]) * waves[k] + np.sin(phase[:, k, None]) * waves[37 + k]
    assert_allclose(found, wanted, rtol=0, atol=1e-11)
    for asked in (float(t[9]), t[9], np.array(t[9])):
        assert_allclose(noise(asked), wanted[9], rtol=0, atol=1e-11)


def test_a_seed_is_an_experiment():
    (x, y), (again, _), (other, _) = (FAR.experiment(seed) for seed in (1, 1, 2))
    assert_array_equal(x(5.0), again(5.0))
    assert abs(x(5.0) - other(5.0))[0] > 1e-3
    assert y(5.0).shape == (1,)
    assert_allclose(x(0.0), [1.2, 0.0], atol=1e-12)


def test_experiments_together_are_those_one_by_one():
    setups, t = [FAR, replace(FAR, released=0.5), FAR], np.linspace(0, 8, 9)
    for case, seed, (x, y) in zip(setups, (1, 1, 2), experiments(setups, (1, 1, 2)), strict=True):
        x_alone, y_alone = case.experiment(seed)
        assert_allclose(x(t), x_alone(t), rtol=0, atol=1e-8)
        assert_allclose(y(t), y_alone(t), rtol=0, atol=1e-8)
        assert_allclose(y(5.0), y_alone(5.0), rtol=0, atol=1e-8)
    with pytest.raises(ValueError, match="setups must differ in released alone"):
        experiments([FAR, replace(FAR, drive=0.0)], (1, 2))


def test_a_setup_is_frozen():
    with pytest.raises(FrozenInstanceError):
        FAR.released = 0.1
    assert_array_equal(FAR.prior.mean, [1.3, -0.1])
    assert_allclose(FAR.prior.cov, 0.01 * np.eye(2), rtol=1e-12)


@pytest.mark.parametrize("engine", ["numpy", "jax"])
def test_a_sweep_of_pendulums(engine):
    """The whole histories of members with records of their own, on both engines."""
    setup, dt, k = FAR, 0.01, np.arange(1, 101)
    system, u = discretised(setup.system, dt), sampled(setup.control, (k - 1) * dt)
    y = np.stack([sampled(setup.experiment(seed)[1], k * dt) for seed in (1, 2)], axis=1)
    wanted = ekf(system, setup.prior, y, u)
    got = sweep(
        FILTERS["EKF"],
        setup.prior,
        y,
        system.sensor,
        dynamics=system.dynamics(u),
        z_per_step=True,
        record=records.estimate,
        engine=engine,
        progress=False,
    ).record
    assert_allclose(got.mean, wanted.mean, rtol=1e-10, atol=1e-12)
    assert_allclose(got.cov, wanted.cov, rtol=1e-10, atol=1e-14)


def test_consistency_takes_what_both_kinds_of_filter_return():
    """The times in front, of a history as of a trajectory; one tends to the other with the step."""
    setup = replace(NEAR, duration=2.0)
    x, y = NEAR.experiment(seed=1)
    t = np.linspace(0, 2, 201)
    continuous = extended_kalman_bucy(
        setup.system, setup.prior, y, t, setup.control, rtol=1e-6, atol=1e-6
    )
    histories = [discrete(setup, y, 0.01), discrete(setup, y, 0.002)]
    every = [Gaussian(h.mean[::n], h.cov[::n]) for h, n in zip(histories, (1, 5), strict=True)]
    wanted, coarse, fine = (
        nees(found.mean - sampled(x, t), found.cov) for found in (continuous, *every)
    )
    assert wanted.shape == coarse.shape == (201,)
    assert np.abs(fine - wanted).max() < np.abs(coarse - wanted).max() / 4
