"""Flights through the manoeuvre by the one loop: plain loops, Table 1, any filter, both engines."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Filter, run, sweep
from navfilters.estimators.robust import AdaptiveRobust
from navfilters.papers.xiong2009 import (
    ESTIMATORS,
    VARIANTS,
    CurrentNoise,
    Setup,
    errors,
    errors_each_second,
    fly,
    measurements,
    position_errors,
    rms_error,
    root_mean_square,
    truth,
)
from navfilters.papers.xiong2009 import __main__ as command
from navfilters.space import Orbit

pytestmark = pytest.mark.slow

SHORT = Setup(duration=2000, window=500, burns=((700, 900),), thrust=0.45)
EKF = Filter(form="short")


@pytest.fixture
def short(monkeypatch):
    """Every variant with a run of 2000 s, which burns once."""
    for name, setup in VARIANTS.items():
        few = replace(setup, duration=2000, window=500, burns=SHORT.burns, thrust=0.45)
        monkeypatch.setitem(VARIANTS, name, few)


def test_rms_is_equation_42_as_printed():
    """2001 terms over 1999."""
    error = np.random.default_rng(0).normal(size=(2001, 4, 3)) * [1, 2, 3]
    got = root_mean_square(error)
    for seed in range(4):
        sigma = [np.sqrt(sum(e**2 for e in error[:, seed, i]) / 1999) for i in range(3)]
        assert_allclose(got[seed], [*sigma, np.sqrt(sum(s**2 for s in sigma))], rtol=1e-12)


@pytest.mark.parametrize(
    ("name", "median", "factor"),
    [("EKF", 2.1e6, 1.1), ("EKF with thrust", 62, 1.4), ("AREKF", 150, 1.5)],
)
def test_medians_of_variant_b(name, median, factor):
    """REPLICATION.md, part C, over 20 seeds; here over six."""
    got = rms_error(name, "B", range(6))
    assert got.shape == (6, 4)
    assert_allclose(got[:, 3], np.sqrt(np.sum(got[:, :3] ** 2, axis=1)), rtol=1e-12)
    assert median / factor < np.median(got[:, 3]) < median * factor


@pytest.mark.parametrize("name", ESTIMATORS)
def test_a_seed_gives_the_same_digits_in_any_company(name, short):
    alone, among = rms_error(name, "A", [7]), rms_error(name, "A", [1, 7, 2, 7])
    assert_array_equal(among[1], alone[0])
    assert_array_equal(among[3], alone[0])


def test_an_ekf_in_a_plain_loop(short):
    """One seed, second by second, with matrices from numpy.linalg."""
    setup = VARIANTS["A"]
    flight, sensor, orbit = truth(setup), setup.sensor, replace(setup.orbit(), substeps=1)
    v = np.random.default_rng(4).standard_normal((20, 2))
    x, P = setup.prior
    wanted = [x]
    for t in range(2000):
        x, F = orbit.transition(x)
        P = F @ P @ F.T + orbit.Q
        if (t + 1) % 100 == 0:
            z = sensor.h(flight.states[t + 1]) + setup.sigma * v[t // 100]
            H = sensor.jacobian(x)
            K = P @ H.T @ np.linalg.inv(H @ P @ H.T + sensor.R)
            x, P = x + K @ (z - sensor.h(x)), (np.eye(6) - K @ H) @ P
        wanted.append(x)
    wanted = flight.states[:, :3] - np.array(wanted)[:, :3]
    got = errors(EKF, setup, [4])
    assert_allclose(got[:, 0], wanted, rtol=0, atol=1e-3)
    assert_array_equal(errors(EKF, setup, [4], since=1500), got[1500:])
    assert_allclose(position_errors("EKF", "A", [4])[0], np.linalg.norm(got[:, 0], axis=1))
    assert_allclose(rms_error("EKF", "A", [4]), root_mean_square(got[-501:]))


def test_settings_and_tunings_are_batch_axes():
    """Two noises by three seeds, and three thresholds by three seeds, equal one at a time."""
    both = replace(SHORT, earth_noise=np.array([[0.02], [0.0]]), q_v=np.array([[2e-4], [2e-3]]))
    got = errors(EKF, both, range(3))
    one = errors(EKF, replace(SHORT, earth_noise=0.0, q_v=2e-3), [2])
    assert got.shape == (2001, 2, 3, 3)
    assert_array_equal(got[:, 1, 2], one[:, 0])
    alphas = np.array([[0.1], [0.2], [1.0]])
    got = errors(Filter(rule=AdaptiveRobust(alpha=alphas)), SHORT, range(3))
    one = errors(Filter(rule=AdaptiveRobust(alpha=1.0)), SHORT, [1])
    assert_array_equal(got[:, 2, 1], one[:, 0])


def test_half_second_steps_are_seen_at_whole_seconds():
    whole, half = (errors(EKF, replace(SHORT, step=s), [0]) for s in (1.0, 0.5))
    assert half.shape == whole.shape
    assert np.abs(whole[:100] - half[:100]).max() < 1e-5


def test_the_printed_euler_step_ruins_even_the_filter_that_knows_the_thrust():
    sharp = replace(SHORT, duration=4000, earth_noise=0.0)
    options = {"seeds": [0], "knows_thrust": True, "since": 3500}
    good, bad = (
        root_mean_square(errors(EKF, replace(sharp, integrator=i), **options))[0, 3]
        for i in ("rk4", "euler")
    )
    assert bad > 10 * good


@pytest.mark.parametrize("name", ESTIMATORS)
def test_an_interval_is_propagated_once_by_the_filter_and_once_for_its_seconds(name, monkeypatch):
    """Prediction, Jacobian and noise share one path."""
    setups = [replace(SHORT, duration=duration) for duration in (2000, 1000)]
    path, calls = Orbit._states, []

    def counted(self, *given):
        calls.append(1)
        return path(self, *given)

    monkeypatch.setattr(Orbit, "_states", counted)
    estimator = ESTIMATORS[name]
    options = {"knows_thrust": estimator.knows_thrust}
    spent = []
    for setup in setups:  # the difference leaves out what the checks before a run cost
        calls.clear()
        mean = fly(estimator.filter, setup, range(2), **options).mean
        spent.append(len(calls))
    assert spent[0] - spent[1] == 1000 // setup.interval
    calls.clear()
    errors_each_second(mean, setup, **options)
    assert len(calls) == 1  # all intervals at once


def test_the_table_stands_beside_the_papers(short, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm", None)  # as where it is not installed
    command.main(["--variant", "B", "--seeds", "2"])
    out, err = capsys.readouterr()
    assert out.startswith("variant B, 2 seeds\n")
    for name, estimator in ESTIMATORS.items():
        assert f"\n{name:17}median" in out
        assert np.isnan(estimator.paper[3]) or f"{estimator.paper[3]:.4g}" in out
    assert f"\r1/{len(ESTIMATORS)}" in err
    assert "sigma_p" in out.splitlines()[1]


def test_the_module_runs_as_a_command():
    command = [sys.executable, "-m", "navfilters.papers.xiong2009", "--seeds", "0"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "--seeds must be at least 1; found 0" in done.stderr


@pytest.mark.parametrize("name", ["UKF", "mtSOF"])
def test_any_moments_fly_the_orbit(name):
    """Told the thrust, each ends near the EKF; the error of the first estimate is another story."""
    prior, sensor, orbit = SHORT.prior, SHORT.sensor, SHORT.orbit(truth(SHORT).thrust)
    z = measurements(SHORT, range(3))
    options = {"dynamics": orbit, "z_per_step": True}
    mean = run(FILTERS[name], prior, z, sensor, **options).mean
    ekf = run(FILTERS["EKF"], prior, z, sensor, **options).mean
    assert np.isfinite(mean).all()
    true = truth(SHORT).states[::100, None, :3]
    ours, theirs = (np.linalg.norm(m[..., :3] - true, axis=-1)[-5:] for m in (mean, ekf))
    assert_allclose(ours, theirs, rtol=0.3, atol=100)


@pytest.mark.parametrize("form", ["joseph", "short"])
def test_the_arekf_goes_through_run_and_sweep_on_both_engines(form):
    arekf, setup = Filter(rule=AdaptiveRobust(), form=form), replace(SHORT, earth_noise=0.0)
    prior, sensor = setup.prior, setup.sensor
    z = measurements(setup, [1])[:12]  # to the end of the burn and 300 s more
    options = {"dynamics": setup.orbit(), "z_per_step": True}
    wanted = run(arekf, prior, z, sensor, record=lambda state: state, **options)
    assert wanted.memory.robust[-1] > 0
    for engine, rtol in (("numpy", 1e-12), ("jax", 1e-6)):
        got = sweep(arekf, prior, z, sensor, engine=engine, progress=False, **options).state
        assert_array_equal(got.memory.robust, wanted.memory.robust[-1])
        assert_allclose(got.estimate.mean, wanted.estimate.mean[-1], rtol=rtol)


@pytest.mark.parametrize("estimator", [EKF, Filter(rule=AdaptiveRobust()), CurrentNoise()])
def test_measurements_may_be_missing_through_the_burn(estimator):
    """Predicted alone, as an orbit that coasts; another run is not touched."""
    z = measurements(SHORT, range(2))
    z[7:9, 1] = np.nan
    options = {"dynamics": SHORT.orbit(), "z_per_step": True, "record": lambda state: state}
    states = run(estimator, SHORT.prior, z, SHORT.sensor, **options)
    whole = run(estimator, SHORT.prior, measurements(SHORT, range(2)), SHORT.sensor, **options)
    assert states.missed[-1].tolist() == [0, 2]
    assert_array_equal(states.estimate.mean[:, 0], whole.estimate.mean[:, 0])
    assert np.isnan(states.innovation[8:10, 1]).all()
    coasting = replace(SHORT.orbit(), substeps=200).f(states.estimate.mean[7, 1])
    assert_allclose(states.estimate.mean[9, 1], coasting, rtol=1e-12)
    assert np.isfinite(states.estimate.mean).all()
