"""Blocks of an image, and loops whose runs have images of their own."""

from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal, assert_equal
from scipy.interpolate import CubicSpline

from navfilters.papers.pogorelsky2020 import (
    CASES,
    NOMINAL,
    BlockPlace,
    DifferentImages,
    Images,
    ImageTable,
    Imaging,
    OwnImages,
    acquire,
    block_curves,
    block_tables,
    campaign,
    campaign_report,
    cut_blocks,
    fly_own_images,
    match_blocks,
    monte_carlo,
    own_images,
    own_report,
    own_tables,
    read_own,
    truth,
    write_own,
)
from navfilters.papers.pogorelsky2020.image_blocks import _flight
from navfilters.papers.pogorelsky2020.pixel_errors import terrain_normal
from navfilters.sar.images.autofocusing import hill_climb, sharpness
from navfilters.sar.images.slant_image import Image
from navfilters.sar.raw.radar import Radar
from navfilters.space import ecef_to_geodetic, ellipsoid_intersection

SMALL = Imaging(
    radar=Radar(wavelength=0.059, pulse_length=4e-6), lines=1024, samples=256, half_width=1800.0
)


def image(lines=64, samples=48):
    pixels = np.arange(lines * samples).reshape(lines, samples) + 0j
    return Image(pixels, 2.0, 1000.0, 8e5, 5.0)


def test_blocks_know_where_they_are():
    blocks = cut_blocks(image(), 32, 16)
    assert len(blocks) == 6
    assert_allclose(blocks[4].first_time, 2.0 + 32 / 1000.0)
    assert_allclose(blocks[4].near_range, 8e5 + 16 * 5.0)
    assert_array_equal(blocks[4].pixels, image().pixels[32:, 16:32])


def test_what_is_left_over_is_cut_off_and_too_much_is_refused():
    assert len(cut_blocks(image(), 40, 30)) == 1
    with pytest.raises(ValueError, match="samples must be at most 48"):
        cut_blocks(image(), 32, 64)


@pytest.fixture(scope="module")
def acquired():
    return acquire(CASES["TC-1"], 1, SMALL)


def test_the_criteria_see_the_truth_and_the_matches_find_it(acquired):
    offset = np.array([-60.0, -30.0, 0.0, 30.0, 60.0])
    curves = block_curves(acquired, offset, 512, 256)
    assert curves.variance.shape == curves.entropy.shape == curves.drift.shape == (5, 2)
    assert (curves.variance.argmax(axis=0) == 2).all()
    assert (curves.entropy.argmin(axis=0) == 2).all()
    assert (np.abs(curves.drift[2]) < 15).all()
    matches = match_blocks(acquired, SMALL, 512, 256)
    assert (np.linalg.norm(matches.error, axis=1) < 15).all()
    tables = block_tables(acquired, curves, matches, "entropy")
    assert_allclose(tables[1].sharpness, -curves.entropy[:, 1])
    assert_allclose(tables[1].r_f[0] - tables[1].truth, matches.error[1])
    assert tables[0].climb(acquired.speed + 40, (20.0, 5.0)).ended == "peak"


def test_the_ground_passes_as_fast_as_the_place_of_a_block_says(acquired):
    """The next 10 m along the flight are closest so much later."""
    image = acquired.focuser.image(acquired.effective(acquired.speed), acquired.slope)
    place = BlockPlace.of(acquired, image, cut_blocks(image, 512, 256)[0])
    along = 10 * acquired.v / np.linalg.norm(acquired.v)
    t, _ = _flight(acquired).closest(np.stack([place.r_f, place.r_f + along]))
    assert_allclose(place.ground_speed, 10 / np.diff(t)[0], rtol=1e-4)


def test_other_terrain_is_other_ground(acquired):
    moved = acquire(CASES["TC-1"], 1, replace(SMALL, moved=(0.02, -0.01)))
    east, north = np.meshgrid(np.linspace(-500, 500, 5), np.linspace(-500, 500, 5))
    heights = [a.scene.height(east, north) for a in (acquired, moved)]
    assert np.std(heights[0] - heights[1]) > 5
    g = np.abs(moved.focuser.image(moved.effective(moved.speed), moved.slope).pixels) ** 2
    assert sharpness(g) > 1


def table(k, peak):
    """A curve with a peak so far from the truth; the pixel without an error."""
    known = truth(CASES["TC-1"], k)
    x = known.x[k]
    beam = replace(CASES["TC-1"].geometry, T_e_b=known.T_e_b[k]).boresight(NOMINAL)
    r_f = ellipsoid_intersection(x[:3], beam)
    true = float(np.linalg.norm(x[3:]))
    speed = true + np.arange(-80.0, 81.0, 2.0)
    return ImageTable(
        speed,
        -np.abs(speed - true - peak),
        np.array([true]),
        r_f[None],
        np.array([20]),
        float(np.linalg.norm(r_f - x[:3])),
        r_f,
        true,
        np.array([7181.9, 1.054, 0.0]),
        np.zeros(3),
    )


@pytest.mark.parametrize("steps", [(4.0, 1.0), (4.0, 0.3), (0.25,)])
def test_many_climbs_are_those_that_ask_point_by_point(steps):
    bumpy = table(1, 0.5)
    bumpy = bumpy._replace(sharpness=np.cos(bumpy.speed / 3) - np.abs(bumpy.speed - 7510) / 9)
    rng, curve = np.random.default_rng(0), CubicSpline(bumpy.speed, bumpy.sharpness)
    starts = bumpy.true_speed + rng.uniform(-90, 90, 40)
    offsets = rng.normal(0, 0.3, 40)
    for climb, start, o in zip(bumpy.climbs(starts, steps, offsets), starts, offsets, strict=True):
        limits = (bumpy.speed[0] - o, bumpy.speed[-1] - o)
        alone = hill_climb(lambda speed, o=o: float(curve(speed + o)), start, steps, limits)
        assert_equal(climb, alone)  # NaN is NaN


def test_runs_that_share_a_table_are_the_loop_of_before():
    setup = replace(CASES["TC-2"], walk=False)
    plain = Images(setup, 4, 0, SMALL, "predicted", lambda _setup, k, _imaging: table(k, 0.5))
    own = DifferentImages(setup, range(4), lambda k, i: table(k, 0.5), 0, SMALL)
    results = [monte_carlo(setup, 3, 4, 0, measure=m) for m in (plain, own)]
    assert_array_equal(results[1].errors, results[0].errors)
    assert_array_equal(own.log[2].speed, plain.log[2].speed)


def test_runs_that_share_a_table_go_together_as_they_do_alone():
    setup = replace(CASES["TC-2"], walk=False)
    sets = {(k, i): table(k, peak) for k in (1, 2, 3) for i, peak in enumerate((0.5, 3.0))}
    together = DifferentImages(setup, range(5), lambda k, i: sets[k, i % 2], 0, SMALL)
    alone = DifferentImages(setup, range(5), lambda k, i: sets[k, i % 2]._replace(), 0, SMALL)
    results = [monte_carlo(setup, 3, 5, 0, measure=m) for m in (together, alone)]
    assert_array_equal(results[1].errors, results[0].errors)
    for one, other in zip(together.log, alone.log, strict=True):
        assert_equal(one, other)


def test_each_run_has_its_own_set():
    tables = [[table(k, 0.0), table(k, 6.0)] for k in (1, 2, 3)]
    _, images = fly_own_images("TC-2", tables, 4)
    apart = np.median(images.log[2].speed[1::2]) - np.median(images.log[2].speed[::2])
    assert abs(apart - 6.0) < 2.5
    _, shared = fly_own_images("TC-2", tables, 4, shared=True)
    assert np.ptp(shared.log[2].speed) < 2.5


def own(*peaks):
    """A set of images for each peak, on level ground."""
    tables = [[table(k, peak) for peak in peaks] for k in (1, 2, 3)]
    up = np.array([[t.r_f[0] for t in of_k] for of_k in tables])
    return OwnImages(tables, tables, up / np.linalg.norm(up, axis=-1, keepdims=True))


def test_a_filter_is_told_another_covariance_of_the_pixel():
    found, D = own(0.0, 0.2), CASES["TC-2"].geometry.D
    usual, _ = fly_own_images("TC-2", found.variance, 4)
    told, _ = fly_own_images("TC-2", found.variance, 4, D=D)
    assert_allclose(told.errors, usual.errors, atol=1e-6)
    second = np.broadcast_to(D, (3, 2, 3, 3)).copy()
    second[:, 1] *= 100
    told, _ = fly_own_images("TC-2", found.variance, 4, D=second)
    more = np.linalg.det(told.covariances[3]) / np.linalg.det(usual.covariances[3])
    assert_allclose(more[::2], 1, rtol=1e-3)
    assert (more[1::2] > 10).all()


def test_the_report():
    lines = own_report(own(0.1, 0.2), 4).splitlines()
    assert len(lines) == 13
    assert lines[11].startswith("TC-2, entropy, own")
    assert lines[1].endswith(" 0")


def test_stored_sets_come_back(tmp_path):
    found = own(0.1, 0.2)
    found = found._replace(
        entropy=[[t._replace(sharpness=t.sharpness * 2) for t in of_k] for of_k in found.entropy]
    )
    write_own(tmp_path / "own.npz", found)
    again = read_own(tmp_path / "own.npz")
    assert_array_equal(again.axes, found.axes)
    assert_array_equal(again.entropy[2][1].sharpness, found.entropy[2][1].sharpness)
    assert_array_equal(again.variance[2][1].sharpness, found.variance[2][1].sharpness)
    assert again.variance[0][0].climb(7400.0, (4.0,)) == found.variance[0][0].climb(7400.0, (4.0,))
    with pytest.raises(ValueError, match="found none"):
        read_own(tmp_path / "other.npz")


def test_each_image_of_ones_own_has_the_normal_of_its_ground(monkeypatch):
    """A slope to the east leans to the west; images that cost nothing."""
    ground = SimpleNamespace(height=lambda latitude, longitude: 1e4 * np.asarray(longitude))
    scene = SimpleNamespace(terrain=ground)

    def sighting(k, imaging, lines, samples):
        return own_images.Sighting(SimpleNamespace(scene=scene), k, None)

    monkeypatch.setattr(own_images, "look_at", sighting)
    monkeypatch.setattr(
        own_images, "block_tables", lambda acquired, k, matches, by: [table(k, 0.0)]
    )
    found = own_tables(2, progress=lambda work: nullcontext(lambda done: None))
    assert [len(of_k) for of_k in found.entropy] == [2, 2, 2]
    for k, normals in enumerate(found.normal):
        latitude, longitude, _ = ecef_to_geodetic(found.variance[k][0].r_f[0])
        assert_array_equal(normals[0], normals[1])
        assert_allclose(normals[0], terrain_normal(ground, float(latitude), float(longitude)))


def test_the_errors_of_pixels_are_summed_up_by_their_squares():
    """Over all images and runs in which a pixel was matched."""
    errors = np.array([[[3.0, 0, 1], [np.nan] * 3], [[0, 2, 1], [6, 2, 1]]])
    found = SimpleNamespace(axes=np.broadcast_to(np.eye(3), (2, 2, 3, 3)), errors=errors)
    assert_allclose(own_images.measured_sigma(found), np.sqrt([15.0, 8 / 3, 1.0]))


def test_a_campaign_stores_each_image_of_a_direct_run_and_its_report(tmp_path, monkeypatch):
    """Tables and images that cost nothing: a second call makes none."""
    tables, made = [table(k, 0.5) for k in (1, 2, 3)], []

    def measured(k, start, imaging):
        made.append(k)
        return tables[k - 1].climb(start, imaging.steps), SimpleNamespace(r_f=tables[k - 1].r_f[0])

    monkeypatch.setattr(campaign, "_table", lambda store, k, done: tables[k - 1])
    monkeypatch.setattr(campaign, "acquire", lambda setup, k, imaging: k)
    monkeypatch.setattr(campaign, "measure_directly", measured)
    found = campaign.run_campaign(tmp_path, 3, 2, imaging=SMALL)
    assert made == [1, 1, 2, 2, 3, 3]
    assert (tmp_path / "summary.txt").read_text() == campaign_report(found)
    again = campaign.run_campaign(tmp_path, 3, 2, imaging=SMALL)
    assert made == [1, 1, 2, 2, 3, 3]
    assert campaign_report(again) == campaign_report(found)


def test_an_image_is_looked_at_alike_on_both_sides_of_its_velocity():
    assert_array_equal(own_images.OFFSETS, -own_images.OFFSETS[::-1])


@pytest.mark.slow
def test_the_stored_sets_are_what_the_library_computes(monkeypatch):
    """The first image of the first run, without the other two."""
    monkeypatch.setattr(own_images, "UPDATES", 1)
    (made,), kept = (
        own_tables(1, progress=lambda work: nullcontext(lambda done: None))[0],
        read_own(),
    )
    stored = kept.variance[0][0]
    assert_allclose(made[0].r_f, stored.r_f, atol=0.1)
    assert_allclose(made[0].sharpness, stored.sharpness, rtol=1e-3)
    assert kept.normal.shape == (3, len(kept.variance[0]), 3)
