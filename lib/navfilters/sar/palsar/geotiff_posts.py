"""Heights of a terrain file as posts, and what is odd about them."""

import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy import ndimage

from navfilters.sar.ground.terrain import LocalMap
from navfilters.sar.palsar.geotiff_values import (
    _SHORE,
    _STEEP,
    _VOIDS,
    _check_datum,
    _extremes,
    _height_unit,
    _lattice,
    _opened,
    _warped,
)
from navfilters.types import Array

LOWEST, HIGHEST = -600.0, 9200.0
"""No ground lies below or above, m: other heights are voids, or in another unit."""

LARGEST_GEOID = 110.0
"""The geoid is 107 m below and 86 m above the ellipsoid at most, m."""

_REACH = 4  # posts from a void that interpolation still feels


class _Posts(NamedTuple):
    """Heights or NaN, rows from south to north; south, west and spacing, deg.

    ``wrong`` says what the file holds that is no height, and where; empty if all is well. ``zero``
    are the posts about which the file has a 0.
    """

    heights: Array
    south: float
    west: float
    spacing: float
    wrong: str
    zero: Array

    def place(self, row: Any, column: Any) -> str:
        latitude, longitude = self.south + self.spacing * row, self.west + self.spacing * column
        return f"{latitude:.4f}, {(longitude + 180) % 360 - 180:.4f} deg"


def _around(place: LocalMap, half_width: float) -> str:
    return f"within {half_width:.0f} m of {place.latitude:.4f}, {place.longitude:.4f} deg"


def _posts(path: str | Path, place: LocalMap, half_width: float, geoid: float) -> _Posts:
    """Heights above the file's own zero, with some posts around the square checked as well."""
    if not abs(geoid) <= LARGEST_GEOID:
        raise ValueError(
            f"geoid must be a number from {-LARGEST_GEOID:.0f} to {LARGEST_GEOID:.0f} m; "
            f"found {geoid}"
        )
    to_east, to_north = place.metres
    with _opened(path) as dataset:
        metres = _height_unit(dataset, path)
        _check_datum(dataset, path, geoid)
        spacing, left, top = _lattice(dataset, place)
        west, north = place.longitude - half_width / to_east, place.latitude + half_width / to_north
        column, row = np.floor((west - left) / spacing), np.floor((top - north) / spacing)
        shape = (
            int(np.ceil(2 * half_width / to_north / spacing)) + 2,
            int(np.ceil(2 * half_width / to_east / spacing)) + 2,
        )
        corner = float(left + column * spacing), float(top - row * spacing)
        step = (spacing, spacing)
        heights = metres * _warped(dataset, corner, step, shape, "cubic")[::-1]
        around = corner[0] - _REACH * spacing, corner[1] + _REACH * spacing
        wide = shape[0] + 2 * _REACH, shape[1] + 2 * _REACH
        raw, low, high = (a[::-1] for a in _extremes(dataset, around, step, wide))
    south = corner[1] - (shape[0] - 1) * spacing
    inside = slice(_REACH, -_REACH), slice(_REACH, -_REACH)
    found = _Posts(heights, south, corner[0], spacing, "", (low == 0)[inside])
    too_low = metres * low < LOWEST
    bad = too_low | (metres * high > HIGHEST) | np.isin(raw, _VOIDS[:-1])
    if not bad.any():
        return found
    first = tuple(np.argwhere(bad)[0])
    value = high[first] if metres * high[first] > HIGHEST else raw[first]
    heights[_near(bad, _REACH)[inside]] = np.nan
    at = found.place(*(np.array(first) - _REACH))
    others = f"{int(bad.sum()) - 1} other posts"
    return found._replace(wrong=f"{value:.8g} at {at} and {others}: {_hint(value)}")


def _hint(value: float) -> str:
    """What a number that is no height may be, and what to do about it."""
    if value in _VOIDS or value < -12000 or value > 32000:
        return (
            f"a void that the file does not declare? `rio edit-info --nodata {value:.8g} FILE` does"
        )
    if value > 0:
        return "feet? `rio edit-info --bidx 1 --units foot FILE` declares them"
    return "the sea's floor? A radar sees its surface"


def _near(mask: Array, reach: int) -> Array:
    """A mask with all that is so near."""
    if not mask.any():
        return mask
    return ndimage.maximum_filter(mask, size=2 * reach + 1)


def _warn_of_odd(path: str | Path, place: LocalMap, half_width: float, posts: _Posts) -> None:
    """Tell of heights that some ground may have, but hardly any."""

    def tell(found: str) -> None:
        text = f"{path} has odd heights {_around(place, half_width)}: {found}"
        warnings.warn(text, stacklevel=4)

    heights = posts.heights
    if posts.zero.all():
        tell("0 everywhere, as of the open sea, or of a file that was never filled")
        return
    land, (parts, _) = ~_near(posts.zero, 1), ndimage.label(posts.zero)
    for k, around in enumerate(ndimage.find_objects(parts), start=1):
        window = tuple(slice(max(side.start - 3, 0), side.stop + 3) for side in around)
        part = parts[window] == k
        shore = heights[window][_near(part, 3) & land[window]]
        if shore.size and (level := np.median(shore)) > _SHORE:
            tell(
                f"exactly 0 at {posts.place(*np.argwhere(parts == k)[0])} and {part.sum() - 1} "
                f"other posts, with {level:.0f} m around them: voids that are filled with 0?"
            )
            return
    spacing = posts.spacing * place.metres[1]
    for axis in (0, 1):
        steps = np.abs(np.diff(heights, axis=axis))
        if steps.max() > max(_STEEP * spacing, 500.0):
            at = posts.place(*np.unravel_index(np.argmax(steps), steps.shape))
            tell(f"a step of {steps.max():.0f} m between posts {spacing:.0f} m apart, at {at}")
            break
