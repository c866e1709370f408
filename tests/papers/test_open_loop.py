"""Open-loop SAR navigation: a plain loop, both test cases within bands, and what may change."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from navfilters.papers.pogorelsky2020.experiment import CASES, Setup
from navfilters.papers.pogorelsky2020.final_nees import final_nees, nees_line, nees_summary
from navfilters.papers.pogorelsky2020.noise_draws import misalignment, noise
from navfilters.papers.pogorelsky2020.open_loop import (
    SimulatedImages,
    monte_carlo,
)
from navfilters.papers.pogorelsky2020.true_flight import initial_state, truth
from navfilters.runs.consistency import mean_nees, sample_deviation
from navfilters.space.image_measurement import Measurement
from navfilters.space.navigation_state import NavigationState


@pytest.fixture(scope="module")
def results():
    return {case: monte_carlo(case) for case in CASES}


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
    assert_allclose(result.spread().sample[-1], spread.sample)
    assert result.spread(0.5).low.shape == (73, 9)
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
        seen = images(k, None)
        state = NavigationState(x[:3], x[3:], attitude.as_quat())
        H, R = (f(state, seen.r_f[0]) for f in (model.jacobian, model.noise))
        y = [0, 0, seen.slant_range[0], seen.speed[0]] - model.h(state, seen.r_f[0])
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


def test_nees_at_the_end_in_numbers_and_in_words(results):
    values = final_nees(results["TC-1"])
    assert values.shape == (100,)
    total = mean_nees(results["TC-1"].errors, results["TC-1"].covariances, runs_axis=1)
    assert_allclose(values.mean(), total.mean[-1])
    few = np.array([1.0, 9.0, 9.0, 41.0])
    assert_allclose(nees_summary(few), (15.0, 1.96 * np.std(few) / 2, 9.0, 25.0))
    assert nees_line(few) == " 15.0 ± 15.1, median  9.0, 25.0 %"


def test_a_flight_of_ones_own_is_flown():
    setup = replace(Setup(), shortest=2)
    own = truth(setup, 2)
    plain = monte_carlo(setup, 2, 3)
    assert_array_equal(monte_carlo(setup, 2, 3, flight=own).errors, plain.errors)
    with pytest.raises(ValueError, match="flight must last 3 intervals, one an update; found 2"):
        monte_carlo(setup, 3, 3, flight=own)
