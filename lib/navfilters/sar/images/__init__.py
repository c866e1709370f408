"""Images: focused, averaged, brought to the ground, and sharpened."""

from navfilters.sar.images.autofocusing import Climb, autofocus, hill_climb, sharpness
from navfilters.sar.images.doppler_centroid import doppler_centroid
from navfilters.sar.images.focus_criteria import image_entropy
from navfilters.sar.images.focuser import GUARD, Focuser
from navfilters.sar.images.ground_image import GroundImage, decibels, multilook, to_ground
from navfilters.sar.images.map_drift import (
    Drift,
    Drifting,
    drift_to_velocity,
    look_drift,
    map_drift,
)
from navfilters.sar.images.raw_data import RawData
from navfilters.sar.images.slant_image import Image, effective_velocity

__all__ = [
    "GUARD",
    "Climb",
    "Drift",
    "Drifting",
    "Focuser",
    "GroundImage",
    "Image",
    "RawData",
    "autofocus",
    "decibels",
    "doppler_centroid",
    "drift_to_velocity",
    "effective_velocity",
    "hill_climb",
    "image_entropy",
    "look_drift",
    "map_drift",
    "multilook",
    "sharpness",
    "to_ground",
]
