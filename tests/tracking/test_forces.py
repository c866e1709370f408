"""Forces one by one, and orbits against Kepler's."""

from dataclasses import replace

import mpmath
import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from navfilters.tracking import Forces, Harmonics, Sky, density, orbit
from navfilters.tracking import forces as f

SUN, MOON = np.array([1.4e11, 3e10, 2e10]), np.array([-2e8, 3e8, 1e8])


def still_sky():
    row = np.concatenate([np.eye(3).ravel(), SUN, MOON])
    return Sky(CubicSpline([-1e3, 0, 1e5, 2e5], np.tile(row, (4, 1))), 2e5)


POINT = Forces(Harmonics(np.ones((1, 1)), np.zeros((1, 1))), still_sky(), sun=0.0, moon=0.0)


def kepler(a, e, t):
    """Position and velocity from perigee on, in the plane."""
    mu = POINT.gravity.mu
    M = np.sqrt(mu / a**3) * t
    E = brentq(lambda E: E - e * np.sin(E) - M, M - 1, M + 1, xtol=1e-15)
    r = a * (1 - e * np.cos(E))
    b = np.sqrt(1 - e * e)
    v = np.sqrt(mu * a) / r
    return [a * (np.cos(E) - e), a * b * np.sin(E), 0, -v * np.sin(E), v * b * np.cos(E), 0]


def test_a_point_mass_makes_an_ellipse():
    a, e = 2.4e7, 0.72
    times = np.array([100.0, 9000.0, 40000.0])
    flown = orbit(POINT, np.array(kepler(a, e, 0.0)), times)
    for state, t in zip(flown, times, strict=True):
        # Between its own steps, which take minutes, the rule interpolates to a centimetre.
        assert np.abs(state - kepler(a, e, t))[:3].max() < 0.02


def test_derivatives_pass_through_an_orbit():
    start = np.array(kepler(2.4e7, 0.72, 0.0))
    times = np.array([5000.0])
    slope = orbit(POINT, start + 1e-20j * np.eye(6), times)[:, 0].imag.T / 1e-20
    for j, h in enumerate([10.0] * 3 + [0.01] * 3):
        step = h * np.eye(6)[j]
        rise = (orbit(POINT, start + step, times) - orbit(POINT, start - step, times))[0] / (2 * h)
        assert np.abs(slope[:, j] - rise).max() < 1e-4 * np.abs(slope[:, j]).max()


def test_a_leak_moves_by_half_a_t_squared():
    far = np.array([1e12, 0, 0, 0, 0, 0])
    leaking = replace(POINT, leak=np.array([0, 1e-5, 0]), leak_rate=np.array([0, 0, 1e-9]))
    end = orbit(leaking, far, np.array([1e4]))[0]
    assert end[1] == pytest.approx(1e-5 * 1e8 / 2, rel=1e-6)
    assert end[2] == pytest.approx(1e-9 * 1e12 / 6, rel=1e-6)


def test_the_tide_is_the_difference_of_two_pulls():
    r = np.array([3e7, -1e7, 5e6])
    with mpmath.workdps(40):
        body, place = ([mpmath.mpf(float(x)) for x in v] for v in (SUN, r))
        away = [b - p for b, p in zip(body, place, strict=True)]
        pulls = [[x / mpmath.sqrt(sum(y * y for y in v)) ** 3 for x in v] for v in (away, body)]
        exact = [float(f.SUN * (p - q)) for p, q in zip(*pulls, strict=True)]
    assert np.abs(f.tide(r, SUN, f.SUN) - exact).max() < 1e-6 * np.abs(exact).max()


def test_density_falls_and_is_the_table_s_at_its_heights():
    assert density(np.array(200e3)) == pytest.approx(2.789e-10)
    assert density(np.array(500e3)) == pytest.approx(6.967e-13)
    heights = np.linspace(100e3, 1500e3, 500)
    assert (np.diff(density(heights)) < 0).all()
    assert (np.abs(np.diff(np.log(density(heights)))) < 0.6).all()


def test_drag_brakes_against_the_turning_air():
    r, axis = np.array([6.6e6, 0, 0]), np.array([0.0, 0, 1])
    turning = np.array([0, f.OMEGA * 6.6e6, 0])
    assert np.abs(f.drag(r, turning, axis)).max() < 1e-25
    fast = np.array([0, 7e3, 1e3]) + turning
    push = f.drag(r, fast, axis)
    rho = density(6.6e6 - f.RADIUS)
    assert np.abs(push - -rho / 2 * np.hypot(7e3, 1e3) * np.array([0, 7e3, 1e3])).max() < 1e-12


def test_drag_is_of_the_air_that_turns_with_the_earth():
    r, v = np.array([6.6e6, 1e5, 2e5]), np.array([-100.0, 7.5e3, 1e3])
    braked = replace(POINT, drag=0.02).acceleration(0.0, r, v) - POINT.acceleration(0.0, r, v)
    assert np.abs(braked - 0.02 * f.drag(r, v, np.array([0.0, 0, 1]))).max() < 1e-14


def test_light_pushes_away_from_the_sun_and_not_in_the_shadow():
    sun = np.array([f.UNIT, 0, 0])
    places = np.array([[7e6, 0, 0], [-7e6, 1e6, 0], [-7e6, 6.5e6, 0]])
    push = f.radiation(places, sun)
    assert push[0] == pytest.approx([-4.56e-6, 0, 0], rel=1e-3)
    assert not push[1].any()
    assert push[2, 0] == pytest.approx(-4.56e-6, rel=1e-3)


def test_members_may_have_other_forces():
    both = replace(POINT, sun=np.array([0.0, 1.0]), radiation=np.array([0.0, 0.01]))
    r, v = np.array([3e7, 0, 0]), np.array([0, 3e3, 0])
    a = both.acceleration(0.0, np.stack([r, r]), np.stack([v, v]))
    assert np.array_equal(a[0], POINT.acceleration(0.0, r, v))
    expected = f.tide(r, SUN, f.SUN) + 0.01 * f.radiation(r, SUN)
    assert np.abs(a[1] - a[0] - expected).max() < 1e-15


def test_an_orbit_that_cannot_be_integrated_is_an_error():
    with pytest.raises(ArithmeticError, match="could not be integrated"), np.errstate(all="ignore"):
        orbit(POINT, np.array([1.0, 0, 0, 0, 0, 0]), np.array([1e5]))
