"""A scene: terrain, land cover and points, as a radar sees them."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from navfilters.sar.ground.land_cover import LandCover, lambert
from navfilters.sar.ground.terrain import LocalMap, Terrain
from navfilters.sar.in_parts import blocks, in_threads
from navfilters.types import Array

ROWS = 16
"""Of a grid that are looked up at once: they fit the cache."""


class Points(NamedTuple):
    """Bright scatterers on the ground.

    Parameters
    ----------
    east, north : array (n,)
        m.
    power : array (n,)
        Radar cross-section, in m^2 of ground of reflectivity 1.
    """

    east: Array
    north: Array
    power: Array


class View(NamedTuple):
    """Where a radar is when it looks at the middle of a scene.

    Parameters
    ----------
    heading : float
        Horizontal direction of flight, clockwise from north, rad. The radar looks to the right.
    incidence : float
        Between the ray and the vertical, rad.
    slant_range : float
        m; infinite for parallel rays.
    """

    heading: float
    incidence: float
    slant_range: float

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Unit vectors (east, north) along the flight, and across it, away from the radar."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        return np.array([s, c]), np.array([c, -s])


@dataclass(frozen=True, eq=False)
class Scene:
    """Terrain, land cover and bright points about the middle of a map.

    Parameters
    ----------
    map : LocalMap
    terrain : Terrain
    cover : LandCover
    points : Points
    """

    map: LocalMap
    terrain: Terrain
    cover: LandCover
    points: Points

    def height(self, east: Array, north: Array) -> Array:
        """Of the terrain, m.

        Parameters
        ----------
        east, north : array (...)
            m.

        Returns
        -------
        ndarray (...)
            NaN outside of the tile.
        """
        return self.terrain.height(*self.map.geodetic(east, north))

    def returns(self, view: View, along: Array, across: Array) -> tuple[Array, Array]:
        """Power that each facet of a grid sends back, and how high it is.

        Its area on the slope, times the reflectivity of its land, times ``lambert`` of the local
        incidence angle; none from facets that face away or lie in the shadow of others.

        Parameters
        ----------
        view : View
        along, across : array (n,), (m,)
            Ascending and evenly spaced positions along the flight and across it, m: the axes of
            ``view``. At least two each.

        Returns
        -------
        power : ndarray (n, m) of float32
            In m^2 of ground of reflectivity 1.
        height : ndarray (n, m) of float32
            m.

        Raises
        ------
        ValueError
            A grid that leaves the terrain.
        """
        flight, away = view.axes
        height = np.empty((len(along), len(across)), np.float32)
        cover = np.empty_like(height)
        hidden = np.empty(height.shape, bool)

        def look_up(rows: slice) -> None:
            east = along[rows, None] * flight[0] + across * away[0]
            north = along[rows, None] * flight[1] + across * away[1]
            height[rows] = self.height(east, north)
            cover[rows] = self.cover.at(east, north)
            hidden[rows] = self._hidden(view, across, height[rows])

        in_threads(look_up, blocks(len(along), ROWS))
        if np.isnan(height).any():
            raise ValueError(
                "along and across must stay on the terrain; found a grid from "
                f"{along[0]:.0f} to {along[-1]:.0f} m and {across[0]:.0f} to {across[-1]:.0f} m"
            )
        steps = along[1] - along[0], across[1] - across[0]
        ray, power = self._rays(view, across), np.empty_like(height)

        def weigh(rows: slice) -> None:
            first = max(rows.start - 1, 0)  # differences along the flight need the neighbours
            both: Any = np.gradient(height[first : rows.stop + 1], *steps)
            rise, slope = (g[rows.start - first : rows.stop - first] for g in both)
            # n = (-rise, -slope, 1): its length is also the area on the slope of one on the level
            stretch = np.sqrt(1 + rise * rise + slope * slope)
            cosine = (slope * np.sin(ray) + np.cos(ray)) / stretch
            sent = cover[rows] * lambert(cosine) * stretch * (steps[0] * steps[1])
            power[rows] = np.where(hidden[rows], 0, sent)

        in_threads(weigh, blocks(len(along), ROWS))
        return power, height

    def _rays(self, view: View, across: Array) -> Array:
        """Incidence on the level at each distance across the flight."""
        if not np.isfinite(view.slant_range):
            return np.full(across.shape, view.incidence, np.float32)
        out, up = np.sin(view.incidence), np.cos(view.incidence)
        ray = np.arctan2(view.slant_range * out + across, view.slant_range * up)
        return ray.astype(np.float32)

    def _hidden(self, view: View, across: Array, height: Array) -> Array:
        """Facets whose ray passes below one that is nearer."""
        height = height - self.height(0.0, 0.0)
        out, up = np.sin(view.incidence), np.cos(view.incidence)
        if np.isfinite(view.slant_range):
            reach = view.slant_range
            outwards = (reach * out + across) / (reach * up - height)  # tangent of the look angle
        else:
            outwards = across * up + height * out
        return outwards < np.maximum.accumulate(outwards, axis=1)


DENSITY = 5.0
"""Bright points of a drawn scene in a square kilometre."""

POWERS = (27.0, 41.0)
"""Their cross-sections are spread evenly between these, dB; a cell of PALSAR's raster has 14."""


def draw_scene(
    terrain: Terrain,
    centre: LocalMap,
    seed: Any = 0,
    *,
    half_width: float = 10000.0,
) -> Scene:
    """A scene with a land cover and bright points drawn at random.

    Parameters
    ----------
    terrain : Terrain
    centre : LocalMap
        Its middle is the scene's.
    seed : int or sequence of int
    half_width : float
        Of the square that is drawn, m.

    Returns
    -------
    Scene
    """
    seeds = np.random.SeedSequence(seed).spawn(2)
    rng = np.random.default_rng(seeds[1])
    number = round(DENSITY * (2 * half_width / 1000) ** 2)
    east, north = rng.uniform(-half_width, half_width, (2, number))
    power = 10 ** (rng.uniform(*POWERS, number) / 10)
    drawn = LandCover.draw(half_width, seeds[0])
    return Scene(centre, terrain, drawn, Points(east, north, power))
