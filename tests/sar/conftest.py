"""A short flight, and a radar whose aperture is a quarter of PALSAR's, so that images are small."""

from dataclasses import replace

import numpy as np
import pytest

from navfilters.papers.pogorelsky2020.acquisition import acquire
from navfilters.papers.pogorelsky2020.experiment import NOMINAL, Setup
from navfilters.papers.pogorelsky2020.imaging import Imaging
from navfilters.papers.pogorelsky2020.true_flight import truth
from navfilters.sar.ground.land_cover import LandCover
from navfilters.sar.ground.scene import Points, Scene
from navfilters.sar.ground.terrain import LocalMap, sample_terrain
from navfilters.sar.raw.flight import Flight
from navfilters.sar.raw.radar import Radar
from navfilters.space.frames import ellipsoid_intersection


@pytest.fixture(scope="session")
def setup():
    return Setup()


@pytest.fixture(scope="session")
def flight(setup):
    return Flight.through(setup.orbit.derivative, truth(setup, 1).x[1], 3.0)


@pytest.fixture(scope="session")
def hit(setup):
    """Where the boresight meets the ellipsoid at the epoch of the flight."""
    known = truth(setup, 1)
    beam = replace(setup.geometry, T_e_b=known.T_e_b[1]).boresight(NOMINAL)
    return ellipsoid_intersection(known.x[1, :3], beam)


@pytest.fixture(scope="session")
def small():
    """A quarter of PALSAR's wavelength and a seventh of its pulse; the same resolution."""
    return Radar(wavelength=0.059, pulse_length=4e-6)


@pytest.fixture(scope="session")
def imaging(small):
    return Imaging(radar=small, lines=768, samples=256, half_width=1800.0)


@pytest.fixture(scope="session")
def acquired(setup, imaging):
    """The first image of the closed loop, a tenth of its size."""
    return acquire(setup, 1, imaging)


@pytest.fixture(scope="module")
def tile():
    """Posts about a place near Houston."""
    return sample_terrain(30.0, -95.0)


@pytest.fixture(scope="module")
def scene(tile):
    """The scene there, of which nothing but the heights is used."""
    none = np.zeros(0)
    cover = LandCover(np.ones((1, 1)), 1.0)
    return Scene(LocalMap(30.0, -95.0), tile, cover, Points(none, none, none))
