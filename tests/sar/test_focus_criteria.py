"""Entropy of images: its two ends, its scale, and what it makes of a point."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import entropy

from navfilters.sar.images.autofocusing import autofocus
from navfilters.sar.images.focus_criteria import image_entropy
from navfilters.sar.images.focuser import Focuser
from navfilters.sar.raw.echoes_of_points import point_echo
from navfilters.sar.raw.observation import centred_window
from navfilters.sar.raw.radar import receive


def test_against_scipy():
    g = np.random.default_rng(0).random((30, 40)).astype(np.float32)
    assert_allclose(image_entropy(g), entropy(g.ravel().astype(float)), rtol=1e-6)
    assert_allclose(image_entropy(7e9 * g), image_entropy(g), rtol=1e-6)


def test_the_two_ends():
    level, point = np.ones((8, 5)), np.zeros((8, 5))
    point[3, 2] = 4.0
    assert_allclose(image_entropy(level), np.log(40))
    assert_allclose(image_entropy(point), 0.0, atol=1e-12)


def test_refuses_darkness():
    with pytest.raises(ValueError, match="intensity must have a positive mean"):
        image_entropy(np.zeros((2, 2)))


def test_autofocus_climbs_on_what_it_is_given(small, flight, hit):
    """Entropy, from both sides, to the velocity of a point."""
    window = centred_window(small, flight, hit, 96, 32)
    focuser = Focuser(
        receive(small, window, point_echo(small, flight, hit, window)), lines=96, samples=32
    )
    for start in (-83.0, 61.0):
        climb = autofocus(
            focuser,
            7181.91 + start,
            lambda v: v,
            steps=(16.0, 4.0),
            criterion=lambda g: -image_entropy(g),
        )
        assert climb.ended == "peak"
        assert abs(climb.speed - 7181.91) < 2.5
