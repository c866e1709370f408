"""Matching a small image, end to end and by parts; failures are results."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.ndimage import affine_transform

from navfilters.papers.pogorelsky2020.acquisition import _locate
from navfilters.sar.images.ground_image import GroundImage, to_ground
from navfilters.sar.matching.geolocation import geolocate
from navfilters.sar.matching.matcher import Matcher
from navfilters.sar.matching.reference import form_reference
from navfilters.space.frames import ecef_to_geodetic


@pytest.fixture(scope="module")
def ground(acquired):
    image = acquired.focuser.image(acquired.effective(acquired.speed), acquired.slope)
    return to_ground(image, incidence=acquired.incidence, ground_speed=acquired.ground_speed)


@pytest.mark.parametrize("relief", [True, False])
def test_centre_is_found_to_half_a_pixel(acquired, ground, relief):
    """Another pass, other speckle; a small image, a seventh of the experiment's."""
    match = geolocate(ground, acquired.reference, relief=relief)
    assert match.inliers >= 20
    miss = np.linalg.norm(match.r_f - acquired.r_f)
    assert miss < (5.0 if relief else 15.0)
    assert_allclose(ecef_to_geodetic(match.r_f), (match.latitude, match.longitude, match.height))
    place = acquired.scene.height(*acquired.scene.map.position(match.latitude, match.longitude))
    assert_allclose(match.height, place, atol=1e-3)


def test_same_answer_twice(acquired, ground):
    one, two = (geolocate(ground, acquired.reference) for _ in range(2))
    assert_array_equal(one.r_f, two.r_f)
    assert one.inliers == two.inliers


def test_affine_is_the_pass_s_rotation(acquired, ground):
    """Scale 1, and the angle from the flight's columns to the map's."""
    affine = geolocate(ground, acquired.reference).affine
    turn = np.arctan2(-affine[1, 0], affine[0, 0])
    heading = acquired.reference.view.heading - np.deg2rad(1.5)
    assert_allclose(turn, -heading, atol=0.01)
    assert_allclose(np.linalg.svd(affine[:, :2], compute_uv=False), 1.0, atol=0.02)


def test_turned_images_match_too(acquired, ground):
    """The features are invariant: an image turned by 90 degrees has the same centre."""
    columns = ground.values.shape[1]
    turned = GroundImage(
        np.rot90(ground.values).copy(), 10.0, (columns - 1 - ground.centre[1], ground.centre[0]),
        ground.incidence,
    )  # fmt: skip
    match = geolocate(turned, acquired.reference, relief=False)
    plain = geolocate(ground, acquired.reference, relief=False)
    assert np.linalg.norm(match.r_f - plain.r_f) < 8.0


@pytest.mark.parametrize("angle", [-8.0, 5.0, 30.0, 175.0, 180.0])
def test_images_turned_by_any_angle(acquired, ground, angle):
    """About the centre pixel: its place to half a pixel, and the affine turns with it."""
    cosine, sine = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
    turn, centre = np.array([[cosine, -sine], [sine, cosine]]), np.array(ground.centre)
    values = affine_transform(ground.values, turn, centre - turn @ centre, order=1, mode="nearest")
    match = geolocate(ground._replace(values=values), acquired.reference, relief=False)
    plain = geolocate(ground, acquired.reference, relief=False)
    assert np.linalg.norm(match.r_f - plain.r_f) < 5.0
    turned = [np.arctan2(-m.affine[1, 0], m.affine[0, 0]) for m in (match, plain)]
    assert_allclose(np.exp(1j * (turned[0] - turned[1])), cosine + 1j * sine, atol=0.02)


def test_a_campaign_keeps_no_memory(acquired, ground):
    """The highest use after ten more matches is that after three, to within one reference."""
    resource = pytest.importorskip("resource")

    def highest():
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024

    for _ in range(3):
        geolocate(ground, acquired.reference)
    before = highest()
    for _ in range(10):
        geolocate(ground, acquired.reference)
    assert highest() - before < 8 * acquired.reference.values.size


def test_no_match_is_a_result(acquired, ground):
    rng = np.random.default_rng(0)
    noise = ground._replace(values=rng.standard_normal(ground.values.shape).astype(np.float32))
    level = ground._replace(values=np.zeros_like(ground.values))
    for image in (noise, level):
        match = geolocate(image, acquired.reference)
        assert np.isnan(match.r_f).all()
        assert np.isnan([match.latitude, match.longitude, match.height, match.row]).all()
        assert match.affine is None
        assert match.inliers < 8


def test_inlier_rule(acquired, ground):
    found = geolocate(ground, acquired.reference).inliers
    for least, matched in ((found, True), (found + 1, False)):
        strict = replace(acquired.reference, matcher=Matcher(inliers=least))
        match = geolocate(ground, strict)
        assert match.inliers == found
        assert np.isfinite(match.r_f).all() == matched


def test_centre_outside_of_the_reference_is_refused(acquired, ground):
    match = geolocate(ground._replace(centre=(-5000, 0)), acquired.reference)
    assert np.isnan(match.r_f).all()
    assert match.inliers > 8


def test_pixels_must_agree(acquired, ground):
    with pytest.raises(ValueError, match="image must have pixels of 10"):
        geolocate(ground._replace(pixel=12.0), acquired.reference)


def test_reference_knows_the_ground_of_its_pixels(acquired):
    """Terrain, leaned towards the radar by its height, and back: to a centimetre."""
    reference = acquired.reference
    east, north = np.array([300.0, -700.0, 0.0]), np.array([-900.0, 50.0, 0.0])
    height = reference.scene.height(east, north)
    lean = (height - reference.scene.height(0.0, 0.0)) / np.tan(reference.view.incidence)
    away = reference.view.axes[1]
    column = 180 + (east - lean * away[0]) / 10
    row = 180 - (north - lean * away[1]) / 10
    latitude, longitude, found = reference.ground(column, row)
    assert_allclose(reference.scene.map.position(latitude, longitude), (east, north), atol=0.01)
    assert_allclose(found, height, atol=0.01)
    assert_allclose(reference.height(180, 180), 0.0, atol=1e-9)
    assert_allclose(reference.geodetic(180, 180), acquired.scene.map.geodetic(0.0, 0.0))


def test_speckle_differs_and_is_seeded(acquired):
    view, scene = acquired.reference.view, acquired.scene
    options = {"half_width": 300.0}
    one, same, other = (form_reference(scene, view, speckle=s, **options).values for s in (1, 1, 2))
    assert_array_equal(one, same)
    ratio = one - other
    assert_allclose(ratio.std(), 10 / np.log(10) * np.sqrt(2 * 0.1331), rtol=0.1)  # of 8 looks
    with pytest.raises(ValueError, match="looks must be a positive number"):
        form_reference(scene, view, looks=0.0)


def test_fit_is_exact_among_outliers():
    rng = np.random.default_rng(2)
    start = rng.uniform(0, 500, (60, 2))
    affine = np.array([[0.98, 0.17, 30.0], [-0.17, 0.98, 80.0]])
    end = start @ affine[:, :2].T + affine[:, 2]
    end[40:] = rng.uniform(0, 500, (20, 2))
    found, inliers = Matcher().fit(start, end)
    assert inliers >= 40
    assert_allclose(found, affine, atol=1e-3)


@pytest.mark.parametrize(
    "linear", [[[1.3, 0.0], [0.0, 1.0]], [[1.0, 0.0], [0.0, -1.0]], [[0.5, 0.0], [0.0, 0.5]]]
)
def test_stretched_or_mirrored_fits_are_refused(linear):
    start = np.random.default_rng(3).uniform(0, 500, (40, 2))
    found, inliers = Matcher().fit(start, start @ np.array(linear).T)
    assert found is None
    assert inliers >= 30


def test_pairs_are_those_of_opencv(acquired, ground):
    """To the last: its distances and ours are the same numbers."""
    cv2, matcher = pytest.importorskip("cv2"), Matcher(ratio=0.9)
    found, known = matcher.features(ground.values), acquired.reference.features
    two = cv2.BFMatcher(cv2.NORM_L2).knnMatch(found.descriptors, known.descriptors, k=2)
    good = [(a.queryIdx, a.trainIdx) for a, b in two if a.distance < 0.9 * b.distance]
    assert len(good) > 20
    assert_array_equal(np.transpose(matcher.pairs(found, known)), good)


@pytest.mark.parametrize("contrast", [0.03, 0.04, 0.1])
def test_features_of_more_contrast_are_those_of_a_higher_threshold(acquired, contrast):
    low = replace(acquired.reference, matcher=Matcher(contrast=0.01))
    again = replace(low, matcher=Matcher(contrast=contrast))
    kept = low.at_contrast(contrast)
    assert kept.matcher == again.matcher
    assert 0 < len(again.features.places) < len(low.features.places)
    for a, b in zip(kept.features, again.features, strict=True):
        assert_array_equal(a, b)


def test_too_few_pairs():
    assert Matcher().fit(np.zeros((7, 2)), np.zeros((7, 2))) == (None, 0)
    nothing = Matcher().features(np.zeros((30, 30)))
    assert len(nothing.above(0.1).places) == 0
    assert len(Matcher().pairs(nothing, nothing)[0]) == 0
    point = np.full((40, 2), 3.0)
    assert Matcher().fit(point, point)[0] is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"inliers": 2}, "inliers must be an integer of at least 3"),
        ({"ratio": 1.5}, "ratio must be above 0.0 and at most 1.0"),
        ({"tolerance": 0.0}, "tolerance must be above 0.0"),
        ({"stretch": 1.0}, "stretch must be above 1.0"),
        ({"sigma": np.nan}, "sigma must be above"),
    ],
)
def test_matcher_refuses(change, message):
    with pytest.raises(ValueError, match=message):
        Matcher(**change)


def test_opencv_is_asked_for_by_name(monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(ImportError, match=r"needs OpenCV: pip install navfilters\[sar\]"):
        Matcher().features(np.zeros((9, 9)))


def test_located_where_the_table_says(acquired, imaging):
    """The experiment's own path, a little out of focus."""
    match = _locate(acquired, acquired.speed + 10.0, imaging)
    assert np.linalg.norm(match.r_f - acquired.r_f) < 5.0


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_no_features_where_values_are_missing(value):
    """Cast to 8 bits they would be some grey."""
    image = np.random.default_rng(1).standard_normal((60, 60))
    image[3, 4:6] = value
    with pytest.raises(ValueError, match="values must be finite; found 2 that are not"):
        Matcher().features(image)
