"""The manoeuvre experiment: truth, noise, Table 1 within factors, and the information limit."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.estimators.extended import ExtendedKalman
from navfilters.estimators.robust import AdaptiveRobustEKF
from navfilters.papers.xiong2009 import __main__ as command
from navfilters.papers.xiong2009.cramer_rao import cramer_rao_bound
from navfilters.papers.xiong2009.experiment import ESTIMATORS, VARIANTS, Setup
from navfilters.papers.xiong2009.monte_carlo import (
    errors,
    noise,
    position_errors,
    rms_error,
    root_mean_square,
)
from navfilters.papers.xiong2009.true_flight import truth
from navfilters.space.gravity import EARTH
from navfilters.space.inertial_orbit import Orbit
from navfilters.space.osculating_ellipse import perigee_apogee

pytestmark = pytest.mark.slow

SHORT = Setup(duration=2000, window=500, burns=((700, 900),), thrust=0.45)


@pytest.fixture
def short(monkeypatch):
    """Every variant with a run of 2000 s, which burns once."""
    for name, setup in VARIANTS.items():
        few = replace(setup, duration=2000, window=500, burns=SHORT.burns, thrust=0.45)
        monkeypatch.setitem(VARIANTS, name, few)


def test_constants_of_section_5():
    setup = Setup()
    assert_allclose(setup.x0[:3], [6878137, 0, 0])
    assert_allclose(np.arctan2(setup.x0[5], setup.x0[4]), np.deg2rad(27))
    assert_allclose(setup.prior.mean, setup.x0 - ([5000] * 3 + [10] * 3))
    assert_array_equal(setup.prior.cov, np.diag([25e6] * 3 + [100] * 3))
    assert_allclose(setup.orbit().Q, np.diag([4e-10] * 3 + [4e-8] * 3))
    assert setup.orbit().substeps == 100
    arcseconds = {name: v.sigma * 648000 / np.pi for name, v in VARIANTS.items()}
    assert_allclose([arcseconds[v] for v in "ABC"], [72.17, 5, 72.17], atol=0.01)
    assert_allclose(VARIANTS["C"].orbit().Q[5, 5], (13 * 2e-4) ** 2)


def test_the_thrust_reaches_the_perigee():
    """2000 km when the last burn ends, by 0.45280 m/s^2; the apogee is then at 2682 km."""
    flight = truth()
    assert_allclose(flight.thrust.magnitude, 0.45280, atol=5e-6)
    low, high = perigee_apogee(flight.states[12068])
    assert_allclose(low, 2000e3, atol=1e-3)
    assert_allclose(high, 2682e3, atol=1e3)
    assert flight.states.shape == (20001, 6)
    assert truth(VARIANTS["B"]) is flight  # computed once


def test_the_truth_is_the_runge_kutta_path():
    """A second integrator at 1 s agrees to 1e-4 m through both burns."""
    flight = truth()
    path = Orbit(EARTH, flight.thrust, substeps=12200).interval(flight.states[0]).path
    error = np.abs(path - flight.states[1:12201])
    assert error[:, :3].max() < 1e-4
    assert error[:, 3:].max() < 1e-7


def test_without_burns_energy_and_momentum_are_kept():
    flight = truth(Setup(burns=()))
    r, v = flight.states[:, :3], flight.states[:, 3:]
    energy = np.sum(v * v, axis=1) / 2 - EARTH.potential(r)
    momentum = r[:, 0] * v[:, 1] - r[:, 1] * v[:, 0]
    assert flight.thrust.magnitude == 0
    assert_allclose(energy, energy[0], rtol=1e-11)
    assert_allclose(momentum, momentum[0], rtol=1e-11)


def test_noise_is_the_seeds_own():
    v = noise([5, 3])
    assert v.shape == (200, 2, 2)
    assert_array_equal(v[:, 1], np.random.default_rng(3).standard_normal((200, 2)))
    assert_array_equal(noise([3])[:, 0], v[:, 1])


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
        second = orbit.interval(x)
        x, P = second.path[0], second.F @ P @ second.F.T + orbit.Q
        if (t + 1) % 100 == 0:
            z = sensor.h(flight.states[t + 1]) + setup.sigma * v[t // 100]
            H = sensor.jacobian(x)
            K = P @ H.T @ np.linalg.inv(H @ P @ H.T + sensor.R)
            x, P = x + K @ (z - sensor.h(x)), (np.eye(6) - K @ H) @ P
        wanted.append(x)
    wanted = flight.states[:, :3] - np.array(wanted)[:, :3]
    got = errors(ExtendedKalman(), setup, [4])
    assert_allclose(got[:, 0], wanted, rtol=0, atol=1e-3)
    assert_array_equal(errors(ExtendedKalman(), setup, [4], since=1500), got[1500:])
    assert_allclose(position_errors("EKF", "A", [4])[0], np.linalg.norm(got[:, 0], axis=1))
    assert_allclose(rms_error("EKF", "A", [4]), root_mean_square(got[-501:]))


def test_settings_and_tunings_are_batch_axes():
    """Two noises by three seeds, and three thresholds by three seeds, equal one at a time."""
    both = replace(SHORT, earth_noise=np.array([[0.02], [0.0]]), q_v=np.array([[2e-4], [2e-3]]))
    got = errors(ExtendedKalman(), both, range(3))
    one = errors(ExtendedKalman(), replace(SHORT, earth_noise=0.0, q_v=2e-3), [2])
    assert got.shape == (2001, 2, 3, 3)
    assert_array_equal(got[:, 1, 2], one[:, 0])
    alphas = np.array([[0.1], [0.2], [1.0]])
    got = errors(AdaptiveRobustEKF(alpha=alphas), SHORT, range(3))
    one = errors(AdaptiveRobustEKF(alpha=1.0), SHORT, [1])
    assert_array_equal(got[:, 2, 1], one[:, 0])


def test_half_second_steps_are_seen_at_whole_seconds():
    whole, half = (errors(ExtendedKalman(), replace(SHORT, step=s), [0]) for s in (1.0, 0.5))
    assert half.shape == whole.shape
    assert np.abs(whole[:100] - half[:100]).max() < 1e-5


def test_the_printed_euler_step_ruins_even_the_filter_that_knows_the_thrust():
    sharp = replace(SHORT, duration=4000, earth_noise=0.0)
    options = {"seeds": [0], "knows_thrust": True, "since": 3500}
    good, bad = (
        root_mean_square(errors(ExtendedKalman(), replace(sharp, integrator=i), **options))[0, 3]
        for i in ("rk4", "euler")
    )
    assert bad > 10 * good


def test_information_limit():
    """650 m without process noise and 682 m with it at the measurement times (REPLICATION, C)."""
    rms = {}
    for noisy in (False, True):
        bound = cramer_rao_bound("A", process_noise=noisy)
        assert bound.shape == (20001, 3)
        at_updates = bound[18000::100]
        rms[noisy] = np.sqrt(np.mean(np.sum(at_updates**2, axis=1)))
        assert root_mean_square(bound[-2001:])[3] > rms[noisy]
    assert_allclose([rms[False], rms[True]], [650, 682], atol=1)


def test_information_limit_of_an_unknown_thrust():
    known = cramer_rao_bound("A", process_noise=False)
    unknown = cramer_rao_bound("A", thrust="unknown", process_noise=False)
    assert_allclose(unknown[:7201], known[:7201], rtol=1e-9)  # up to the first burn's interval
    limit = root_mean_square(unknown[-2001:])[3]
    assert_allclose(limit, 2006, atol=2)
    freer = cramer_rao_bound("A", thrust="unknown", process_noise=False, acceleration=45.0)
    assert limit < root_mean_square(freer[-2001:])[3] < 1.03 * limit


def test_information_recursion_is_that_of_inverses():
    """The same bound from J = (F J^-1 F^T + Q)^-1 + H^T R^-1 H, literally."""
    flight, sensor = truth(SHORT), SHORT.sensor
    orbit = SHORT.orbit(flight.thrust)
    J = np.linalg.inv(SHORT.prior.cov)
    for t in range(0, 2000, 100):
        interval = orbit.interval(flight.states[t], float(t))
        Q = interval.accumulate(orbit.Q, interval.start)
        H = sensor.jacobian(flight.states[t + 100])
        J = np.linalg.inv(interval.F @ np.linalg.inv(J) @ interval.F.T + Q)
        J = J + H.T @ np.linalg.inv(sensor.R) @ H
    wanted = np.sqrt(np.diag(np.linalg.inv(J))[:3])
    assert_allclose(cramer_rao_bound(SHORT)[-1], wanted, rtol=1e-5)


@pytest.mark.parametrize("thrust", ["known", "unknown"])
def test_the_bound_is_that_of_a_plain_loop_over_the_seconds(thrust):
    """At every second, not only at updates; the loop does not look at whole intervals."""
    flight, sensor = truth(SHORT), SHORT.sensor
    known = thrust == "known"
    orbit = SHORT.orbit(flight.thrust) if known else SHORT.orbit()
    step, a = replace(orbit, substeps=1), flight.thrust.magnitude
    P = np.zeros((9, 9))
    P[:6, :6] = SHORT.prior.cov
    wanted = [P]
    for t in range(2000):
        P = P.copy()
        if t % 100 == 0:
            P[6:], P[:, 6:] = 0, 0
            P[6:, 6:] = a**2 * np.eye(3)
        F = np.eye(9)
        F[:6, :6] = step.transitions(flight.states[t : t + 2], float(t))[0]
        if not known and 700 <= t < 900:
            F[:6, 6:] = np.concatenate([np.eye(3) / 2, np.eye(3)])
        P = F @ P @ F.T
        P[:6, :6] += orbit.Q
        if (t + 1) % 100 == 0:
            H = np.zeros((2, 9))
            H[:, :6] = sensor.jacobian(flight.states[t + 1])
            K = P @ H.T @ np.linalg.inv(H @ P @ H.T + sensor.R)
            P = P - K @ H @ P
        wanted.append(P)
    deviation = np.sqrt(np.diagonal(wanted, axis1=1, axis2=2)[:, :3])
    assert_allclose(cramer_rao_bound(SHORT, thrust=thrust), deviation, rtol=1e-7)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_an_interval_is_propagated_once(name, monkeypatch):
    """Prediction, Jacobian and noise share one path: four slopes for each second."""
    truth(SHORT)  # flown already, by another integrator
    slope, calls = Orbit.derivative, []

    def counted(self, *given, **options):
        calls.append(1)
        return slope(self, *given, **options)

    monkeypatch.setattr(Orbit, "derivative", counted)
    estimator = ESTIMATORS[name]
    errors(estimator.filter, SHORT, range(2), knows_thrust=estimator.knows_thrust)
    assert len(calls) == 4 * SHORT.duration


def test_the_table_stands_beside_the_papers(short, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm", None)  # as where it is not installed
    command.main(["--variant", "B", "--seeds", "2"])
    out, err = capsys.readouterr()
    assert out.startswith("variant B, 2 seeds\n")
    for name, estimator in ESTIMATORS.items():
        assert f"\n{name:17}median" in out
        assert np.isnan(estimator.paper[3]) or f"{estimator.paper[3]:.4g}" in out
    assert "\r1/20" in err
    assert "sigma_p" in out.splitlines()[1]


def test_the_module_runs_as_a_command():
    command = [sys.executable, "-m", "navfilters.papers.xiong2009", "--seeds", "0"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "--seeds must be at least 1; found 0" in done.stderr


REFUSED = {
    "filter": (lambda: rms_error("UKF"), r"filter_name must be one of .*'AREKF'.*found 'UKF'"),
    "variant": (lambda: rms_error("EKF", "D"), r"variant must be one of \['A', 'B', 'C'\]; found"),
    "no seeds": (lambda: rms_error("EKF", seeds=[]), "seeds must be .*found none"),
    "negative seed": (lambda: rms_error("EKF", seeds=[-1]), "seeds must be integers .*found"),
    "half a seed": (lambda: position_errors("EKF", seeds=[0.5]), "seeds must be integers"),
    "seeds: a number": (lambda: rms_error("EKF", seeds=3), "seeds must be integers .*found 3"),
    "bound's thrust": (lambda: cramer_rao_bound(thrust="no"), "thrust must be one of.*found 'no'"),
    "acceleration": (lambda: cramer_rao_bound(acceleration=-1.0), "acceleration must be .*-1"),
    "interval": (lambda: Setup(interval=300), "interval must divide duration; found 300"),
    "step": (lambda: Setup(step=2.0), "step must be a second or .*found 2"),
    "window": (lambda: Setup(window=30000), "window must be .*found 30000"),
    "perigee": (lambda: truth(replace(SHORT, thrust=None)), "perigee must be reached"),
    "thrust": (
        lambda: truth(replace(SHORT, thrust=-1.0)),
        "magnitude must be at least 0; found -1",
    ),
    "burns": (lambda: truth(Setup(burns=((0, 30000),))), "burns must be within"),
}


@pytest.mark.parametrize(("call", "message"), REFUSED.values(), ids=REFUSED)
def test_bad_input_is_refused_by_name(call, message):
    with pytest.raises(ValueError, match=message):
        call()
