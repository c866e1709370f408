"""Axes and rays against pymap3d, by hand, and against the pass over Houston."""

import sys

import numpy as np
import pymap3d
import pymap3d.los
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.space.frames import (
    FLATTENING,
    SEMI_MAJOR,
    antenna_axes,
    body_axes,
    east_north_up,
    ecef_to_geodetic,
    ellipsoid_intersection,
    enu_covariance,
    geodetic_to_ecef,
)

POLAR = SEMI_MAJOR * (1 - FLATTENING)
R0 = np.array([-1108465.150, -6100044.949, 3397134.666])
V0 = np.array([-1003.9419331, 3801.3289491, 6498.2536689])
LOOK = np.deg2rad(34.3)
latitudes, longitudes = st.floats(-89, 89), st.floats(-180, 180)


def test_body_axes_by_hand():
    """Above the equator, flying north: down, east on the right hand, and forward."""
    T = body_axes(np.array([7e6, 0, 0]), np.array([5.0, 0, 7e3]))
    assert_allclose(T, [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], atol=1e-15)


@given(latitudes, longitudes, st.floats(0, 360), st.floats(-0.5, 0.5))
def test_body_axes_are_a_rotation(latitude, longitude, azimuth, climb):
    east, north, up = east_north_up(latitude, longitude)
    a = np.deg2rad(azimuth)
    v = np.sin(a) * east + np.cos(a) * north + climb * up
    T = body_axes(7e6 * up, 7e3 * v)
    assert_allclose(T @ T.T, np.eye(3), rtol=0, atol=1e-14)
    assert_allclose(np.linalg.det(T), 1, rtol=1e-14)
    assert_allclose(T[2], -up, rtol=0, atol=1e-15)
    assert_allclose(T[0], np.sin(a) * east + np.cos(a) * north, rtol=0, atol=1e-14)
    assert_allclose(T[1], np.cos(a) * east - np.sin(a) * north, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("look", "squint", "boresight"),
    [
        (0.0, 0.0, [0, 0, 1]),
        (np.pi / 2, 0.0, [0, 1, 0]),  # to the right
        (-np.pi / 2, 0.0, [0, -1, 0]),
        (0.0, np.pi / 2, [1, 0, 0]),  # forward
        (LOOK, 0.0, [0, np.sin(LOOK), np.cos(LOOK)]),
    ],
)
def test_antenna_axes(look, squint, boresight):
    T = antenna_axes(look, squint)
    assert_allclose(T[2], boresight, atol=1e-15)
    assert_allclose(T @ T.T, np.eye(3), atol=1e-15)
    assert_allclose(np.linalg.det(T), 1)


@given(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
def test_squint_is_the_angle_to_the_plane_across_the_path(look, squint):
    x, y, z = antenna_axes(look, squint)[2]
    assert_allclose(np.arcsin(x), squint, atol=1e-7)  # arcsin near 90 degrees
    assert_allclose(np.arctan2(y, z), look, atol=1e-12)


def test_the_boresight_meets_houston():
    """29.76 N 95.37 W, 866 060 m away, 38.7 degrees from the vertical."""
    T = antenna_axes(LOOK) @ body_axes(R0, V0)
    hit = ellipsoid_intersection(R0, T[2])
    latitude, longitude, height = ecef_to_geodetic(hit)
    assert_allclose([latitude, longitude, height], [29.76, -95.37, 0], atol=1e-7)
    assert_allclose(np.linalg.norm(hit - R0), 866060, atol=1)
    up = east_north_up(latitude, longitude)[2]
    assert_allclose(np.rad2deg(np.arccos(-T[2] @ up)), 38.7, atol=0.05)


@given(latitudes, longitudes, st.floats(1e3, 2e6), st.floats(0, 360), st.floats(0, 40))
def test_intersection_is_pymap3ds(latitude, longitude, height, azimuth, tilt):
    r = geodetic_to_ecef(latitude, longitude, height)
    east, north, up = east_north_up(latitude, longitude)
    a, t = np.deg2rad([azimuth, tilt])
    direction = np.sin(t) * (np.sin(a) * east + np.cos(a) * north) - np.cos(t) * up
    hit = ellipsoid_intersection(r, 3 * direction)
    on_map = pymap3d.los.lookAtSpheroid(latitude, longitude, height, azimuth, tilt)
    assert_allclose(hit, geodetic_to_ecef(*on_map[:2]), rtol=0, atol=1e-6 * max(1, height / 1e5))
    assert abs(ecef_to_geodetic(hit)[2]) < 1e-6
    assert np.linalg.norm(hit - r) < np.linalg.norm(r)  # the near side


def test_rays_may_share_a_start_or_a_direction():
    down = -R0 / np.linalg.norm(R0)
    starts = R0 * np.array([1.0, 1.1, 1.2])[:, None]
    hits = ellipsoid_intersection(starts, down)
    assert_allclose(hits, np.broadcast_to(hits[0], (3, 3)), atol=1e-8)
    tilted = down + np.array([[0.0, 0, 0], [0.1, 0, 0]])
    hits = ellipsoid_intersection(R0, tilted)
    for i in range(2):
        assert_array_equal(hits[i], ellipsoid_intersection(R0, tilted[i]))


def test_a_grazing_ray_keeps_its_digits():
    """One millimetre below the tangent, where the two roots nearly meet."""
    r, u = np.array([SEMI_MAJOR - 1e-3, -3e6, 0.0]), np.array([0.0, 1.0, 0.0])
    half = np.sqrt(SEMI_MAJOR**2 - r[0] ** 2)
    assert_allclose(ellipsoid_intersection(r, u), [r[0], -half, 0], atol=1e-4)


def test_nan_members_pass():
    down = -R0 / np.linalg.norm(R0)
    hits = ellipsoid_intersection(np.stack([R0, R0 * np.nan]), down)
    assert np.isfinite(hits[0]).all()
    assert np.isnan(hits[1]).all()


MISSES = {
    "equator": ([SEMI_MAJOR + 123.25, -3e6, 0], [0, 1, 0], "misses it by 123.25 m$"),
    "pole": ([1e6, 0, POLAR + 5000.0], [-1, 0, 0], "misses it by 5000 m$"),
    "away": ([SEMI_MAJOR + 7e5, 0, 0], [1, 0, 0], "misses it by 700000 m$"),
    "second": (
        [[SEMI_MAJOR + 7e5, 0, 0]] * 2,
        [[-1, 0, 0], [0, 1, 0]],
        "misses it by 700000 m at index",
    ),
    "below": ([SEMI_MAJOR - 2.5, 0, 0], [-1, 0, 0], "r must be outside .*below it by 2.5 m$"),
}


@pytest.mark.parametrize(("r", "direction", "message"), MISSES.values(), ids=MISSES)
def test_a_miss_says_by_how_much(r, direction, message):
    with pytest.raises(ValueError, match=message):
        ellipsoid_intersection(np.array(r, float), np.array(direction, float))


def test_a_miss_names_its_member():
    directions = np.zeros((2, 3, 3)) - np.array([1.0, 0, 0])
    directions[1, 0] = [0, 1, 0]
    with pytest.raises(ValueError, match=r"misses it by 1000 m at index \(1, 0\)$"):
        ellipsoid_intersection(np.array([SEMI_MAJOR + 1000, 0, 0]), directions)


@given(latitudes, longitudes)
def test_east_north_up_is_pymap3ds(latitude, longitude):
    T = east_north_up(latitude, longitude)
    origin = geodetic_to_ecef(latitude, longitude)
    for i, local in enumerate(np.eye(3)):
        there = np.array(pymap3d.enu2ecef(*(1e6 * local), latitude, longitude, 0))
        assert_allclose((there - origin) / 1e6, T[i], rtol=0, atol=1e-14)
    assert_allclose(T @ T.T, np.eye(3), rtol=0, atol=1e-15)


def test_enu_covariance():
    D = enu_covariance((2.0, 8.0, 1.0), 29.76, -95.37)
    T = east_north_up(29.76, -95.37)
    assert_allclose(T @ D @ T.T, np.diag([4, 64, 1]), atol=1e-13)
    assert_array_equal(D, D.T)


@given(latitudes, longitudes, st.floats(-1e4, 1e6))
def test_geodetic_coordinates_there_and_back(latitude, longitude, height):
    r = geodetic_to_ecef(latitude, longitude, height)
    N = SEMI_MAJOR / np.sqrt(1 - FLATTENING * (2 - FLATTENING) * np.sin(np.deg2rad(latitude)) ** 2)
    assert_allclose(np.hypot(r[0], r[1]), (N + height) * np.cos(np.deg2rad(latitude)), rtol=1e-14)
    assert_allclose(ecef_to_geodetic(r), [latitude, longitude, height], rtol=0, atol=1e-6)


def test_geodetic_batches():
    r = geodetic_to_ecef([10.0, 20.0], -95.0, np.array([[0.0], [5.0], [6.0]]))
    assert r.shape == (3, 2, 3)
    assert_allclose(ecef_to_geodetic(r)[2], [[0, 0], [5, 5], [6, 6]], atol=1e-8)


def test_without_pymap3d_it_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymap3d", None)
    with pytest.raises(ImportError, match=r"needs pymap3d: pip install navfilters\[sar\]"):
        geodetic_to_ecef(0.0, 0.0)
