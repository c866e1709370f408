"""Raw data: what a radar in flight receives of a scene."""

from navfilters.sar.raw.echoes_of_points import Echoes, point_echo
from navfilters.sar.raw.flight import Flight, view_of
from navfilters.sar.raw.observation import centred_window, observe
from navfilters.sar.raw.radar import LIGHT, PALSAR, Radar, Raw, Window, receive
from navfilters.sar.raw.rasters import scene_raster
from navfilters.sar.raw.synthesis import Raster, synthesize

__all__ = [
    "LIGHT",
    "PALSAR",
    "Echoes",
    "Flight",
    "Radar",
    "Raster",
    "Raw",
    "Window",
    "centred_window",
    "observe",
    "point_echo",
    "receive",
    "scene_raster",
    "synthesize",
    "view_of",
]
