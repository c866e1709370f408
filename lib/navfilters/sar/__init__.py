"""Synthetic aperture radar: raw data, ground, images, matching, and PALSAR files."""

from navfilters.sar.in_parts import in_threads

__all__ = ["in_threads"]
