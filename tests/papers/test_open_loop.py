"""Open-loop SAR navigation: the pass over Houston, its noise, and both test cases within bands."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from navfilters.estimators.multiplicative import MekfState, mekf_update
from navfilters.papers import pogorelsky2020
from navfilters.papers.pogorelsky2020 import __main__ as command
from navfilters.papers.pogorelsky2020.experiment import CASES, Setup
from navfilters.papers.pogorelsky2020.final_nees import final_nees, nees_line
from navfilters.papers.pogorelsky2020.linearised import FixedModel, linearised_flight
from navfilters.papers.pogorelsky2020.noise_draws import misalignment, noise
from navfilters.papers.pogorelsky2020.open_loop import (
    SimulatedImages,
    estimation_error,
    monte_carlo,
    simulate_images,
)
from navfilters.papers.pogorelsky2020.true_flight import _attitude, _circular, initial_state, truth
from navfilters.runs.consistency import mean_nees, sample_deviation
from navfilters.space.frames import ecef_to_geodetic, ellipsoid_intersection
from navfilters.space.image_measurement import Measurement
from navfilters.space.quaternions import rotation_vector

R0 = np.array([-1108465.150, -6100044.949, 3397134.666])
V0 = np.array([-1003.9419331, 3801.3289491, 6498.2536689])


@pytest.fixture(scope="module")
def results():
    return {case: monte_carlo(case) for case in CASES}


def boresight_hit(setup, k=0):
    flight = truth(setup, 5)
    model = replace(setup.geometry, T_e_b=flight.T_e_b[k])
    return ellipsoid_intersection(flight.x[k, :3], model.boresight(pogorelsky2020.NOMINAL))


def test_constants():
    for case, sigma_mu, beta in (("TC-1", 0.1, 0.2), ("TC-2", 0.01, 0.0)):
        setup = CASES[case]
        deviation = [1000] * 3 + [10] * 3 + [np.deg2rad(sigma_mu)] * 3
        assert_allclose(np.sqrt(np.diag(setup.P0)), deviation)
        assert_allclose(np.diag(setup.orbit.Q_psd), [3.5e-11] * 3 + [3.4e-13] * 3)
        assert_allclose(np.diag(setup.geometry.R), [0, 0, 1, 0.54**2])
        assert_allclose(np.linalg.eigvalsh(setup.geometry.D), [1, 4, 64])
        assert setup.underweighting == beta
        assert_allclose(setup.orbit.step, 0.8333, atol=1e-4)
        assert_allclose(setup.geometry.look, np.deg2rad(34.3))


def test_the_first_state():
    """Circular at 691.5 km, 98.16 degrees, ascending, the beam on Houston."""
    x = initial_state()
    assert_allclose(x[:3], R0, atol=1e-3)
    assert_allclose(x[3:], V0, atol=1e-6)
    r, v = x[:3], x[3:] + 7.292115e-5 * np.array([-x[1], x[0], 0])
    assert_allclose(np.linalg.norm(r), 6378137 + 691.5e3)
    assert_allclose(np.linalg.norm(v), np.sqrt(3.986004418e14 / 7069637))
    assert abs(r @ v) < 1e-3
    h = np.cross(r, v)
    assert_allclose(np.rad2deg(np.arccos(h[2] / np.linalg.norm(h))), 98.16)
    hit = boresight_hit(Setup())
    assert_allclose(ecef_to_geodetic(hit), [29.76, -95.37, 0], atol=1e-7)
    assert_allclose(np.linalg.norm(hit - r), 866060, atol=1)


@pytest.mark.parametrize("attitude", ["earth-fixed", "inertial", "constant rate"])
@pytest.mark.parametrize("ascending", [True, False])
@pytest.mark.parametrize("look", [34.3, -34.3])
def test_every_pass_sees_the_target(look, ascending, attitude):
    setup = Setup(look=look, ascending=ascending, attitude=attitude)
    assert_allclose(ecef_to_geodetic(boresight_hit(setup)), [29.76, -95.37, 0], atol=1e-7)
    x = truth(setup, 1).x[0]
    assert (x[5] > 0) == ascending
    passes_west = ecef_to_geodetic(x[:3])[1] < -95.37
    assert passes_west == ((look > 0) == ascending)


def test_images_are_57_km_apart_and_reach_canada():
    flight = truth()
    assert flight.times.shape == (73,)
    assert_allclose(flight.times[[0, 3, 72]], [0, 25, 600])
    hits = [boresight_hit(Setup(), k) for k in (1, 2)]
    assert_allclose(np.linalg.norm(hits[1] - hits[0]), 57e3, atol=1e3)
    model = replace(Setup().geometry, T_e_b=flight.T_e_b[-1])
    last = ellipsoid_intersection(flight.x[-1, :3], model.boresight(pogorelsky2020.NOMINAL))
    assert 60 < ecef_to_geodetic(last)[0] < 75
    assert truth() is flight


def test_the_truth_is_not_the_printed_integration():
    printed = truth(Setup(integrator="printed"), 72)
    assert_array_equal(printed.x, truth().x)


def test_attitude_definitions():
    """Yaw by the Earth's rotation between two; a constant rate that leaves the first of them."""
    fixed, inertial, constant = (
        truth(Setup(attitude=a), 72) for a in ("earth-fixed", "inertial", "constant rate")
    )
    assert_array_equal(constant.x, fixed.x)
    for each in (fixed, inertial, constant):
        assert_allclose(
            each.T_e_b @ each.T_e_b.mT, np.broadcast_to(np.eye(3), (73, 3, 3)), atol=1e-14
        )
    assert_allclose(constant.T_e_b[[0, 5]], fixed.T_e_b[[0, 5]], atol=1e-12)
    turns = Rotation.from_matrix(constant.T_e_b[1:] @ constant.T_e_b[:-1].mT).as_rotvec()
    assert_allclose(turns, np.broadcast_to(turns[0], turns.shape), atol=1e-12)
    v = inertial.x[:, 3:] + 7.292115e-5 * np.cross([0, 0, 1], inertial.x[:, :3])
    assert_allclose((inertial.T_e_b @ v[..., None])[:, 1], 0, atol=1e-8)
    assert_allclose((fixed.T_e_b @ fixed.x[:, 3:, None])[:, 1], 0, atol=1e-8)


@pytest.mark.parametrize(
    ("case", "predicted", "fell"),
    [("TC-1", [27, 745, 313], [97.3, 25.5]), ("TC-2", [14.8, 140, 59.5], [98.5, 86.0])],
)
def test_deviations_at_600_s(results, case, predicted, fell):
    result = results[case]
    spread = sample_deviation(result.errors[-1], result.covariances[-1], runs_axis=0)
    assert_allclose(spread.predicted[:3], predicted, rtol=0.03)
    assert_allclose(100 * (1 - spread.predicted[:2] / 1000), fell, atol=0.3)
    inside = (spread.low < spread.predicted) & (spread.predicted < spread.high)
    assert inside[:3].all()
    assert_allclose(result.times, np.arange(73) * 25 / 3)
    assert_array_equal(result.covariances, result.covariances.mT)


def test_only_the_second_case_is_consistent_by_nees(results):
    one, two = (
        mean_nees(results[c].errors[-1], results[c].covariances[-1], runs_axis=0)
        for c in ("TC-1", "TC-2")
    )
    assert 12 < one.mean < 20  # about 16
    assert two.low < two.mean < two.high


def test_rotation_about_the_boresight_is_not_seen(results):
    """The third misalignment keeps its prior and the small random walk."""
    for case, prior in (("TC-1", 0.1), ("TC-2", 0.01)):
        deviation = np.sqrt(np.diagonal(results[case].covariances, axis1=-2, axis2=-1))
        last = np.rad2deg(deviation[-1, :, 6:])
        assert_allclose(last[:, 2], prior, rtol=0.02)
        assert (last[:, 0] < 0.25 * prior).all()


def test_the_first_case_needs_the_underweighting_and_the_second_does_not(results):
    free = monte_carlo(replace(CASES["TC-1"], underweighting=0.0))
    spread = sample_deviation(free.errors[-1], free.covariances[-1], runs_axis=0)
    assert spread.predicted[1] < spread.low[1]  # y
    held = sample_deviation(
        results["TC-1"].errors[-1], results["TC-1"].covariances[-1], runs_axis=0
    )
    assert held.low[1] < held.predicted[1]


def test_the_curved_measurement_is_what_breaks_the_first_case():
    """With residuals that are linear in the error, about the estimate, the same filter passes."""
    images = simulate_images("TC-1", 60)

    def straight(state, told, model, **options):
        image, true = told
        _, H, R = model.linearize(state, image)
        error = estimation_error(true, state)
        y = model.linearize(true, image)[0] + (H @ error[..., None])[..., 0]
        return mekf_update(state, image, FixedModel(y, H, R), **options)

    result = monte_carlo("TC-1", runs=60, measure=images.with_truth, update=straight)
    total = mean_nees(result.errors[-1], result.covariances[-1], runs_axis=0)
    assert total.low < total.mean < total.high


def test_three_updates_and_a_coast():
    """8.33, 16.67 and 25 s, then to 41.67 s; the same first three as in the long flight."""
    few, many = monte_carlo("TC-1", 3, runs=4), monte_carlo("TC-1", 6, runs=4)
    assert_allclose(few.times, [0, 25 / 3, 50 / 3, 25, 125 / 3])
    assert_array_equal(few.errors[:4], many.errors[:4])
    assert_array_equal(few.covariances[:4], many.covariances[:4])
    assert few.innovations.shape == (3, 4, 4)
    grown = np.diagonal(few.covariances[4] - few.covariances[3], axis1=-2, axis2=-1)
    assert (grown[:, 6:] > 0).all()
    assert_allclose(grown[:, 6:], 3.4e-13 * 50 / 3, rtol=1e-3)


def test_first_errors_are_the_drawn_ones():
    result, drawn = monte_carlo("TC-2", 1, runs=3, seed=5), noise(3, 1, 5)
    assert_allclose(result.errors[0], np.sqrt(np.diag(CASES["TC-2"].P0)) * drawn.first, rtol=1e-6)
    assert_array_equal(result.covariances[0], np.broadcast_to(CASES["TC-2"].P0, (3, 9, 9)))


def test_a_run_gives_the_same_digits_in_any_company():
    among, alone = monte_carlo("TC-1", 4, runs=9), monte_carlo("TC-1", 4, runs=[7])
    for name in ("errors", "covariances", "innovations", "S"):
        assert_array_equal(getattr(among, name)[:, 7], getattr(alone, name)[:, 0])
    assert (monte_carlo("TC-1", 4, runs=[7], seed=1).errors != alone.errors).any()


def test_noise_depends_on_seed_and_run_only():
    long, short = noise([3, 5], 72, 1), noise(6, 5, 1)
    assert_array_equal(long.first[1], short.first[5])
    for a, b in zip(long[1:], short[1:], strict=True):
        assert_array_equal(a[0, :5], b[3])
    everything = np.concatenate([a.reshape(2, -1) for a in noise(2, 2000)], axis=1)
    assert_allclose(np.std(everything), 1, atol=0.02)
    assert abs(np.corrcoef(everything)[0, 1]) < 0.03


def test_simulated_images():
    """Pixel, range and speed scatter as D, 1 m and 0.54 m/s say, about the true antenna's beam."""
    setup, flight, drawn = Setup(), truth(Setup(), 5), noise(4000, 5)
    q = misalignment(setup, drawn.walk)
    seen = SimulatedImages(setup, flight, q, drawn)(3, None)
    model = replace(setup.geometry, T_e_b=flight.T_e_b[3])
    hit = ellipsoid_intersection(flight.x[3, :3], model.boresight(q[:, 3]))
    assert_allclose(np.cov((seen.r_f - hit).T), setup.geometry.D, atol=4)
    distance = np.linalg.norm(hit - flight.x[3, :3], axis=-1)
    assert_allclose(np.std(seen.slant_range - distance), 1, atol=0.05)
    assert_allclose(np.std(seen.speed), 0.54, atol=0.03)
    assert_allclose(np.mean(seen.speed), np.linalg.norm(flight.x[3, 3:]), atol=0.03)
    step = np.sqrt(3.4e-13 * 25 / 3)
    assert_allclose(np.std(rotation_vector(q[:, 3]), axis=0), np.sqrt(3) * step, rtol=0.05)
    assert_array_equal(misalignment(replace(setup, walk=False), drawn.walk)[:, 3], q[:, 0])


def test_a_plain_loop_over_one_run():
    """Update by update, propagated step by step, with an inverse of the scaled S."""
    setup, result = CASES["TC-1"], monte_carlo("TC-1", 12, runs=[2])
    flight, drawn = truth(setup, 12), noise([2], 12)
    q_true = misalignment(setup, drawn.walk)
    images, orbit = SimulatedImages(setup, flight, q_true, drawn), setup.orbit
    error = np.sqrt(np.diag(setup.P0)) * drawn.first[0]
    x, P = flight.x[0] - error[:6], setup.P0
    attitude = Rotation.from_rotvec(-error[6:])
    for k in range(1, 13):
        for _ in range(10):
            path = orbit.path(x, 1)
            F = orbit.transitions(path)[0]
            x, P = path[1], F @ P @ F.T + orbit.Q
        model = replace(setup.geometry, T_e_b=flight.T_e_b[k])
        prior = MekfState(x[:3], x[3:], attitude.as_quat(), P)
        y, H, R = (a[0] for a in model.linearize(prior, images(k, prior)))
        R = R + (0.2 if k <= 10 else 0.0) * H @ P @ H.T
        S = H @ P @ H.T + R
        scale = np.sqrt(np.diag(S))
        K = P @ H.T / scale @ np.linalg.inv(S / scale / scale[:, None]) / scale
        dx, A = K @ y, np.eye(9) - K @ H
        x, P = x + dx[:6], A @ P @ A.T + K @ R @ K.T
        attitude = attitude * Rotation.from_rotvec(dx[6:])
        assert_allclose(result.innovations[k - 1, 0] / scale, y / scale, atol=1e-6)
        assert_allclose(result.errors[k, 0, :6], flight.x[k] - x, rtol=1e-6, atol=1e-5)
        true = Rotation.from_quat(q_true[0, k])
        turned = (attitude.inv() * true).as_rotvec()
        assert_allclose(result.errors[k, 0, 6:], turned, rtol=0, atol=1e-10)
    deviation = np.sqrt(np.diag(P))
    assert_allclose(
        result.covariances[-1, 0] / deviation / deviation[:, None],
        P / deviation / deviation[:, None],
        atol=1e-5,
    )


def test_images_that_are_not_matched_leave_dead_reckoning():
    """Run 1 never sees; the others are not touched by it."""
    setup, drawn, flight = CASES["TC-1"], noise(3, 5), truth(Setup(), 5)
    images = SimulatedImages(setup, flight, misalignment(setup, drawn.walk), drawn)

    def lost(k, state):
        seen = images(k, state)
        blind = np.array([False, True, False])
        return Measurement(np.where(blind[:, None], np.nan, seen.r_f), *seen[1:])

    got, wanted = monte_carlo(setup, 5, 3, measure=lost), monte_carlo(setup, 5, 3)
    assert_array_equal(got.errors[:, [0, 2]], wanted.errors[:, [0, 2]])
    assert np.isnan(got.innovations[:, 1]).any(axis=-1).all()
    x = flight.x[0] - got.errors[0, 1, :6]
    x, P = setup.orbit.propagate(x, setup.P0, 50)
    assert_allclose(got.errors[-1, 1, :6], flight.x[5] - x, atol=1e-6)
    assert_allclose(got.covariances[-1, 1], P, rtol=1e-9, atol=1e-6)


def test_options_reach_the_filter():
    base = monte_carlo("TC-1", 3, 2)
    for change in (
        {"underweighting": 0.0},
        {"underweighted": 2},
        {"gamma": 1500.0},
        {"pixel": (8.0, 8.0, 8.0)},
        {"sigma_speed": 1.0},
        {"psd_v": 1e-4},
        {"integrator": "printed"},
        {"look": -34.3},
        {"ascending": False},
        {"attitude": "inertial"},
        {"squint": 2.0},
        {"walk": False},
    ):
        other = monte_carlo(replace(CASES["TC-1"], **change), 3, 2)
        assert (other.errors[1:] != base.errors[1:]).any(), change
    far = monte_carlo(replace(CASES["TC-1"], gamma=1e9), 3, 2)
    none = monte_carlo(replace(CASES["TC-1"], underweighting=0.0), 3, 2)
    assert_array_equal(far.errors, none.errors)


def test_the_target_is_met_by_another_solver():
    """Latitude and longitude of the hit, by differences of their own."""
    setup = Setup(inclination=80.0, look=20.0, target=(50.0, 10.0))

    def miss(angles):
        x = _circular(setup, *angles)
        model = replace(setup.geometry, T_e_b=_attitude(setup, x))
        hit = ellipsoid_intersection(x[:3], model.boresight(pogorelsky2020.NOMINAL))
        return np.array(ecef_to_geodetic(hit)[:2]) - setup.target

    found = root(miss, [0.9, -0.1], method="lm", options={"xtol": 1e-14})
    assert_allclose(initial_state(setup)[:3], _circular(setup, *found.x)[:3], atol=1e-2)


def test_the_table_stands_beside_the_papers(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm", None)  # as where it is not installed
    command.main(["--case", "TC-2", "--runs", "2"])
    out, err = capsys.readouterr()
    assert out.startswith("TC-2, 2 runs, 1-sigma position at 600 s\n")
    assert "138 m, 86.2 %" in out
    assert "NEES" in out
    assert "\r1/72" in err


def test_the_module_runs_as_a_command():
    command = [sys.executable, "-m", "navfilters.papers.pogorelsky2020", "--runs", "1"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "--runs must be at least 2 and --seed at least 0; found 1, 0" in done.stderr


REFUSED = {
    "case": (
        lambda: monte_carlo("TC-3"),
        r"case must be a Setup or one of \['TC-1', 'TC-2'\]; found 'TC-3'",
    ),
    "updates": (
        lambda: monte_carlo(updates=0),
        "updates must be an integer of at least 1; found 0",
    ),
    "runs: none": (lambda: monte_carlo(runs=0, updates=1), "runs must be at least one; found 0"),
    "runs: half": (lambda: noise([0.5]), r"runs and seed must be integers .*found \[0.5\] and 0"),
    "seed": (lambda: noise(1, seed=-1), "runs and seed must be integers .*found 1 and -1"),
    "intervals": (lambda: truth(Setup(), 0), "intervals must be an integer .*found 0"),
    "attitude": (lambda: Setup(attitude="LVLH"), "attitude must be one of .*found 'LVLH'"),
    "altitude": (lambda: Setup(altitude=-1.0), "altitude must be positive; found -1"),
    "interval": (lambda: Setup(interval=np.nan), "interval must be positive; found nan"),
    "steps": (lambda: Setup(steps=0), "steps must be an integer of at least 1; found 0"),
    "underweighted": (
        lambda: Setup(underweighted=-1),
        "underweighted must be an integer .*found -1",
    ),
    "sigma": (lambda: Setup(sigma_r=-1.0), "sigma_r must be a number of at least 0; found -1"),
    "pixel": (lambda: Setup(pixel=(1.0, 2.0)), "pixel must be three numbers .*found"),
    "gamma": (lambda: Setup(gamma=-1.0), "gamma must be None or at least 0 m; found -1"),
    "target": (
        lambda: initial_state(Setup(inclination=5.0)),
        "target must be seen from a circular orbit .*5.0 and 34.3 deg; found",
    ),
    "look": (lambda: initial_state(Setup(look=80.0)), "target must be seen .*80.0 deg; found"),
}


@pytest.mark.parametrize(("call", "message"), REFUSED.values(), ids=REFUSED)
def test_bad_input_is_refused_by_name(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_simulated_images_are_those_of_the_runs():
    """With the truth beside each of them."""
    setup, flight = CASES["TC-2"], truth(CASES["TC-2"], 5)
    images = simulate_images("TC-2", 3, 4, flight=flight)
    got = monte_carlo("TC-2", 2, 3, 4, flight=flight, measure=images)
    assert_array_equal(got.errors, monte_carlo("TC-2", 2, 3, 4, flight=flight).errors)
    drawn = noise(3, 5, 4)
    wanted = SimulatedImages(setup, flight, misalignment(setup, drawn.walk), drawn)(2, None)
    state = MekfState(np.zeros((3, 3)), np.zeros((3, 3)), images.q_mu[:, 0], np.eye(9))
    image, true = images.with_truth(2, state)
    assert_array_equal(image.r_f, wanted.r_f)
    assert_array_equal(true.r, flight.x[2, :3])
    assert_array_equal(true.q_mu, images.q_mu[:, 2])
    error = estimation_error(true, state)
    assert_array_equal(error[:, :6], np.broadcast_to(flight.x[2], (3, 6)))
    assert (np.abs(error[:, 6:]) < 1e-4).all()


def test_the_flight_linearised_is_the_filters_own_along_the_truth():
    """Its covariance is that of a run without errors, and its transitions carry small ones."""
    setup, flight = CASES["TC-1"], truth(CASES["TC-1"], 12)
    legs, P = linearised_flight(setup, flight, 12)
    perfect = replace(
        simulate_images(setup, 1, flight=flight), q_mu=np.tile([0, 0, 0, 1.0], (1, 13, 1))
    )
    zero = perfect.noise._replace(**{n: 0 * v for n, v in perfect.noise._asdict().items()})
    perfect = replace(perfect, noise=zero)
    state = MekfState(flight.x[0, :3], flight.x[0, 3:], perfect.q_mu[0, 0], setup.P0)
    for k, leg in enumerate(legs, start=1):
        x, before = setup.orbit.propagate(flight.x[k - 1], state.P, setup.steps)
        assert_allclose(leg.F @ state.P @ leg.F.T + leg.Q, before, rtol=1e-12, atol=1e-12)
        model = replace(setup.geometry, T_e_b=flight.T_e_b[k])
        b = 0.2 if k <= 10 else 0.0
        state = MekfState(x[:3], x[3:], perfect.q_mu[0, 0], before)
        assert_allclose(leg.extra, b * leg.H @ before @ leg.H.T)
        state = mekf_update(state, perfect(k, None), model, underweighting=b).state
        state = MekfState(flight.x[k, :3], flight.x[k, 3:], perfect.q_mu[0, 0], state.P[0])
    assert_allclose(P, state.P, rtol=1e-5, atol=1e-9)
    nudge = np.array([10.0, 0, 0, 0, 0, 0.1])
    moved = setup.orbit.path(flight.x[0] + nudge, setup.steps)[-1] - flight.x[1]
    assert_allclose(legs[0].F[:6, :6] @ nudge, moved, atol=1e-3)


@pytest.mark.parametrize("images", [0, 6])
def test_a_flight_is_linearised_as_far_as_it_goes(images):
    with pytest.raises(ValueError, match="images must be"):
        linearised_flight(Setup(), truth(Setup(), 5), images)


def test_nees_at_the_end_in_numbers_and_in_words(results):
    values = final_nees(results["TC-1"])
    assert values.shape == (100,)
    total = mean_nees(results["TC-1"].errors, results["TC-1"].covariances, runs_axis=1)
    assert_allclose(values.mean(), total.mean[-1])
    assert nees_line(np.array([1.0, 9.0, 9.0, 41.0])) == " 15.0 ± 15.1, median  9.0, 25.0 %"
