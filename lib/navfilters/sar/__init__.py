"""Synthetic aperture radar: raw data, ground, images, matching, and PALSAR files."""
