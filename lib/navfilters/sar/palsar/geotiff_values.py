"""What the numbers of a GeoTIFF mean: datum, units, voids."""

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from navfilters.numerics.extras import needed
from navfilters.sar.ground.terrain import LocalMap
from navfilters.types import Array

WGS84 = "EPSG:4326"

FINEST = 1e-4
"""Elevation models are not read at a finer spacing, deg: about 11 m."""

UNITS = ("dB", "linear")
"""What a reference image may hold; linear is intensity or amplitude, at any scale."""

_NOTHING = -1e30  # stands for no data while GDAL works

_VOIDS = (-32768, -32767, -99999, -9999, -999)  # what files hold for no data, often undeclared

_FEET = {"foot": 0.3048, "feet": 0.3048, "ft": 0.3048, "international foot": 0.3048}
_FEET |= dict.fromkeys(("us survey foot", "ftus", "us-ft", "foot_us"), 1200 / 3937)

_METRES = {"": 1.0} | dict.fromkeys(("m", "metre", "metres", "meter", "meters", "unknown"), 1.0)

_BANDS = 1000  # which GDAL reads together where they are stored so, though only one is wanted

_SHORE = 50.0  # m, that hardly any shore is high on the whole

_STEEP = 10.0  # rise over run that hardly any ground has between neighbouring posts

_SAY = 'say unit="dB" or unit="linear" (--reference-unit)'


def _name(crs: Any) -> str:
    code = crs.to_epsg()
    return f"EPSG:{code}" if code else crs.to_wkt().split('"')[1]


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
            "that count from the ellipsoid: leave the geoid out"
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
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
            dataset = rasterio.open(path)
        with dataset:
            _check_pixels(dataset, path)
            yield dataset
    except UnicodeDecodeError as error:  # of a unit, or of the name of a map
        raise ValueError(f"{path} must hold its texts in UTF-8; found {error}") from None


def _check_pixels(dataset: Any, path: str | Path) -> None:
    """Refuse a file that does not say where its pixels are, or holds no measured numbers."""
    if dataset.count > _BANDS:
        raise ValueError(f"{path} must hold at most {_BANDS} bands; found {dataset.count}")
    if dataset.crs is None:
        raise ValueError(
            f"{path} must have a coordinate reference system; found none: not a GeoTIFF, or "
            "one in radar geometry"
        )
    if dataset.transform.is_identity:
        raise ValueError(f"{path} must say where its pixels are; found no geotransform")
    if not np.isfinite(dataset.transform).all():
        raise ValueError(
            f"{path} must say where its pixels are; found a geotransform that is not finite"
        )
    if "complex" in dataset.dtypes[0]:
        raise ValueError(f"{path} must hold real numbers; found {dataset.dtypes[0]}")
    if (colour := dataset.colorinterp[0].name) in ("red", "palette"):
        raise ValueError(f"{path} must hold measured values; found a picture in colours: {colour}")


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
