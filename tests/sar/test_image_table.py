"""The table of an image over assumed speeds, beside formulas of its own."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.papers.pogorelsky2020.image_tables import assumed_speeds, image_table
from navfilters.space.earth_fixed_orbit import EARTH_RATE


@pytest.fixture(scope="module")
def few(imaging):
    return replace(imaging, near=2.0, reach=8.5, steps=(4.0, 3.0))


@pytest.fixture(scope="module")
def table(acquired, few):
    return image_table(acquired, few)


def test_the_effective_velocity_and_what_it_gains_by_the_speed(acquired, table):
    """V^2 = v.v + (r - r_f).a, in which a = ... - 2 w x v: the derivative along v by hand."""
    r, v, r_f, speed = acquired.r, acquired.v, acquired.r_f, np.linalg.norm(acquired.v)
    V = np.sqrt(v @ v + (r - r_f) @ acquired.acceleration(np.concatenate([r, v])))
    coriolis = -2 * np.cross([0, 0, EARTH_RATE], v / speed)
    assert_allclose(table.effective[0], V, rtol=1e-12)
    assert_allclose(table.effective[1], (2 * speed + (r - r_f) @ coriolis) / (2 * V), rtol=1e-7)
    assert table.effective[2] == acquired.slope


def test_speeds_are_close_near_the_truth_and_sparse_beyond(few, table):
    assert_array_equal(assumed_speeds(few), [-8, -5, -2, -1, 0, 1, 2, 5, 8])
    assert_allclose(table.speed, table.true_speed + assumed_speeds(few), rtol=0, atol=1e-9)


def test_it_was_matched_wherever_climbs_end(table, few):
    """From every start, to a quarter of a metre a second; no start ends where nothing is known."""
    starts = table.true_speed + np.arange(-8, 8, 0.25)
    climbs = table.climbs(starts, few.steps, np.zeros(len(starts)))
    ends = np.array([climb.speed for climb in climbs if climb.ended == "peak"])
    assert len(ends)
    assert np.abs(ends[:, None] - table.matched).min(axis=1).max() <= 0.125 + 1e-9
    assert_allclose((table.matched - table.true_speed) % 0.25, 0, atol=1e-9)
    assert (np.diff(table.matched) > 0.2).all()
    assert table.r_f.shape == (len(table.matched), 3)
    near = np.abs(table.matched - table.true_speed).argmin()
    assert np.linalg.norm(table.r_f[near] - table.truth) < 20.0
    assert table.inliers[near] > 0


def test_what_else_it_holds_is_the_scenes(acquired, table):
    middle = acquired.scene.map
    assert_array_equal(table.place[:2], [middle.latitude, middle.longitude])
    assert table.place[2] == acquired.scene.height(0.0, 0.0)
    assert_array_equal(table.truth, acquired.r_f)
    true = np.linalg.norm(acquired.r_f - acquired.r)
    assert_allclose(table.slant_range, true, rtol=0, atol=0.01)
