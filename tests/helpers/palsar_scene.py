"""Files that say of one scene what a PALSAR product, an elevation model and a reference would.

The pass, the terrain and the backscatter are simulated, the raw data quantized to 5 bits.
"""

from dataclasses import dataclass

import numpy as np
import palsar_files as files
from scipy.ndimage import map_coordinates

from navfilters.papers.pogorelsky2020 import Setup
from navfilters.papers.pogorelsky2020.imaging import Imaging
from navfilters.sar.ground.scene import View
from navfilters.sar.ground.terrain import Terrain
from navfilters.sar.raw.radar import Radar
from navfilters.space.frames import ecef_to_geodetic

# half of PALSAR's aperture has a quarter of its sensitivity to velocity; half the pulse rate
RADAR = Radar(pulse_length=4e-6, prf=1100.0, antenna=17.8)
SMALL = Imaging(
    radar=RADAR,
    lines=384,
    samples=256,
    bandwidth=855.0,
    looks=(2, 2),
    half_width=1600.0,
    steps=(16.0, 4.0),
    reach=60.0,
)
COLUMNS, FIRST_COLUMN = 480, 45  # of the product, and of what the patches need of it
STEP = round(Setup().interval * RADAR.prf)
LINES = 2 * STEP + 2340
CENTRES = LINES // 2 + STEP * np.arange(-1, 2)
PASS = files.MS * 1e-3 + files.WITHIN + LINES / 2 / RADAR.prf
"""When the orbit is where the experiment's starts, s of the day."""
SPACING = RADAR.range_spacing
NEAR = round(866060 - (FIRST_COLUMN + SMALL.samples // 2) * SPACING)
UTM = "EPSG:32615"
LOST = 60
"""Lines in the third patch that are flagged as missing."""


def line_time(line):
    return files.MS * 1e-3 + files.WITHIN + line / RADAR.prf


@dataclass(frozen=True)
class World:
    """What the files are made from."""

    terrain: Terrain
    scenes: list
    echoes: list


def terrain_point(flight, terrain, slant_range):
    """Latitude, longitude and height at time 0 and a range: by turns, for gentle slopes."""
    height = 600.0
    for _ in range(50):
        latitude, longitude, _ = ecef_to_geodetic(flight.ground_point(0.0, slant_range, height))
        height = float(terrain.height(latitude, longitude))
    return float(latitude), float(longitude), height


def write_product(folder, orbit, world, line, numbers):
    """Lines far from the patches hold noise, or are not in the file."""
    rng = np.random.default_rng(8)
    signal = 2.0 * rng.standard_normal((LINES, COLUMNS, 2)).astype(np.float32)
    for centre, received in zip(CENTRES, world.echoes, strict=True):
        parts = received.view(np.float32).reshape(*received.shape, 2)
        half = len(received) // 2
        signal[centre - half : centre + half, FIRST_COLUMN:] += 4.5 / parts.std() * parts
    codes = np.clip(np.rint(signal + np.array([15.5, 15.625])), 0, 31).astype(np.uint8)
    length = 412 + 2 * COLUMNS
    image = files.image_bytes(
        rows=[(186, "I6", length), (248, "I8", COLUMNS), (280, "I8", length - 412)],
        each=[
            (8, "B4", length), (24, "B4", COLUMNS), (28, "B4", 0), (56, "B4", 1_100_000),
            (68, "B4", 4000), (76, "S4", -7_000_000), (116, "B4", NEAR),
        ],
        line=line,
        codes=codes,
        numbers=numbers,
        length=length,
        pri=1 / RADAR.prf,
    )  # fmt: skip
    leader = files.leader_bytes(
        summary=[(550, "E16", "-7.0000000E+12"), (742, "F16", "4.0000000")],
        orbit=files.state_rows([orbit(36400.25 + 60 * k) for k in range(28)]),
    )
    return files.product(folder, image, leader)


def write_geotiff(path, values, crs, west, north, step, units="", **options):
    """Rows from north to south; west and north are the middle of the first pixel."""
    import rasterio

    place = rasterio.Affine(step, 0.0, west - step / 2, 0.0, -step, north + step / 2)
    rows, columns = values.shape
    profile = {
        "driver": "GTiff",
        "width": columns,
        "height": rows,
        "count": 1,
        "dtype": values.dtype,
    }
    with rasterio.open(path, "w", crs=crs, transform=place, **profile, **options) as file:
        file.write(values, 1)
        file.units = [units]
    return path


def write_elevation(path, terrain):
    north = terrain.south + terrain.spacing * (len(terrain.posts) - 1)
    posts = terrain.posts[::-1].astype(np.int16)
    return write_geotiff(path, posts, "EPSG:4326", terrain.west, north, terrain.spacing)


def orthoimage(scene, seed):
    """Backscatter in dB each 10 m, where the ground is: rows from south to north."""
    axis = np.arange(-200, 201) * 10.0
    power, _ = scene.returns(View(0.0, np.deg2rad(40.0), np.inf), axis, axis)
    east, north, bright = scene.points
    row, column = np.rint(north / 10).astype(int) + 200, np.rint(east / 10).astype(int) + 200
    inside = (np.abs(row - 200) <= 200) & (np.abs(column - 200) <= 200)
    np.add.at(power, (row[inside], column[inside]), bright[inside])
    speckle = np.random.default_rng(seed).standard_gamma(8.0, power.shape) / 8.0
    return 10 * np.log10((power / 100 + 0.005) * speckle)


def write_reference(path, scenes, shown=None, step=12.5, seed=9, units="dB"):
    """On a map in metres, the surroundings of the scenes alone, or what is ``shown`` in place."""
    from rasterio import warp

    places = np.array([(scene.map.longitude, scene.map.latitude) for scene in scenes])
    x, y = (np.array(a) for a in warp.transform("EPSG:4326", UTM, *places.T))
    west, north = x.min() - 2500, y.max() + 2500
    shape = (np.array([y.max() - y.min(), x.max() - x.min()]) + 5000) // step
    values = np.full(shape.astype(int), -999.0, np.float32)
    for k, scene in enumerate(scenes):
        row, column = int((north - y[k]) / step), int((x[k] - west) / step)
        rows, columns = np.arange(row - 145, row + 146), np.arange(column - 145, column + 146)
        grid = np.meshgrid(north - step * rows, west + step * columns, indexing="ij")
        to = warp.transform(UTM, "EPSG:4326", grid[1].ravel(), grid[0].ravel())
        here = scene.map.position(np.array(to[1]), np.array(to[0]))
        where = [here[1] / 10 + 200, here[0] / 10 + 200]
        image = orthoimage((shown or scenes)[k], [seed, k])
        sampled = map_coordinates(image, where, order=1, mode="nearest")
        values[np.ix_(rows, columns)] = sampled.reshape(grid[0].shape)
    options = {"nodata": -999.0, "compress": "deflate", "tiled": True, "units": units}
    return write_geotiff(path, values, UTM, west, north, step, **options)


def in_the_file(world):
    """Line numbers: the patches with some lines around them, and two lines in five of the rest."""
    lines = np.arange(LINES)
    near = np.abs(lines[:, None] - CENTRES).min(axis=1) <= len(world.echoes[0]) // 2 + 20
    return [int(n) + 1 for n in lines[near | (lines % 5 < 2)]]
