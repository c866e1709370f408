"""The ground: terrain, land cover, and scenes made of both."""

from navfilters.sar.ground.land_cover import COVER, CoverClass, LandCover, lambert, smooth_field
from navfilters.sar.ground.scene import Points, Scene, View, draw_scene
from navfilters.sar.ground.terrain import (
    TILE,
    LocalMap,
    Terrain,
    sample_posts,
    sample_terrain,
    terrain_hit,
)

__all__ = [
    "COVER",
    "TILE",
    "CoverClass",
    "LandCover",
    "LocalMap",
    "Points",
    "Scene",
    "Terrain",
    "View",
    "draw_scene",
    "lambert",
    "sample_posts",
    "sample_terrain",
    "smooth_field",
    "terrain_hit",
]
