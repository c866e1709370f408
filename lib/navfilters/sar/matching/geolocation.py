"""Where the centre of an image is, by its matches with the reference."""

from typing import NamedTuple

import numpy as np

from navfilters.sar.images.ground_image import GroundImage
from navfilters.sar.matching.reference import Reference
from navfilters.space.frames import geodetic_to_ecef
from navfilters.types import Array


class Match(NamedTuple):
    """Where the centre pixel of an image is.

    Parameters
    ----------
    r_f : array (3,)
        Earth-fixed, m; NaN if there is no match.
    latitude, longitude, height : float
        Geodetic, deg, deg and m; NaN likewise.
    column, row : float
        In the reference, pixels, or with relief on a map of its size; NaN likewise.
    inliers : int
        Also of a match that was refused.
    affine : array (2, 3) or None
    """

    r_f: Array
    latitude: float
    longitude: float
    height: float
    column: float
    row: float
    inliers: int
    affine: Array | None


def paired_places(
    image: GroundImage, reference: Reference, *, relief: bool = True
) -> tuple[Array, Array]:
    """Places of the features that are alike, between which ``geolocate`` fits.

    Parameters
    ----------
    image : GroundImage
    reference : Reference
    relief : bool
        See ``geolocate``.

    Returns
    -------
    tuple of array (n, 2)
        Column and row in the image and in the reference, pixels; with relief, of the ground.
    """
    found = reference.matcher.features(image.values)
    mine, its = reference.matcher.pairs(found, reference.features)
    start, end = found.places[mine].astype(float), reference.features.places[its]
    if relief:
        end = reference.on_terrain[its, :2]
        start[:, 0] += _lean(image) * reference.on_terrain[its, 2]
    return start, end


def geolocate(image: GroundImage, reference: Reference, *, relief: bool = True) -> Match:
    """Match an image with the reference, and place its centre pixel on the Earth.

    Parameters
    ----------
    image : GroundImage
    reference : Reference
    relief : bool
        Whether the affine transformation is fitted between places on the terrain, each image having
        been relieved of the shift (height) / tan(incidence) of its own; or between the images as
        they are, as in the paper, which leaves a bias of up to a pixel where terrain is rough.

    Returns
    -------
    Match
        Of NaN if too few features agree, if the fit is not one of two images of the same scale, or
        if the centre falls outside of the reference: a result, not an error.

    Raises
    ------
    ValueError
        Pixels of another size.

    Notes
    -----
    Heights are those of the features of the reference, so that nothing of the image's position need
    be known. The text takes the centre of the bounding box, the nearest pixel of the reference and
    the nearest post of the elevation model; here the position is not rounded, and the height is
    interpolated: 90 m between posts would cost several metres of height.

    References
    ----------
    pogorelsky2020, section "Image geolocation".
    """
    if image.pixel != reference.pixel:
        raise ValueError(
            f"image must have pixels of {reference.pixel} m, as the reference; found {image.pixel}"
        )
    start, end = paired_places(image, reference, relief=relief)
    affine, inliers = reference.matcher.fit(start, end)
    nothing = Match(np.full(3, np.nan), np.nan, np.nan, np.nan, np.nan, np.nan, inliers, None)
    if affine is None:
        return nothing
    row, column = image.centre
    x, y = affine @ [column, row, 1.0]
    if relief:
        for _ in range(20):
            x, y = affine @ [column + _lean(image) * float(reference.height(x, y)), row, 1.0]
    rows, columns = reference.values.shape
    if not (0 <= x <= columns - 1 and 0 <= y <= rows - 1):
        return nothing
    if relief:
        latitude, longitude = (float(a) for a in reference.geodetic(x, y))
        height = float(reference.scene.terrain.height(latitude, longitude))
    else:
        latitude, longitude, height = (float(a) for a in reference.ground(x, y))
    r_f = geodetic_to_ecef(latitude, longitude, height)
    return Match(r_f, latitude, longitude, height, float(x), float(y), inliers, affine)


def _lean(image: GroundImage) -> float:
    """By how many columns a metre of height displaces a feature."""
    return float(1 / (np.tan(image.incidence) * image.pixel))
