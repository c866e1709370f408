"""A scene as a raster in the radar's coordinates."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyvander

from navfilters.sar.ground.scene import Scene, View
from navfilters.sar.in_parts import blocks
from navfilters.sar.raw.flight import Flight, view_of
from navfilters.sar.raw.radar import Radar, Window
from navfilters.sar.raw.synthesis import Raster
from navfilters.space.frames import geodetic_to_ecef
from navfilters.types import Array

FACETS = 16
"""Lines of facets that are brought to the radar at once: so few that BLAS starts no threads."""


def scene_raster(
    radar: Radar,
    flight: Flight,
    scene: Scene,
    window: Window,
    lines: int,
    samples: int,
    speckle: Any,
    margin: int = 48,
) -> Raster:
    """The facets of a scene, added up in the radar's cells, with fully developed speckle.

    Each facet's power is shared linearly between the four nearest cells, so that facets at the same
    time and range overlay each other; a cell has a complex normal amplitude of the sum.

    Parameters
    ----------
    radar : Radar
    flight : Flight
    scene : Scene
    window : Window
        Around the middle of the scene: ``centred_window``.
    lines, samples : int
        Of the image.
    speckle : int or sequence of int
        Seed.
    margin : int
        Cells around the image; there is no ground further out.

    Returns
    -------
    Raster
    """
    power, height, line = _facets(radar, flight, scene, window, lines, samples, margin)
    rng = np.random.default_rng(speckle)
    normal = rng.standard_normal((*power.shape, 2), dtype=np.float32).view(np.complex64)[..., 0]
    return Raster(np.sqrt(power / 2) * normal, height, line, -margin)


def _facets(
    radar: Radar,
    flight: Flight,
    scene: Scene,
    window: Window,
    lines: int,
    samples: int,
    margin: int,
) -> tuple[Array, Array, int]:
    """Power and mean height in each cell, and the first line."""
    first = (window.pulses - lines) // 2 - margin
    shape = (lines + 2 * margin, samples + 2 * margin)
    centre = geodetic_to_ecef(scene.map.latitude, scene.map.longitude, scene.height(0.0, 0.0))
    view = view_of(flight, centre)
    dR, out = radar.range_spacing, np.sin(view.incidence)
    speed = _ground_speed(flight, scene, view)
    extent = shape[0] / 2 / radar.prf * speed, shape[1] / 2 * dR / out
    along = np.arange(-shape[0] // 2, shape[0] // 2 + 1) * (speed / radar.prf)
    relief = scene.height(*_lattice(view, *(np.linspace(-1.3 * e, 1.3 * e, 60) for e in extent)))
    relief = (relief - scene.height(0.0, 0.0)) / np.tan(view.incidence)
    step = dR / out / 3
    ends = [(-extent[1] + np.nanmin(relief)) * 1.03, (extent[1] + np.nanmax(relief)) * 1.03]
    across = np.arange(np.floor(ends[0] / step), np.ceil(ends[1] / step) + 1) * step
    power, height = scene.returns(view, along, across)
    to_radar = _to_radar(flight, scene, view, along, across, height)
    total, moment = np.zeros(shape), np.zeros(shape)
    for facets in blocks(len(along), FACETS):
        time, distance = to_radar(facets)
        row = (time - window.first_time) * radar.prf - first
        column = (distance - window.near_range) / dR + margin
        inside = (row >= 0) & (row < shape[0] - 1) & (column >= 0) & (column < shape[1] - 1)
        _share(total, moment, *(a[inside] for a in (row, column, power[facets], height[facets])))
    total, moment = total.astype(np.float32), moment.astype(np.float32)
    mean = scene.height(0.0, 0.0)
    return total, np.where(total > 0, moment / np.where(total > 0, total, 1), mean), first


def _share(
    total: Array, moment: Array, row: Array, column: Array, power: Array, height: Array
) -> None:
    """Add power, and its moment of height, to the four nearest cells of each facet."""
    i, j = row.astype(np.int64), column.astype(np.int64)
    if not i.size:
        return
    row, column = row - i, column - j
    low, shape = int(i.min()), (int(np.ptp(i)) + 2, total.shape[1])
    lines, first = slice(low, low + shape[0]), (i - low) * shape[1] + j
    for di, in_row in ((0, 1 - row), (1, row)):
        for dj, in_column in ((0, 1 - column), (1, column)):
            share = power * in_row * in_column
            for grid, weights in ((total, share), (moment, share * height)):
                found = np.bincount(first + di * shape[1] + dj, weights, shape[0] * shape[1])
                grid[lines] += found.reshape(shape)


def _lattice(view: View, along: Array, across: Array) -> tuple[Array, Array]:
    """East and north of a grid along and across the flight."""
    flight, away = view.axes
    return tuple(along[:, None] * flight[i] + across * away[i] for i in range(2))


def _ground_speed(flight: Flight, scene: Scene, view: View) -> float:
    """Of the line across the flight, on the ground, m/s."""
    ends = np.array([-500.0, 500.0])
    east, north = (e[:, 0] for e in _lattice(view, ends, np.zeros(1)))
    place = scene.map.geodetic(east, north)
    t, _ = flight.closest(geodetic_to_ecef(*place, scene.height(0.0, 0.0)))
    return 1000.0 / float(t[1] - t[0])


def _to_radar(
    flight: Flight, scene: Scene, view: View, along: Array, across: Array, height: Array
) -> Callable[[slice], tuple[Array, Array]]:
    """Zero-Doppler time and range of lines of facets, by polynomials through exact ones."""
    scale = np.abs(along).max(), np.abs(across).max()
    nodes = np.cos(np.pi * (np.arange(6) + 0.5) / 6)
    low, high = float(height.min()) - 1, float(height.max()) + 1
    levels = (low + high) / 2 + (high - low) / 2 * np.cos(np.pi * (np.arange(3) + 0.5) / 3)
    place = scene.map.geodetic(*_lattice(view, nodes * scale[0], nodes * scale[1]))
    p = geodetic_to_ecef(place[0][..., None], place[1][..., None], levels)
    inverse = np.linalg.inv(polyvander(nodes, 5))
    to_level = np.linalg.inv(polyvander((levels - levels[1]) / 100, 2))
    rows, columns = polyvander(along / scale[0], 5), polyvander(across / scale[1], 5)
    fits = [
        np.einsum("ia,jb,kc,abc->ijk", inverse, inverse, to_level, exact)
        for exact in flight.closest(p)
    ]

    def of(facets: slice) -> tuple[Array, Array]:
        h, results = (height[facets] - np.float32(levels[1])) / np.float32(100), []
        for c in fits:
            grids = [rows[facets] @ c[..., k] @ columns.T for k in range(3)]
            results.append(grids[0] + h * (grids[1] + h * grids[2]))
        return results[0], results[1]

    return of
