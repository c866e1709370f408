"""Sharpness, and climbs that end where they should or say that they did not."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from navfilters.sar.images.autofocusing import autofocus, hill_climb, sharpness
from navfilters.sar.images.focuser import Focuser
from navfilters.sar.raw.echoes_of_points import point_echo
from navfilters.sar.raw.observation import centred_window
from navfilters.sar.raw.radar import receive


def test_sharpness_is_normalized_variance():
    g = np.random.default_rng(0).random((30, 40)).astype(np.float32)
    assert_allclose(sharpness(g), np.var(g) / np.mean(g) ** 2, rtol=1e-5)
    assert_allclose(sharpness(7 * g), sharpness(g), rtol=1e-5)


def test_sharpness_of_speckle_is_one():
    z = np.random.default_rng(1).standard_normal((400, 400, 2))
    assert_allclose(sharpness((z**2).sum(axis=-1)), 1.0, atol=0.02)
    with pytest.raises(ValueError, match="intensity must have a positive mean"):
        sharpness(np.zeros((2, 2)))


@pytest.mark.parametrize("start", [-31.3, -4.0, 0.2, 17.77])
@pytest.mark.parametrize("steps", [(4.0, 1.0), (1.0,), (8.0, 2.0, 0.5)])
def test_climb_ends_within_half_the_last_step(start, steps):
    climb = hill_climb(lambda v: -((v - 0.3) ** 2), start, steps)
    assert climb.ended == "peak"
    assert abs(climb.speed - 0.3) <= steps[-1] / 2 + 1e-9
    assert climb.path[0] == start
    assert climb.path[-1] == climb.speed


def test_coarse_steps_save_images():
    asked = []

    def curve(v):
        asked.append(v)
        return -abs(v - 0.2)

    hill_climb(curve, -30.0, (4.0, 1.0))
    assert len(asked) == len(set(asked)) < 20


def test_plateau():
    climb = hill_climb(lambda v: 1.0, 5.0)
    assert climb.ended == "plateau"
    assert np.isnan(climb.speed)
    assert climb.path == (5.0,)
    # one level side is no plateau: this is the edge of a peak
    assert hill_climb(lambda v: -max(v, 0.0), -0.5, (1.0,)).ended == "peak"


def test_local_maximum_is_where_it_stops():
    """Two peaks, 0 and the higher 20: the one uphill from the start is found."""

    def curve(v):
        return max(1 - abs(v) / 8, 2 - abs(v - 20) / 8)

    assert hill_climb(curve, -3.0).speed == 0.0
    assert hill_climb(curve, 13.0).speed == 20.0


@pytest.mark.parametrize("start", [3.0, 9.0, -30.0])
def test_climbs_that_leave_the_limits(start):
    climb = hill_climb(lambda v: v, start, (4.0, 1.0), (-10.0, 9.0))
    assert climb.ended == "limit"
    assert np.isnan(climb.speed)


@pytest.mark.parametrize("start", [8.0, -9.0, 10.0])
def test_a_coarse_step_beyond_a_limit_ends_nothing(start):
    assert hill_climb(lambda v: -((v - 8) ** 2), start, (4.0, 1.0), (-10.0, 10.0)).speed == 8.0


@pytest.mark.parametrize("peak", [-9.0, 8.0])
def test_a_peak_beside_a_limit_is_seen_by_asking_at_the_limit(peak):
    limits = (-10.0, 9.0)
    climb = hill_climb(lambda v: -((v - peak) ** 2), 0.0, (1.0,), limits)
    assert (climb.speed, climb.ended) == (peak, "peak")
    beyond = hill_climb(lambda v: v * np.sign(peak), 0.0, (1.0,), limits)
    assert beyond.path[-1] == limits[peak > 0]


def test_never_asks_beyond_the_limits():
    def curve(v):
        assert -10 <= v <= 9
        return v

    hill_climb(curve, 3.0, (4.0, 1.0), (-10.0, 9.0))


def test_nan_is_lowest():
    climb = hill_climb(lambda v: np.nan if v > 2 else -(v**2), 2.0, (1.0,))
    assert climb.speed == 0.0
    assert hill_climb(lambda v: np.nan, 0.0).ended == "plateau"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"steps": ()}, "steps must be positive"),
        ({"steps": (1.0, 0.0)}, "steps must be positive"),
        ({"limits": (1.0, 1.0)}, "limits must be in order"),
    ],
)
def test_climb_refuses(options, message):
    with pytest.raises(ValueError, match=message):
        hill_climb(lambda v: v, 0.0, **options)


@pytest.mark.parametrize("offset", [-60.0, -23.0, -8.5, 6.25, 31.0, 60.0])
def test_autofocus_recovers_a_velocity_offset(acquired, offset):
    """From either side to the truth, within the last step: the sharpest is not where it is true."""
    climb = autofocus(
        acquired.focuser,
        acquired.speed + offset,
        acquired.effective,
        steps=(8.0, 2.0),
        slope=acquired.slope,
    )
    assert climb.ended == "peak"
    assert abs(climb.speed - acquired.speed) <= 2.0
    assert len(climb.path) >= abs(offset) / 8


@pytest.mark.parametrize("offset", [-60.0, -8.5, 31.0])
def test_a_patch_climbs_to_the_same_peak(acquired, offset):
    """On half of the ranges, straightened for a velocity that is off, within a step."""
    start = acquired.speed + offset
    options = {"steps": (8.0, 2.0), "slope": acquired.slope}
    patch = acquired.focuser.patch(128, acquired.effective(start))
    ends = [
        autofocus(focuser, start, acquired.effective, **options)
        for focuser in (acquired.focuser, patch)
    ]
    assert [climb.ended for climb in ends] == ["peak", "peak"]
    assert abs(ends[1].speed - ends[0].speed) <= 2.0


def test_a_constant_phase_changes_nothing(small, flight, hit):
    window = centred_window(small, flight, hit, 96, 32)
    echo = point_echo(small, flight, hit, window)
    climbs = [
        autofocus(
            Focuser(receive(small, window, echo * turn), lines=96, samples=32),
            7181.91 + 61.0,
            lambda v: v,
            steps=(16.0, 4.0),
        )
        for turn in (1.0, np.exp(0.7j))
    ]
    assert climbs[1].path == climbs[0].path
    assert_allclose(climbs[1].value, climbs[0].value, rtol=1e-5)


@pytest.mark.parametrize("start", [-83.0, 61.0])
def test_autofocus_finds_the_velocity_of_a_point(small, flight, hit, start):
    """A quarter of the wavelength, a quarter of the sensitivity: hence the longer steps."""
    window = centred_window(small, flight, hit, 96, 32)
    focuser = Focuser(
        receive(small, window, point_echo(small, flight, hit, window)), lines=96, samples=32
    )
    climb = autofocus(focuser, 7181.91 + start, lambda v: v, steps=(16.0, 4.0))
    assert climb.ended == "peak"
    assert abs(climb.speed - 7181.91) < 2.5
