"""Looks, decibels, and the projection to the ground."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.sar.images.ground_image import decibels, multilook, to_ground
from navfilters.sar.images.slant_image import Image
from navfilters.sar.raw.flight import view_of
from navfilters.space.frames import east_north_up, ecef_to_geodetic


def image_of(pixels):
    return Image(np.asarray(pixels, np.complex64), 0.0, 2150.0, 860e3, 4.684)


def test_multilook():
    z = np.random.default_rng(0).standard_normal((9, 7, 2)).astype(np.float32)
    z = z.view(np.complex64)[..., 0]
    got = multilook(image_of(z))
    assert got.shape == (2, 3)
    assert_allclose(got[1, 2], np.mean(np.abs(z[4:8, 4:6]) ** 2), rtol=1e-6)
    assert_allclose(multilook(image_of(z), 1, 1), np.abs(z) ** 2, rtol=1e-5)
    with pytest.raises(ValueError, match="azimuth must be at most 9"):
        multilook(image_of(z), 10, 1)
    with pytest.raises(ValueError, match="in_range must be an integer of at least 1"):
        multilook(image_of(z), 1, 0)


def test_decibels():
    assert_allclose(decibels([1.0, 10.0, 0.0]), [0.0, 10.0, 0.0])
    with pytest.raises(ValueError, match="power must be positive somewhere"):
        decibels(np.zeros(3))


@pytest.mark.parametrize(("line", "sample"), [(128, 64), (60, 100), (200, 21)])
def test_to_ground_puts_pixels_where_they_belong(flight, hit, line, sample):
    """A bright pixel, to the place at which a point on the ellipsoid has its time and range."""
    t, R = (float(a) for a in flight.closest(hit))
    dR, prf = 4.684, 2150.0
    pixels = np.full((256, 128), 0.1, np.complex64)
    pixels[line - 2 : line + 3, sample - 2 : sample + 3] = 10.0
    image = Image(pixels, t - 128 / prf, prf, R - 64 * dR, dR)
    view = view_of(flight, hit)
    p = flight.ground_point(t + (line - 128) / prf, R + (sample - 64) * dR, 0.0)
    place = [float(a) for a in ecef_to_geodetic(hit)]
    east, north, _ = east_north_up(*place[:2]) @ (p - hit)
    ahead, away = (axis @ [east, north] for axis in view.axes)
    ground = to_ground(image, incidence=view.incidence, ground_speed=6792.0, looks=(1, 1), pixel=5)
    weight = 10 ** (ground.values / 10)
    weight[weight < 1] = 0
    rows, columns = np.indices(weight.shape)
    row, column = (np.sum(a * weight) / weight.sum() for a in (rows, columns))
    # lines of equal time are not square to the flight on a turning Earth: a shear of 0.3 %
    assert_allclose((ground.centre[0] - row) * 5, ahead, atol=1.2)
    assert_allclose((column - ground.centre[1]) * 5, away, atol=0.6)


@pytest.mark.parametrize("looks", [(4, 2), (2, 1), (3, 5)])
def test_looks_do_not_shift(looks):
    """A symmetric bump about the centre pixel stays there."""
    i, j = np.indices((256, 128))
    bump = np.exp(-(((i - 128) / 40) ** 2) - ((j - 64) / 12) ** 2)
    ground = to_ground(image_of(bump), incidence=0.7, ground_speed=6800.0, looks=looks)
    row, column = ground.centre
    assert_array_equal(ground.values.shape, (2 * row + 1, 2 * column + 1))
    power = 10 ** (ground.values / 10)
    assert_allclose(np.sum(power.sum(axis=1) * (np.arange(2 * row + 1) - row)) / power.sum(), 0,
                    atol=0.06)  # fmt: skip
    assert_allclose(np.sum(power.sum(axis=0) * (np.arange(2 * column + 1) - column)) / power.sum(),
                    0, atol=0.06)  # fmt: skip


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"incidence": 0.0}, "incidence must be between 0 and pi/2"),
        ({"ground_speed": -1.0}, "ground_speed must be a positive"),
        ({"pixel": np.nan}, "pixel must be a positive"),
    ],
)
def test_to_ground_refuses(change, message):
    options = {"incidence": 0.7, "ground_speed": 6800.0} | change
    with pytest.raises(ValueError, match=message):
        to_ground(image_of(np.ones((16, 16))), **options)
