"""Matching: an image beside a reference, and where its centre is."""

from navfilters.sar.matching.geolocation import Match, geolocate, paired_places
from navfilters.sar.matching.matcher import MATCHER, Features, Matcher
from navfilters.sar.matching.reference import Reference, form_reference

__all__ = [
    "MATCHER",
    "Features",
    "Match",
    "Matcher",
    "Reference",
    "form_reference",
    "geolocate",
    "paired_places",
]
