"""What a filter is given of real images: every run its own, and nothing where none matched."""

from types import SimpleNamespace

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.papers.pogorelsky2020 import real_images
from navfilters.sar.images.autofocusing import Climb
from navfilters.space.navigation_state import NavigationState


def test_each_run_focuses_from_its_own_speed(monkeypatch):
    """Of four runs one finds no peak and one no match; the others have their own range's error."""
    speeds = [7000.0, 7100.0, 7200.0, 7300.0]
    matched = [np.ones(3), None, np.full(3, np.nan), np.full(3, 4.0)]
    asked = []

    def formed(acquired, start, imaging):
        asked.append((acquired, start))
        r_f = matched[len(asked) - 1]
        ended = "limit" if r_f is None else "peak"
        match = None if r_f is None else SimpleNamespace(r_f=r_f)
        return Climb(start + 1.0, 1.0, ended, (start,)), match

    monkeypatch.setattr(real_images, "measure_directly", formed)
    patches = [SimpleNamespace(acquired=name, slant_range=8e5) for name in ("first", "second")]
    errors = np.arange(8.0).reshape(4, 2)
    images = real_images.RealImages(patches, errors)
    v = np.array(speeds)[:, None] * np.array([0.6, 0.0, -0.8])
    found = images(2, NavigationState(np.zeros((4, 3)), v, np.zeros((4, 4))))
    assert [name for name, _ in asked] == ["second"] * 4
    assert_allclose([start for _, start in asked], speeds)
    assert [attempt.matched for attempt in images.log] == [True, False, False, True]
    assert [(attempt.run, attempt.k) for attempt in images.log] == [(i, 2) for i in range(4)]
    nan = np.nan
    assert_array_equal(found.r_f, [[1.0] * 3, [nan] * 3, [nan] * 3, [4.0] * 3])
    assert_allclose(found.slant_range, [8e5 + 1, nan, nan, 8e5 + 7], rtol=1e-12)
    assert_allclose(found.speed, [7001.0, nan, nan, 7301.0])
