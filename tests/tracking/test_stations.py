"""What stations measure, against a signal that is followed step by step."""

import numpy as np
import pytest
from scipy.optimize import brentq

from navfilters.tracking import Sites, delay, observe, refraction

EARTH = 7.292115e-5
LIGHT = 299792458.0
PLACE = np.array([4.0e6, 3.0e6, 3.9e6])
UP = PLACE / np.linalg.norm(PLACE)
EAST = np.cross([0, 0, 1], UP) / np.linalg.norm(np.cross([0, 0, 1], UP))
SITE = Sites(
    PLACE,
    EARTH * np.cross([0, 0, 1], PLACE),
    np.array([EAST, np.cross(UP, EAST), UP]),
    np.array(100.0),
)
STATE = np.array([1.5e7, 2.1e7, 1.1e7, -2500.0, 3100.0, 900.0])


def turned(t):
    c, s = np.cos(EARTH * t), np.sin(EARTH * t)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ PLACE


def test_a_range_is_half_the_way_of_a_signal():
    """Transit and emission by root finding; the satellite on its line, the station turning."""

    def way_down(tau):
        return np.linalg.norm(STATE[:3] - tau * STATE[3:] - turned(0.0)) - LIGHT * tau

    tau = brentq(way_down, 0.0, 1.0, xtol=1e-16)
    there = STATE[:3] - tau * STATE[3:]

    def way_up(sigma):
        return np.linalg.norm(there - turned(-tau - sigma)) - LIGHT * sigma

    sigma = brentq(way_up, 0.0, 1.0, xtol=1e-16)
    measured = observe(STATE, SITE, troposphere=False)
    assert measured[0] == pytest.approx(LIGHT * (tau + sigma) / 2, abs=1e-3)
    east, north, up = SITE.axes @ (there - PLACE)
    assert measured[1] == pytest.approx(np.arctan2(east, north), abs=1e-10)
    assert measured[2] == pytest.approx(np.arctan2(up, np.hypot(east, north)), abs=1e-10)


def test_the_air_adds_delay_and_refraction_and_leaves_azimuths():
    bare, seen = (observe(STATE, SITE, troposphere=air) for air in (False, True))
    assert seen[0] - bare[0] == pytest.approx(delay(bare[2], 100.0), abs=1e-6)
    assert seen[1] == bare[1]
    assert seen[2] - bare[2] == pytest.approx(refraction(bare[2], 100.0), abs=1e-12)


def test_delay_is_two_metres_overhead_and_grows_towards_the_horizon():
    assert delay(np.pi / 2, 0.0) == pytest.approx(2.4, abs=0.1)
    assert delay(np.pi / 2, 2000.0) < delay(np.pi / 2, 0.0)
    assert delay(np.radians(30), 0.0) == pytest.approx(2 * delay(np.pi / 2, 0.0), rel=0.01)
    assert 20 < delay(np.radians(5), 0.0) < 27


def test_refraction_is_half_a_degree_at_the_horizon_and_vanishes_overhead():
    assert np.degrees(refraction(0.0, 0.0)) == pytest.approx(1 / 1.728)
    elevations = np.radians(np.linspace(0, 90, 100))
    assert (np.diff(refraction(elevations, 500.0)) < 0).all()
    assert np.degrees(refraction(np.pi / 2, 0.0)) < 0.005
    assert refraction(0.1, 2000.0) < refraction(0.1, 0.0)
    # The refractivity of 315 parts in a million says 0.102 deg at 10 deg and 0.018 at 45; the
    # formula is made for low satellites and gives half of the latter.
    assert np.degrees(refraction(np.radians(10.0), 0.0)) == pytest.approx(0.102, rel=0.15)
    assert np.degrees(refraction(np.radians(45.0), 0.0)) == pytest.approx(0.0099, abs=1e-4)


def test_rows_of_sites_broadcast_with_states():
    sites = Sites(
        *(np.stack([a, a]) for a in (SITE.position, SITE.velocity, SITE.axes, SITE.height))
    )
    states = np.stack([STATE, STATE + 1e5])
    both = observe(states, sites)
    assert np.array_equal(both[0], observe(STATE, SITE))
    assert np.array_equal(both[1], observe(states[1], sites[1]))
    members = observe(np.stack([states, states]), sites)
    assert members.shape == (2, 2, 3)
    assert np.array_equal(members[1], both)
