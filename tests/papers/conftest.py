"""Simulated PALSAR files, read back."""

import numpy as np
import pytest
from palsar_scene import (
    CENTRES,
    COLUMNS,
    FIRST_COLUMN,
    LOST,
    NEAR,
    PASS,
    RADAR,
    SMALL,
    SPACING,
    World,
    in_the_file,
    line_time,
    terrain_point,
    write_elevation,
    write_product,
    write_reference,
)
from scipy.integrate import solve_ivp

from navfilters.papers.pogorelsky2020 import Setup
from navfilters.papers.pogorelsky2020.real_patches import cut_patches
from navfilters.papers.pogorelsky2020.true_flight import initial_state
from navfilters.sar.ground.scene import draw_scene
from navfilters.sar.ground.terrain import LocalMap, Terrain, sample_posts
from navfilters.sar.palsar.opening import open_product
from navfilters.sar.raw.echoes_of_points import _half_aperture
from navfilters.sar.raw.flight import Flight
from navfilters.sar.raw.observation import _bright
from navfilters.sar.raw.radar import Window
from navfilters.sar.raw.rasters import scene_raster
from navfilters.sar.raw.synthesis import synthesize


@pytest.fixture(scope="session")
def orbit():
    """States (6,) at UTC seconds, by an integrator that the library does not use."""
    derivative = Setup().orbit.derivative
    ways = [
        solve_ivp(
            lambda _, x: derivative(x),
            (PASS, end),
            initial_state(Setup()),
            method="DOP853",
            rtol=1e-13,
            atol=1e-9,
            dense_output=True,
        ).sol
        for end in (36300.0, 38100.0)
    ]
    return lambda t: ways[int(t > PASS)](t)


@pytest.fixture(scope="session")
def world(orbit):
    posts = np.pad(sample_posts(), [(900, 900), (500, 500)], mode="symmetric")
    south, west = (29.76, -95.37) - np.array(posts.shape) / 2400
    terrain = Terrain(posts, float(south), float(west), 1 / 1200)
    scenes, echoes = [], []
    centre_range = NEAR + (FIRST_COLUMN + SMALL.samples // 2) * SPACING
    for k, line in enumerate(CENTRES):
        flight = Flight.through(Setup().orbit.derivative, orbit(line_time(line)), 3.0)
        latitude, longitude, height = terrain_point(flight, terrain, centre_range)
        scene = draw_scene(terrain, LocalMap(latitude, longitude), [5, k], half_width=2600.0)
        window = Window(0.0, 0, COLUMNS - FIRST_COLUMN, NEAR + FIRST_COLUMN * SPACING)
        half = _half_aperture(RADAR, flight, window) + SMALL.lines // 2
        window = window._replace(first_time=-half / RADAR.prf, pulses=2 * half)
        size = SMALL.lines, SMALL.samples
        received = synthesize(
            RADAR,
            flight,
            window,
            _bright(RADAR, flight, scene, window, *size, [6, k]),
            scene_raster(RADAR, flight, scene, window, *size, [7, k]),
            mean_height=height,
        )
        scenes.append(scene)
        echoes.append(received)
    return World(terrain, scenes, echoes)


@pytest.fixture(scope="session")
def folder(tmp_path_factory, orbit, world):
    """A product, an elevation model in degrees, a reference in metres."""
    pytest.importorskip("rasterio")
    folder = tmp_path_factory.mktemp("palsar")
    lost = {int(CENTRES[2]) + n: [(96, "B4", 1)] for n in range(LOST)}
    write_product(folder, orbit, world, line=lost, numbers=in_the_file(world))
    write_elevation(folder / "dem.tif", world.terrain)
    write_reference(folder / "reference.tif", world.scenes)
    return folder


@pytest.fixture(scope="session")
def product(folder):
    return open_product(folder)


@pytest.fixture(scope="session")
def patches(folder, product):
    return cut_patches(product, folder / "dem.tif", folder / "reference.tif", imaging=SMALL)
