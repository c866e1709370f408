"""Elevation models and reference images from GeoTIFF files: what an image needs of them, no more.

Rasterio reads the files, in any coordinate reference system that it can transform to WGS 84, across
the 180th meridian too. Of a file with several bands the first is read. Places without data are
where the file has none, where its own mask says so, and beyond its edges.

What a file does not declare is not guessed from a pixel: values that no ground and no echo has are
refused with their place, and an image that may be in decibels or not is refused until it is said.
"""

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy import ndimage

from navfilters._extras import needed
from navfilters.sar.geolocate import MATCHER, Matcher, Reference
from navfilters.sar.scene import LocalMap, Scene, Terrain
from navfilters.types import Array

WGS84 = "EPSG:4326"
FINEST = 1e-4
"""Elevation models are not read at a finer spacing, deg: about 11 m."""
LOWEST, HIGHEST = -600.0, 9200.0
"""No ground lies below or above, m: other heights are voids, or in another unit."""
LARGEST_GEOID = 110.0
"""The geoid is 107 m below and 86 m above the ellipsoid at most, m."""
UNITS = ("dB", "linear")
"""What a reference image may hold; linear is intensity or amplitude, at any scale."""
_NOTHING = -1e30  # stands for no data while GDAL works
_VOIDS = (-32768, -32767, -99999, -9999, -999)  # what files hold for no data, often undeclared
_FEET = {"foot": 0.3048, "feet": 0.3048, "ft": 0.3048, "international foot": 0.3048}
_FEET |= dict.fromkeys(("us survey foot", "ftus", "us-ft", "foot_us"), 1200 / 3937)
_METRES = {"": 1.0} | dict.fromkeys(("m", "metre", "metres", "meter", "meters", "unknown"), 1.0)
_SHORE = 50.0  # m, that hardly any shore is high on the whole
_STEEP = 10.0  # rise over run that hardly any ground has between neighbouring posts
_SAY = 'say unit="dB" or unit="linear" (--reference-unit)'
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


def median_height(
    path: str | Path, place: LocalMap, half_width: float, *, geoid: float = 0.0
) -> float:
    """Of an elevation model around a place, as far as the file reaches: where a search can start.

    Parameters
    ----------
    path, place, half_width, geoid
        As for :func:`read_terrain`.

    Returns
    -------
    float
        Above the WGS-84 ellipsoid, m.

    Raises
    ------
    ValueError
        A file that has no coordinates, or no heights there at all.
    OSError, ImportError
        As :func:`read_terrain`.
    """
    posts = _posts(path, place, half_width, geoid)
    if np.isnan(posts.heights).all():
        found = posts.wrong or f"no heights there{_why_none(path, place, half_width)}"
        raise ValueError(f"{path} must cover {_around(place, half_width)}; found {found}")
    return float(np.nanmedian(posts.heights)) + geoid


def read_terrain(
    path: str | Path, place: LocalMap, half_width: float, *, geoid: float = 0.0
) -> Terrain:
    """An elevation model around a place.

    Posts in latitude and longitude are taken as they are; of anything else GDAL's cubic
    interpolation makes posts of about the same spacing.

    Parameters
    ----------
    path : str or Path
        Of a GeoTIFF file of heights: m, or feet if it declares them.
    place : LocalMap
        In the middle.
    half_width : float
        Of the square that is needed, m.
    geoid : float
        Added to all heights, m: where they count from sea level, the height of the geoid above
        the WGS-84 ellipsoid.

    Returns
    -------
    Terrain
        Heights above the WGS-84 ellipsoid.

    Raises
    ------
    ValueError
        A file that has no coordinates, holds no heights, or lacks one in the square: with the first
        place that has none, or one that no ground has. A geoid that is none.
    OSError
        A file that cannot be read.
    ImportError
        Without rasterio.

    Warns
    -----
    UserWarning
        Heights of exactly 0 amid high ground, or everywhere; steps between neighbouring posts that
        hardly any ground has; heights that the file declares to count from sea level, and no geoid.
    """
    posts = _posts(path, place, half_width, geoid)
    if posts.wrong:
        needed = f"heights from {LOWEST:.0f} to {HIGHEST:.0f} m"
        raise ValueError(
            f"{path} must hold {needed} {_around(place, half_width)}; found {posts.wrong}"
        )
    absent = np.argwhere(np.isnan(posts.heights))
    if len(absent):
        raise ValueError(
            f"{path} must hold all heights {_around(place, half_width)}; found none at "
            f"{posts.place(*absent[0])} and {len(absent) - 1} other posts"
            f"{_why_none(path, place, half_width)}"
        )
    _warn_of_odd(path, place, half_width, posts)
    return Terrain(posts.heights + geoid, posts.south, posts.west, posts.spacing)


def read_reference(
    path: str | Path,
    scene: Scene,
    *,
    half_width: float = 7000.0,
    pixel: float = 10.0,
    needed: float = 2500.0,
    unit: str | None = None,
    matcher: Matcher = MATCHER,
) -> Reference:
    """An orthoimage about the middle of a scene's map.

    Parameters
    ----------
    path : str or Path
        Of a geocoded GeoTIFF image, corrected for the terrain: backscatter in dB, or intensity or
        amplitude. What is not above zero in the latter has not been measured.
    scene : Scene
        Whose map and elevation model go with it.
    half_width : float
        Of the square that is read, m.
    pixel : float
        To which the image is averaged or interpolated, m.
    needed : float
        Half of the side of the square in which at least half of the pixels must have data, m. All
        others get the median.
    unit : {"dB", "linear"}, optional
        Of the image. By default what its band declares, or what its pixels together tell: in dB, at
        least 55 % are below zero, and the darkest by more than 3 dB; otherwise at most 10 % are,
        the darkest are far below the brightest, and the bright ones spread wider than the dark ones
        do. Anything between is refused.
    matcher : Matcher

    Returns
    -------
    Reference

    Raises
    ------
    ValueError
        A file that has no coordinates, not enough data, values that no backscatter has, or a unit
        that it does not tell.
    OSError, ImportError
        As :func:`read_terrain`.
    """
    half = int(half_width / pixel)
    to_east, to_north = scene.map.metres
    west, north = scene.map.longitude, scene.map.latitude
    step = pixel / to_east, pixel / to_north
    if unit not in (None, *UNITS):
        raise ValueError(f"unit must be 'dB', 'linear' or None; found {unit!r}")
    with _opened(path) as dataset:
        grid = (west - half * step[0], north + half * step[1]), step, (2 * half + 1, 2 * half + 1)
        values = _warped(dataset, *grid, "bilinear")
        raw, low, high = _extremes(dataset, *grid)
        coarser = _pixel(dataset, scene.map) / pixel
        void, zero = _void(dataset, raw, low, high)
        declared = _declared_unit(dataset, path, unit)
    reach = int(np.ceil(coarser - 0.01)) if coarser > 0.99 else 2  # of what is averaged with a void
    values[_near(void, reach) | zero] = np.nan
    if np.isfinite(values).any():
        unit = _sound_unit(path, values, unit or declared)
        if unit == "linear":
            zero = ndimage.binary_opening(zero, np.ones((3, 3)))  # others are noise, cut at 0
        values[_near(zero, reach)] = np.nan
        if unit == "linear":
            values = 10 * np.log10(np.where(values > 0, values, np.nan))
    inner = slice(max(half - int(needed / pixel), 0), half + int(needed / pixel) + 1)
    share = np.isfinite(values[inner, inner]).mean()
    if share < 0.5:
        raise ValueError(
            f"{path} must have data in half of the pixels {_around(scene.map, needed)}; found "
            f"{100 * share:.0f} %{_why_none(path, scene.map, needed)}"
        )
    values = np.where(np.isnan(values), np.nanmedian(values), values).astype(np.float32)
    return Reference(values, pixel, scene, None, matcher)


def _around(place: LocalMap, half_width: float) -> str:
    return f"within {half_width:.0f} m of {place.latitude:.4f}, {place.longitude:.4f} deg"


def _why_none(path: str | Path, place: LocalMap, half_width: float) -> str:
    """Where a file ends, and whether the 180th meridian has to do with it."""
    with _opened(path) as dataset:
        left, bottom, right, top = dataset.bounds
        reach = f"{left:.8g} to {right:.8g} east, {bottom:.8g} to {top:.8g} north"
        why = f"; the file reaches from {reach} in {_name(dataset.crs)}"
    longitude = abs((place.longitude + 180) % 360 - 180)
    if longitude + half_width / place.metres[0] > 180:
        why += (
            ". The 180th meridian crosses the square: both sides must be in one file, such as one "
            "in UTM"
        )
    return why


def _name(crs: Any) -> str:
    code = crs.to_epsg()
    return f"EPSG:{code}" if code else crs.to_wkt().split('"')[1]


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


def _lattice(dataset: Any, place: LocalMap) -> tuple[float, float, float]:
    """Spacing of the posts, and longitude and latitude of one of them, deg."""
    pixel = dataset.transform
    if _in_degrees(dataset):
        spacing = max(min(abs(pixel.a), abs(pixel.e)), FINEST)
        return spacing, pixel.c + pixel.a / 2, pixel.f + pixel.e / 2
    spacing = max(_pixel(dataset, place) / place.metres[1], FINEST)
    return spacing, place.longitude, place.latitude


def _in_degrees(dataset: Any) -> bool:
    """Whether rows and columns are circles of latitude and meridians."""
    crs, pixel = dataset.crs, dataset.transform
    straight = pixel.b == pixel.d == 0
    return crs.is_geographic and straight and crs.units_factor[0] == "degree"


def _pixel(dataset: Any, place: LocalMap) -> float:
    """The shorter side of a file's pixels at a place, m."""
    pixel, warp = dataset.transform, _rasterio("rasterio.warp")
    try:
        at = warp.transform(WGS84, dataset.crs, [place.longitude], [place.latitude])
        x = at[0][0] + np.array([0, pixel.a, pixel.b])
        y = at[1][0] + np.array([0, pixel.d, pixel.e])
        longitude, latitude = (np.array(a) for a in warp.transform(dataset.crs, WGS84, x, y))
        east, north = place.position(latitude, longitude)
        sides = np.hypot(np.diff(east[[1, 0, 2]]), np.diff(north[[1, 0, 2]]))
    except Exception:  # GDAL's own, of no public class: there is no such transformation
        sides = np.full(2, np.nan)
    if not (np.isfinite(sides).all() and sides.min() > 0):
        raise ValueError(
            f"{dataset.name} must have a map that shows {place.latitude:.4f}, "
            f"{place.longitude:.4f} deg; found {_name(dataset.crs)}, which does not"
        )
    return float(sides.min())


def _height_unit(dataset: Any, path: str | Path) -> float:
    """Metres of the unit that the file declares for its heights."""
    wkt, declared = dataset.crs.to_wkt(), dataset.units[0] or ""
    vertical = re.search(r'VERT(?:CRS|_CS)\[.*?(?:LENGTH)?UNIT\["([^"]+)"', wkt)
    named = [name.strip() for name in (declared, vertical[1] if vertical else "") if name.strip()]
    sizes = {name: (_METRES | _FEET).get(name.lower()) for name in named}
    known = [size or 0.0 for size in sizes.values()]
    if 0.0 in known or np.ptp([*known, *known[:1]] or [0.0]) > 1e-5:
        raise ValueError(
            f"{path} must hold heights in metres or feet; found the unit {' and '.join(named)}"
        )
    if not named and "foot" in dataset.crs.units_factor[0].lower():
        raise ValueError(
            f"{path} must declare the unit of its heights, since its map is in feet; found none. "
            "`rio edit-info --bidx 1 --units foot FILE`, or `metre`, does"
        )
    return next(iter(known), 1.0)


def _check_datum(dataset: Any, path: str | Path, geoid: float) -> None:
    """Compare what the file declares of its zero with the geoid that is given."""
    wkt = dataset.crs.to_wkt()
    found = re.search(r'VERT_CS\["([^"]+)",VERT_DATUM\["[^"]*",(\d+)', wkt)
    if found and found[2] == "2005" and geoid == 0:
        warnings.warn(
            f"{path}: heights count from sea level ({found[1]}), and geoid is 0; it should be the "
            "geoid's height above the ellipsoid there",
            stacklevel=4,
        )
    on_ellipsoid = bool(found and found[2] == "2002") or "CS[ellipsoidal,3]" in wkt
    if on_ellipsoid and geoid != 0:
        raise ValueError(
            f"{path} must count heights from sea level for a geoid of {geoid} m; found heights "
            "that count from the ellipsoid"
        )


def _void(dataset: Any, raw: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Where a pixel's part of the file holds what is no data in many files, declared or not.

    And where it holds nothing but 0: no measured number is that to its last digit.
    """
    void = np.isin(raw, _VOIDS) | (np.abs(low) > 1e20) | (np.abs(high) > 1e20)
    kind = np.dtype(dataset.dtypes[0])
    if kind.kind == "f":
        return void, (low == 0) & (high == 0)
    top = np.iinfo(kind).max
    largest = top * dataset.scales[0] + dataset.offsets[0]
    if kind.itemsize > 1 and (share := np.mean(high == largest)) > 0.01:
        raise ValueError(
            f"{dataset.name} must declare what stands for no data; found {100 * share:.0f} % of "
            f"its pixels at {top}, the largest of {kind}: if they are void, "
            f"`rio edit-info --nodata {top} FILE` does"
        )
    return void, np.zeros(void.shape, bool)


def _declared_unit(dataset: Any, path: str | Path, given: str | None) -> str | None:
    """The unit of an image that its band declares, if it does."""
    unit = (dataset.units[0] or "").strip()
    if re.fullmatch(r"db|decibels?", unit, re.I):
        return "dB"
    if re.fullmatch(r"linear|power|intensity|amplitude|natural|dn|digital number|1", unit, re.I):
        return "linear"
    if unit and unit.lower() != "unknown":
        raise ValueError(f"{path} must hold backscatter, in dB or linear; found the unit {unit!r}")
    name = dataset.descriptions[0] or ""
    if re.search(r"(^|[^a-z])(db|decibels?)($|[^a-z])", name, re.I):
        return "dB"
    if given is None and np.dtype(dataset.dtypes[0]).itemsize == 1:
        raise ValueError(
            f"{path} must tell whether it is in dB or linear; found {dataset.dtypes[0]}, as of a "
            f"picture for the eye: {_SAY}"
        )
    return None


def _sound_unit(path: str | Path, values: Array, unit: str | None) -> str:
    """That of an image, as it is said or as its pixels together tell."""
    measured = values[np.isfinite(values)]
    dark, middle, bright = np.percentile(measured, [1, 50, 99])
    below = float(np.mean(measured < 0))
    numbers = f"{100 * below:.3g} % below zero, the middle one {middle:.4g}"
    if unit is None:
        if below >= 0.55 and -100 < dark < -3:  # noise, subtracted, is as often above zero
            unit = "dB"
        elif middle > 100 or (
            below <= 0.1 and bright > 4 * max(dark, 0.0) and bright - middle > 1.5 * (middle - dark)
        ):
            unit = "linear"
        else:
            raise ValueError(
                f"{path} must tell whether it is in dB or linear; found pixels of which {numbers}: "
                f"{_SAY}"
            )
    if unit == "dB":
        if not (measured.min() > -100 and measured.max() < 150):
            worst = measured.min() if measured.min() <= -100 else measured.max()
            raise ValueError(
                f"{path} must hold from -100 to 150 dB; found {worst:.6g}. If that stands for no "
                f"data, `rio edit-info --nodata {worst:.6g} FILE` declares it"
            )
        return unit
    if below > 0.5:
        raise ValueError(
            f"{path} must hold intensity or amplitude; found pixels of which {numbers}"
        )
    if measured.min() < -bright:
        raise ValueError(
            f"{path} must hold intensity or amplitude; found {measured.min():.6g} where 99 % are "
            f"below {bright:.4g}. If that stands for no data, declare it: `rio edit-info --nodata`"
        )
    return unit


@contextmanager
def _opened(path: str | Path) -> Iterator[Any]:
    """A rasterio dataset whose pixels have places and hold real numbers."""
    rasterio = _rasterio("rasterio")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
        dataset = rasterio.open(path)
    with dataset:
        if dataset.crs is None:
            raise ValueError(
                f"{path} must have a coordinate reference system; found none: not a GeoTIFF, or "
                "one in radar geometry"
            )
        if dataset.transform.is_identity:
            raise ValueError(f"{path} must say where its pixels are; found no geotransform")
        if "complex" in dataset.dtypes[0]:
            raise ValueError(f"{path} must hold real numbers; found {dataset.dtypes[0]}")
        if (colour := dataset.colorinterp[0].name) in ("red", "palette"):
            raise ValueError(
                f"{path} must hold measured values; found a picture in colours: {colour}"
            )
        yield dataset


def _extremes(
    dataset: Any, corner: tuple[float, float], step: tuple[float, float], shape: tuple[int, int]
) -> tuple[Array, Array, Array]:
    """Of what each pixel of a grid is made from: smallest as stored; smallest, largest in units."""
    raw, top = (_warped(dataset, corner, step, shape, name, False) for name in ("min", "max"))
    both = [a * dataset.scales[0] + dataset.offsets[0] for a in (raw, top)]
    return raw, np.minimum(*both), np.maximum(*both)


def _warped(
    dataset: Any,
    corner: tuple[float, float],
    step: tuple[float, float],
    shape: tuple[int, int],
    resampling: str,
    in_units: bool = True,
) -> Array:
    """Values, NaN for none, at a grid of longitudes and latitudes; rows from north to south.

    The corner is the middle of its first pixel: east, north, deg. A file in degrees may count them
    from -180 to 180, from 0 to 360, or on: where it has none, those one turn away are looked at.
    """
    values = np.full(shape, np.nan)
    for turn in (0.0, -360.0, 360.0) if _in_degrees(dataset) else (0.0,):
        if (absent := np.isnan(values)).any():
            here = corner[0] + turn, corner[1]
            values[absent] = _warped_here(dataset, here, step, shape, resampling)[absent]
    return values * dataset.scales[0] + dataset.offsets[0] if in_units else values


def _warped_here(
    dataset: Any,
    corner: tuple[float, float],
    step: tuple[float, float],
    shape: tuple[int, int],
    resampling: str,
) -> Array:
    transform = _rasterio("rasterio").Affine(
        step[0], 0.0, corner[0] - step[0] / 2, 0.0, -step[1], corner[1] + step[1] / 2
    )
    try:
        with _rasterio("rasterio.vrt").WarpedVRT(
            dataset,
            crs=WGS84,
            transform=transform,
            height=shape[0],
            width=shape[1],
            resampling=_rasterio("rasterio.enums").Resampling[resampling],
            dtype="float64",
            nodata=_NOTHING,
        ) as warped:
            values = warped.read(1, masked=True).filled(np.nan)
    except _rasterio("rasterio.errors").RasterioIOError as error:
        why = error.__cause__ or error
        raise OSError(f"{dataset.name} is damaged, or cut: {why}") from None
    return np.where(np.isfinite(values), values, np.nan)


def _rasterio(module: str) -> Any:
    return needed(module, "navfilters[palsar]", "a GeoTIFF file")
