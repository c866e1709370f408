"""A reference image, power by power and beyond its edges."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from navfilters.sar.ground.land_cover import LandCover
from navfilters.sar.ground.scene import Points, Scene, View
from navfilters.sar.ground.terrain import LocalMap, Terrain
from navfilters.sar.matching.reference import _add, form_reference


def test_power_is_shared_among_the_four_nearest_pixels():
    """Beside a loop that gives each pixel the product of two hats; outside, nothing is left."""
    rng = np.random.default_rng(0)
    n, points = 7, 400
    column, row = rng.uniform(-1.5, n + 0.5, (2, points))
    power = rng.uniform(0.5, 2.0, points)
    got, wanted = np.zeros(n * n, np.float32), np.zeros((n, n))
    _add(got, n, column, row, power)
    for x, y, p in zip(column, row, power, strict=True):
        if 0 <= x < n - 1 and 0 <= y < n - 1:
            hats = [np.maximum(0, 1 - np.abs(np.arange(n) - at)) for at in (x, y)]
            wanted += p * np.outer(hats[1], hats[0])
    assert_allclose(got.reshape(n, n), wanted, rtol=1e-5)
    within = (column >= 0) & (column < n - 1) & (row >= 0) & (row < n - 1)
    assert 100 < within.sum() < points
    assert_allclose(got.sum(), power[within].sum(), rtol=1e-5)


def test_a_small_reference_is_the_middle_of_a_large_one(acquired):
    """With nearly no speckle. What lies beyond the edges is in both, and so is ground that relief
    brings in; only the outermost ring of pixels lacks the shares of facets just outside.
    """
    view, scene = acquired.reference.view, acquired.scene
    small, large = (
        form_reference(scene, view, half_width=w, looks=1e12).values for w in (300.0, 900.0)
    )
    assert small.shape == (61, 61)
    assert large.shape == (181, 181)
    assert_allclose(small[1:-1, 1:-1], large[61:120, 61:120], atol=1e-3)


def test_what_lies_on_the_last_row_or_column_has_no_four_neighbours():
    """And is left out; on the first ones, it is in its pixel alone."""
    got = np.zeros(9, np.float32)
    places = np.array([[2.0, 1.0], [1.0, 2.0], [2.0, 2.0], [0.0, 1.0], [1.0, 0.0], [0.0, 0.0]])
    _add(got, 3, *places.T, 2.0 ** np.arange(6))
    assert_allclose(got.reshape(3, 3), [[32, 16, 0], [8, 0, 0], [0, 0, 0]])


@pytest.mark.parametrize("around", [-390.0, 390.0])
def test_relief_of_almost_400_m_is_brought_in_from_beyond_the_edge(around):
    """A shaft, and a tower, in a plain: from where the small image ends to 465 m beyond, the plain
    is shown within it. Its edges are as the large one's, to the last ring of pixels.
    """
    spacing, none = 3e-4, np.zeros(0)
    out = np.hypot(*np.meshgrid(np.arange(-99, 100), np.arange(-99, 100))) * 30.0
    posts = around * (1 - np.exp(-((out / 120.0) ** 2)))
    terrain = Terrain(posts, 30.0 - 99 * spacing, -95.0 - 99 * spacing, spacing)
    cover = LandCover(np.ones((1, 1)), 1.0)
    scene = Scene(LocalMap(30.0, -95.0), terrain, cover, Points(none, none, none))
    view = View(np.deg2rad(350.0), np.deg2rad(40.0), np.inf)
    small, large = (
        form_reference(scene, view, half_width=w, looks=1e12).values for w in (300.0, 900.0)
    )
    assert_allclose(small[1:-1, 1:-1], large[61:120, 61:120], atol=1e-3)
