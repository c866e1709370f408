"""A reference image of the terrain, with positions."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from navfilters.sar.ground.scene import Scene, View
from navfilters.sar.images.ground_image import decibels
from navfilters.sar.matching.matcher import MATCHER, Features, Matcher
from navfilters.types import Array


@dataclass(frozen=True, eq=False)
class Reference:
    """A geocoded reference image, north up.

    Parameters
    ----------
    values : array (rows, columns) of float32
        dB, rows from north to south. The middle pixel is the middle of the scene's map.
    pixel : float
        m, on the scene's map.
    scene : Scene
        Whose map and elevation model the onboard computer has.
    view : View or None
        From where the reference was taken; None for an orthoimage, in which no terrain leans.
    matcher : Matcher
    """

    values: Array
    pixel: float
    scene: Scene
    view: View | None
    matcher: Matcher = MATCHER
    _level: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_level", self.scene.height(0.0, 0.0))

    @cached_property
    def features(self) -> Features:
        """Of the image."""
        return self.matcher.features(self.values)

    @cached_property
    def on_terrain(self) -> Array:
        """Where these features are in truth, (n, 3).

        Column and row of a map, and height above the middle, m.
        """
        x, y, height = self._terrain(*self.features.places.T)
        return np.stack([*self._place(x, y), height], axis=1)

    def at_contrast(self, contrast: float) -> "Reference":
        """The same, matched at a higher threshold, for which no features are looked for again.

        Parameters
        ----------
        contrast : float
            See ``Matcher``.

        Returns
        -------
        Reference
        """
        other = replace(self, matcher=replace(self.matcher, contrast=contrast))
        vars(other)["features"] = self.features.above(contrast)  # where it would be kept
        return other

    def ground(self, column: Any, row: Any) -> tuple[Array, Array, Array]:
        """Latitude, longitude and height of the terrain that a pixel shows.

        Parameters
        ----------
        column, row : array (...)
            Pixels, also between them.

        Returns
        -------
        tuple of ndarray (...)
            Geodetic, deg, deg and m above the ellipsoid; NaN outside of the elevation model.

        Notes
        -----
        Terrain is shifted towards the radar by what it is higher than the middle, over the tangent
        of the incidence; not in an orthoimage. The shift is undone by iteration, which converges
        where no slope is steep enough to be laid over.
        """
        x, y, height = self._terrain(column, row)
        return *self.scene.map.geodetic(x, y), height + self._level

    def height(self, column: Any, row: Any) -> Array:
        """Of the terrain at a place of a map with the image's pixels, above the middle.

        Parameters
        ----------
        column, row : array (...)
            Where the terrain is, not where the image shows it.

        Returns
        -------
        ndarray (...)
            m.
        """
        return self.scene.height(*self._position(column, row)) - self._level

    def geodetic(self, column: Any, row: Any) -> tuple[Array, Array]:
        """Latitude and longitude of a place of that map, deg.

        Parameters
        ----------
        column, row : array (...)

        Returns
        -------
        tuple of ndarray (...)
        """
        return self.scene.map.geodetic(*self._position(column, row))

    def _terrain(self, column: Any, row: Any) -> tuple[Array, Array, Array]:
        """East, north and height above the middle of what pixels show, m."""
        east, north = self._position(column, row)
        if self.view is None:
            return east, north, self.scene.height(east, north) - self._level
        away = self.view.axes[1]
        x, y, height = east, north, np.zeros_like(east)
        for _ in range(20):
            height = self.scene.height(x, y) - self._level
            shift = height / np.tan(self.view.incidence)
            x, y = east + shift * away[0], north + shift * away[1]
        return x, y, height

    def _position(self, column: Any, row: Any) -> tuple[Array, Array]:
        """East and north of places, m."""
        rows, columns = self.values.shape
        east = (np.asarray(column, float) - columns // 2) * self.pixel
        return east, (rows // 2 - np.asarray(row, float)) * self.pixel

    def _place(self, east: Array, north: Array) -> tuple[Array, Array]:
        rows, columns = self.values.shape
        return columns // 2 + east / self.pixel, rows // 2 - north / self.pixel


def form_reference(
    scene: Scene,
    view: View,
    *,
    half_width: float = 7000.0,
    pixel: float = 10.0,
    looks: float = 8.0,
    noise: float = -23.0,
    speckle: Any = 0,
    matcher: Matcher = MATCHER,
) -> Reference:
    """The reference image of a scene: facets in another pass's geometry, with its own speckle.

    Parameters
    ----------
    scene : Scene
    view : View
        Of that pass. Rays are parallel if its range is infinite.
    half_width : float
        Of the square, m.
    pixel : float
        m.
    looks : float
        Of the speckle's gamma distribution, independent in each pixel.
    noise : float
        Noise-equivalent reflectivity, dB.
    speckle : int or sequence of int
        Seed.
    matcher : Matcher

    Returns
    -------
    Reference

    Raises
    ------
    ValueError
        Naming the argument, the value found and what is needed.
    """
    for name, value in (("half_width", half_width), ("pixel", pixel), ("looks", looks)):
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name} must be a positive number; found {value}")
    half = int(half_width / pixel)
    n, step = 2 * half + 1, pixel / 2
    turn = abs(np.sin(2 * view.heading)) / 2
    reach = np.ceil(half_width * np.sqrt(1 + 2 * turn) / step + 1)
    along = np.arange(-reach, reach + 1) * step
    shifts = 400.0 / np.tan(view.incidence)  # relief may bring ground in from beyond the edge
    across = np.arange(-reach - shifts // step, reach + shifts // step + 1) * step
    power, height = scene.returns(view, along, across)
    flight, away = view.axes
    level = scene.height(0.0, 0.0)
    seen = across - (height - level) / np.tan(view.incidence)
    total = np.zeros(n * n, np.float32)
    for rows in np.array_split(np.arange(len(along)), 8):  # in parts, to save memory
        x = along[rows, None] * flight[0] + seen[rows] * away[0]
        y = along[rows, None] * flight[1] + seen[rows] * away[1]
        _add(total, n, x / pixel + half, half - y / pixel, power[rows])
    east, north, bright = scene.points
    shift = (scene.height(east, north) - level) / np.tan(view.incidence)
    x, y = east - shift * away[0], north - shift * away[1]
    _add(total, n, x / pixel + half, half - y / pixel, bright)
    area = pixel * pixel
    power = total.reshape(n, n) + area * 10 ** (noise / 10)
    gamma = np.random.default_rng(speckle).standard_gamma(looks, (n, n), dtype=np.float32)
    values = decibels(power * gamma / np.float32(looks)).astype(np.float32)
    return Reference(values, pixel, scene, view, matcher)


def _add(total: Array, n: int, column: Array, row: Array, power: Array) -> None:
    """Share powers linearly between the four nearest of n by n pixels, in place."""
    inside = (column >= 0) & (column < n - 1) & (row >= 0) & (row < n - 1)
    column, row, power = column[inside], row[inside], power[inside]
    j, i = column.astype(np.int64), row.astype(np.int64)
    column, row = column - j, row - i
    for di, in_row in ((0, 1 - row), (1, row)):
        for dj, in_column in ((0, 1 - column), (1, column)):
            index = (i + di) * n + j + dj
            total += np.bincount(index, power * in_row * in_column, total.size).astype(np.float32)
