"""The ground: real heights where they belong, backscatter, shadow."""

import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.sar.ground.land_cover import COVER, LandCover, lambert, smooth_field
from navfilters.sar.ground.scene import Points, Scene, View, draw_scene
from navfilters.sar.ground.terrain import (
    LocalMap,
    Terrain,
    sample_posts,
    sample_terrain,
    terrain_hit,
)
from navfilters.space.frames import ecef_to_geodetic, geodetic_to_ecef

PLACE = (30.0, -95.0)
MAP = LocalMap(*PLACE)
SPACING = 1 / 1200


def terrain(shape, size=120):
    """Heights from a function of east and north, m."""
    k = (np.arange(size) - (size - 1) / 2) * SPACING
    north, east = np.meshgrid(k * MAP.metres[1], k * MAP.metres[0], indexing="ij")
    return Terrain(shape(east, north), PLACE[0] + k[0], PLACE[1] + k[0], SPACING)


def scene(shape):
    flat = LandCover(np.ones((3, 3), np.float32), 5000.0)
    none = np.zeros(0)
    return Scene(MAP, terrain(shape), flat, Points(none, none, none))


def test_map_is_metric_and_invertible():
    step = np.array([[100.0, 0.0], [0.0, 100.0]])
    p = geodetic_to_ecef(*MAP.geodetic(step[:, 0], step[:, 1]))
    assert_allclose(np.linalg.norm(p - geodetic_to_ecef(*PLACE), axis=1), 100.0, rtol=1e-6)
    assert_allclose(MAP.position(*MAP.geodetic(123.0, -456.0)), (123.0, -456.0), atol=1e-6)
    with pytest.raises(ValueError, match="latitude must be a number of at most 89"):
        LocalMap(90.0, 0.0)


def test_the_sample_tile():
    posts = sample_posts()
    assert posts.shape == (344, 403)
    assert (posts.min(), posts.max()) == (236, 1076)
    assert not posts.flags.writeable


def test_matplotlib_is_asked_for_by_name(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.cbook", None)
    with pytest.raises(ImportError, match="the sample terrain needs matplotlib"):
        sample_posts.__wrapped__()


@pytest.mark.parametrize("turns", [0, 1, 2, 3])
@pytest.mark.parametrize("mirrored", [False, True])
def test_tile_is_placed_mirrored_and_turned(turns, mirrored):
    """A point to the east of the middle goes to the west by mirroring, then round with the turn."""
    plain, moved = (
        sample_terrain(*PLACE),
        sample_terrain(*PLACE, quarter_turns=turns, mirrored=mirrored),
    )
    east, north = np.array([31.0, 12.0]) * SPACING
    x, y = (-east if mirrored else east), north
    for _ in range(turns):
        x, y = -y, x
    here = plain.height(PLACE[0] + north, PLACE[1] + east)
    assert_allclose(moved.height(PLACE[0] + y, PLACE[1] + x), here, atol=1e-6)


def test_heights_pass_through_posts_and_end_with_them():
    ground = sample_terrain(*PLACE)
    at = ground.height(ground.south + 7 * SPACING, ground.west + np.arange(9) * SPACING)
    assert_allclose(at, sample_posts()[7, :9], atol=1e-6)
    assert np.isnan(ground.height(ground.south - 1e-6, PLACE[1]))
    assert np.isnan(ground.height(PLACE[0], PLACE[1] + 1.0))


def test_posts_round_the_earth_know_every_longitude():
    posts = np.tile(np.r_[np.arange(19.0), np.arange(17.0, -1.0, -1.0)], (5, 1))
    globe = Terrain(posts, -20.0, 0.0, 10.0)
    for east, height in ((20, 2), (190, 17), (350, 1), (-10, 1), (-170, 17), (530, 17)):
        assert_allclose(globe.height(0.0, float(east)), height, atol=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"posts": np.zeros((3, 9))}, "posts must be at least 4 by 4"),
        ({"posts": np.full((4, 4), np.nan)}, "posts must be an array"),
        ({"spacing": 0.0}, "spacing must be a positive"),
    ],
)
def test_terrain_refuses(change, message):
    fields = {"posts": np.zeros((5, 5)), "south": 0.0, "west": 0.0, "spacing": 1.0}
    with pytest.raises(ValueError, match=message):
        Terrain(**(fields | change))


def test_hit_is_on_the_ray_and_on_the_ground(hit, flight):
    r = flight.position(0.0)
    latitude, longitude, _ = ecef_to_geodetic(hit)
    ground = sample_terrain(float(latitude), float(longitude))
    p = terrain_hit(ground.height, r, hit - r)
    place = ecef_to_geodetic(p)
    assert_allclose(ground.height(*place[:2]), place[2], atol=1e-3)
    assert np.linalg.norm(np.cross(p - r, hit - r)) / np.linalg.norm(hit - r) < 1e-3
    along = np.linspace(1.0, 2000.0, 400)[:, None]
    before = p + along * (r - p) / np.linalg.norm(r - p)
    *places, heights = ecef_to_geodetic(before)
    assert (heights > ground.height(*places)).all()


def test_hit_needs_terrain(hit, flight):
    r = flight.position(0.0)
    with pytest.raises(ValueError, match="direction must meet the ground where height is known"):
        terrain_hit(sample_terrain(0.0, 0.0).height, r, hit - r)
    with pytest.raises(ValueError, match="direction must reach the ground through air"):
        terrain_hit(lambda a, b: np.zeros_like(a) + 9000.0, r, hit - r, highest=100.0)
    assert_allclose(terrain_hit(lambda a, b: np.zeros_like(a) - 9.0, r, hit - r), hit)


def test_smooth_field_is_standard_and_smooth():
    field = smooth_field((512, 512), 4.0, np.random.default_rng(0))
    assert abs(field.mean()) < 0.1
    assert_allclose(field.std(), 1.0, atol=0.05)
    lag = np.mean(field[:, 4:] * field[:, :-4]) / field.var()
    assert_allclose(lag, np.exp(-1 / 4), atol=0.03)  # of two Gaussians of this width


def test_land_cover_has_all_classes_and_a_seed():
    cover = LandCover.draw(2000.0, 3)
    again, other = LandCover.draw(2000.0, 3), LandCover.draw(2000.0, 4)
    assert_array_equal(cover.reflectivity, again.reflectivity)
    assert (cover.reflectivity != other.reflectivity).mean() > 0.99
    level = 10 * np.log10(cover.reflectivity)
    for kind in COVER.values():
        assert (np.abs(level - kind.level) < 1.0).mean() > 0.01
    assert_allclose(cover.at(0.0 * np.ones(1), np.zeros(1)), cover.reflectivity[250, 250])
    with pytest.raises(ValueError, match="half_width must be a positive number"):
        LandCover.draw(0.0, 0)


def test_lambert():
    assert_allclose(lambert(np.cos(np.deg2rad(38.7))), 1.0, rtol=1e-3)
    assert lambert(-0.1) == 0
    assert (np.diff(lambert(np.linspace(0, 1, 9))) > 0).all()


ALONG, ACROSS = np.arange(-200, 201, 10.0), np.arange(-1500, 1501, 5.0)
FAR = View(0.3, np.deg2rad(38.7), np.inf)


def across_of(east, north):
    away = FAR.axes[1]
    return east * away[0] + north * away[1]


def test_level_ground_returns_its_area():
    power, height = scene(lambda e, n: 0 * e + 50).returns(FAR, ALONG, ACROSS)
    assert_allclose(power, 50.0, rtol=1e-3)
    assert_allclose(height, 50.0, atol=1e-3)


def test_slopes_follow_the_local_incidence():
    """A plane of slope s facing the radar: cos(theta - s)^2 / cos(theta)^2, on 1 / cos(s)."""
    slope = np.deg2rad(15)
    for sign in (-1, 1):
        ground = scene(lambda e, n, s=sign: s * np.tan(slope) * across_of(e, n) + 500)
        power, _ = ground.returns(FAR, ALONG, ACROSS)
        local = FAR.incidence - sign * slope
        expected = 50 * (np.cos(local) / np.cos(FAR.incidence)) ** 2 / np.cos(slope)
        assert_allclose(power[20, 300], expected, rtol=2e-3)


def test_incidence_grows_with_range():
    near = View(FAR.heading, FAR.incidence, 866e3)
    power, _ = scene(lambda e, n: 0 * e).returns(near, ALONG, ACROSS)
    theta = np.arctan2(near.slant_range * np.sin(near.incidence) + ACROSS,
                       near.slant_range * np.cos(near.incidence))  # fmt: skip
    assert_allclose(power[0] / 50, (np.cos(theta) / np.cos(near.incidence)) ** 2, rtol=1e-3)


@pytest.mark.parametrize("reach", [np.inf, 866e3])
def test_ridges_cast_shadow(reach):
    """Behind a ridge of 700 m ground is dark for the ridge's height times tan(incidence)."""
    ground = scene(lambda e, n: 700 * np.exp(-(((across_of(e, n) + 800) / 150) ** 2)))
    power, _ = ground.returns(View(FAR.heading, FAR.incidence, reach), ALONG, ACROSS)
    dark = ACROSS[power[20] == 0]
    end = -800 + 700 * np.tan(FAR.incidence)
    assert_allclose(dark.max(), end, atol=40)
    behind = power[20, end + 50 < ACROSS]
    assert (behind > 0).all()
    assert (power[20, ACROSS < -800] > 0).all()


def test_grid_must_stay_on_the_terrain():
    with pytest.raises(ValueError, match="along and across must stay on the terrain"):
        scene(lambda e, n: 0 * e).returns(FAR, ALONG * 100, ACROSS)


def test_drawn_scene_is_seeded():
    ground = sample_terrain(*PLACE)
    one, same, other = (
        draw_scene(ground, MAP, seed, half_width=1000.0) for seed in ([1, 2], [1, 2], [1, 3])
    )
    assert_array_equal(one.points.power, same.points.power)
    assert_array_equal(one.cover.reflectivity, same.cover.reflectivity)
    assert one.points.east[0] != other.points.east[0]
    assert len(one.points.east) == 20  # 5 in each of 4 square kilometres
    level = 10 * np.log10(one.points.power)
    assert (level >= 27).all()
    assert (level <= 41).all()
