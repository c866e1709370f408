"""Errors of a matched pixel on a slope."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from navfilters.papers.pogorelsky2020 import (
    image_axes,
    pixel_covariance,
    terrain_normal,
)
from navfilters.sar.ground.terrain import LocalMap, Terrain
from navfilters.space.frames import east_north_up

PLACE = (30.0, -95.0)


def tilted(to_east, to_north):
    """A plane through the place, which rises by so much for a metre."""
    spacing, n = 1 / 1200, 41  # the spline bends at the ends
    around = (np.arange(n) - n // 2) * spacing
    grid = np.meshgrid(PLACE[0] + around, PLACE[1] + around, indexing="ij")
    east, north = LocalMap(*PLACE).position(*grid)
    posts = 300.0 + to_east * east + to_north * north
    return Terrain(posts, PLACE[0] + around[0], PLACE[1] + around[0], spacing)


def seen(incidence, slope):
    """Axes of a radar that looks to the east, on ground that rises away from it."""
    sight = np.array([np.sin(incidence), 0.0, -np.cos(incidence)])
    normal = np.array([-np.tan(slope), 0.0, 1.0])
    return image_axes(np.zeros(3), -8e5 * sight, np.array([0.0, 7e3, 0.0]), normal)


def test_the_normal_stands_on_the_ground():
    level = terrain_normal(tilted(0.0, 0.0), *PLACE)
    assert_allclose(level, east_north_up(*PLACE)[2], atol=1e-12)
    east, north, up = east_north_up(*PLACE) @ terrain_normal(tilted(0.3, -0.1), *PLACE)
    assert_allclose([east / up, north / up], [-0.3, 0.1], atol=2e-3)
    assert np.isnan(terrain_normal(tilted(0.0, 0.0), PLACE[0] + 1, PLACE[1])).all()


@pytest.mark.parametrize("slope", [-20.0, 0.0, 15.0, 33.0, 50.0])
def test_a_slope_that_faces_the_radar_spreads_the_error(slope):
    """Along the ground a metre of distance is 1 / sin(incidence - slope) metres."""
    incidence, slope = np.deg2rad(38.7), np.deg2rad(slope)
    D = pixel_covariance(seen(incidence, slope), [1.0, 0.0, 0.0])
    uphill = np.array([np.cos(slope), 0.0, np.sin(slope)])
    assert_allclose(D, np.outer(uphill, uphill) / np.sin(incidence - slope) ** 2, atol=1e-12)


def test_the_covariance_is_that_of_errors_drawn_in_the_image():
    """Points that are displaced along the ground until their distance and time are as drawn."""
    incidence, slope = np.deg2rad(38.7), np.deg2rad(25.0)
    axes = seen(incidence, slope)
    drawn = np.random.default_rng(0).standard_normal((20000, 2)) * [1.2, 0.7]
    sight = np.array([np.sin(incidence), -np.cos(incidence)])
    along_ground = np.array([np.cos(slope), np.sin(slope)])
    across = drawn[:, :1] / (along_ground @ sight) * along_ground
    found = np.cov(np.column_stack([across[:, 0], drawn[:, 1], across[:, 1]]).T)
    assert_allclose(pixel_covariance(axes, [1.2, 0.7, 0.0]), found, rtol=0.05, atol=0.05)


def test_what_is_no_deviation_is_refused():
    for sigma in ([1.0, -1.0, 0.0], [1.0, 1.0]):
        with pytest.raises(ValueError, match="sigma must"):
            pixel_covariance(np.eye(3), sigma)
