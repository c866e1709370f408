"""Synthetic aperture radar: from the echo to a position on the ground."""
