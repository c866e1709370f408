"""Images: focused, averaged, brought to the ground, and sharpened."""

from navfilters.sar.images.autofocusing import Climb, autofocus, hill_climb, sharpness
from navfilters.sar.images.focuser import GUARD, Focuser
from navfilters.sar.images.ground_image import GroundImage, decibels, multilook, to_ground
from navfilters.sar.images.raw_data import RawData
from navfilters.sar.images.slant_image import Image, effective_velocity

__all__ = [
    "GUARD",
    "Climb",
    "Focuser",
    "GroundImage",
    "Image",
    "RawData",
    "autofocus",
    "decibels",
    "effective_velocity",
    "hill_climb",
    "multilook",
    "sharpness",
    "to_ground",
]
