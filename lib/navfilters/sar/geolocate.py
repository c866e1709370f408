"""Where on the Earth an image was taken, by matching it with a geocoded reference image.

OpenCV detects and matches features (SIFT; the paper has SURF, which its packages lack) and fits an
affine transformation by RANSAC. The reference is another radar image: seen by another pass under
another angle, with other speckle, projected like the image onto ground of one height; or an
orthoimage, whose pixels stand where the ground is. Each of its pixels knows its latitude and
longitude on the true terrain.
"""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from navfilters import validation
from navfilters._extras import needed
from navfilters.frames import geodetic_to_ecef
from navfilters.sar.focus import GroundImage, decibels
from navfilters.sar.scene import Scene, View
from navfilters.types import Array


class Features(NamedTuple):
    """What SIFT found in an image.

    Parameters
    ----------
    places : array (n, 2) of float32
        Column and row, pixels.
    descriptors : array (n, 128) of float32
    """

    places: Array
    descriptors: Array


@dataclass(frozen=True)
class Matcher:
    """How features are found, paired and fitted.

    Parameters
    ----------
    inliers : int
        A match needs so many; at least 3.
    ratio : float
        Lowe's: a pair counts if its distance is below this times that to the second best.
    tolerance : float
        Of an inlier, pixels.
    contrast : float
        SIFT's contrast threshold.
    sigma : float
        SIFT's first scale, pixels: above 1.6 it suppresses speckle.
    stretch : float
        Pixels of both images have the same size: a fit that scales by more than this factor, either
        way and in any direction, or mirrors, is refused.
    seed : int
        Of RANSAC.

    Raises
    ------
    ValueError
        Naming the argument, the value found and what is needed.

    References
    ----------
    pogorelsky2020, section "Image geolocation". The least number of inliers is ours.
    """

    inliers: int = 8
    ratio: float = 0.8
    tolerance: float = 3.0
    contrast: float = 0.03
    sigma: float = 2.0
    stretch: float = 1.15
    seed: int = 0

    def __post_init__(self) -> None:
        validation.whole_number("inliers", self.inliers, 3)
        validation.whole_number("seed", self.seed, 0)
        for name, low, high in (
            ("ratio", 0.0, 1.0),
            ("tolerance", 0.0, np.inf),
            ("contrast", 0.0, np.inf),
            ("sigma", 0.0, np.inf),
            ("stretch", 1.0, np.inf),
        ):
            if not low < getattr(self, name) <= high:
                raise ValueError(
                    f"{name} must be above {low} and at most {high}; found {getattr(self, name)}"
                )

    def features(self, values: Array) -> Features:
        """SIFT of an image in dB, stretched to 8 bits between its 1st and 99th percentile.

        Parameters
        ----------
        values : array (rows, columns)
            dB.

        Returns
        -------
        Features

        Raises
        ------
        ValueError
            A value that is not finite.
        ImportError
            Without OpenCV.
        """
        if not np.isfinite(values).all():
            count = int((~np.isfinite(values)).sum())
            raise ValueError(f"values must be finite; found {count} that are not")
        low, high = np.percentile(values, [1, 99])
        grey = np.clip((values - low) / max(high - low, 1e-9), 0, 1) * 255
        sift = _cv2().SIFT_create(
            contrastThreshold=self.contrast,
            sigma=self.sigma,
            enable_precise_upscale=True,  # or every place is a quarter of a pixel off
        )
        points, descriptors = sift.detectAndCompute(grey.round().astype(np.uint8), None)
        if descriptors is None:
            return Features(np.zeros((0, 2), np.float32), np.zeros((0, 128), np.float32))
        places = np.array([point.pt for point in points], np.float32)
        return Features(places, descriptors)

    def pairs(self, image: Features, reference: Features) -> tuple[Array, Array]:
        """Features that are more alike than any other two: Lowe's ratio test.

        Parameters
        ----------
        image, reference : Features

        Returns
        -------
        tuple of ndarray (n,) of int
            Indices into both.
        """
        if len(image.places) == 0 or len(reference.places) < 2:
            return np.zeros(0, int), np.zeros(0, int)
        matcher = _cv2().BFMatcher(_cv2().NORM_L2)
        two = matcher.knnMatch(image.descriptors, reference.descriptors, k=2)
        good = [a for a, b in two if a.distance < self.ratio * b.distance]
        pairs = np.array([(a.queryIdx, a.trainIdx) for a in good], int).reshape(-1, 2)
        return pairs[:, 0], pairs[:, 1]

    def fit(self, start: Array, end: Array) -> tuple[Array | None, int]:
        """The affine transformation between paired places, by RANSAC.

        Parameters
        ----------
        start, end : array (n, 2)
            Column and row, pixels.

        Returns
        -------
        affine : ndarray (2, 3) or None
            Of (column, row, 1); None if too few pairs agree, or if it is refused.
        inliers : int
            How many agree, also if it is refused.
        """
        if len(start) < self.inliers:
            return None, 0
        cv2 = _cv2()
        cv2.setRNGSeed(self.seed)
        affine, kept = cv2.estimateAffine2D(
            np.asarray(start, np.float32),
            np.asarray(end, np.float32),
            method=cv2.RANSAC,
            ransacReprojThreshold=self.tolerance,
            maxIters=5000,
            confidence=0.999,
            refineIters=20,
        )
        count = 0 if affine is None else int(kept.sum())
        if affine is None or count < self.inliers:
            return None, count
        scales = np.linalg.svd(affine[:, :2], compute_uv=False)
        sound = 1 / self.stretch <= scales[1] and scales[0] <= self.stretch
        return (affine if sound and np.linalg.det(affine[:, :2]) > 0 else None), count


MATCHER = Matcher()


@dataclass(frozen=True, eq=False)
class Reference:
    """A geocoded reference image, north up.

    Parameters
    ----------
    values : array (rows, columns) of float32
        dB, rows from north to south. The middle pixel is the middle of the scene's map.
    pixel : float
        m, on the scene's map.
    scene : Scene
        Whose map and elevation model the onboard computer has.
    view : View or None
        From where the reference was taken; None for an orthoimage, in which no terrain leans.
    matcher : Matcher

    Attributes
    ----------
    features : Features
        Of the image.
    on_terrain : array (n, 3)
        Where these features are in truth: column and row of a map, and height above the middle, m.
    """

    values: Array
    pixel: float
    scene: Scene
    view: View | None
    matcher: Matcher = MATCHER
    features: Features = field(init=False, repr=False)
    on_terrain: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        features = self.matcher.features(self.values)
        x, y, height = self._terrain(*features.places.T)
        object.__setattr__(self, "features", features)
        object.__setattr__(self, "on_terrain", np.stack([*self._place(x, y), height], axis=1))

    def ground(self, column: Any, row: Any) -> tuple[Array, Array, Array]:
        """Latitude, longitude and height of the terrain that a pixel shows.

        Parameters
        ----------
        column, row : array (...)
            Pixels, also between them.

        Returns
        -------
        tuple of ndarray (...)
            Geodetic, deg, deg and m above the ellipsoid; NaN outside of the elevation model.

        Notes
        -----
        Terrain is shifted towards the radar by what it is higher than the middle, over the tangent
        of the incidence; not in an orthoimage. The shift is undone by iteration, which converges
        where no slope is steep enough to be laid over.
        """
        x, y, height = self._terrain(column, row)
        return *self.scene.map.geodetic(x, y), height + self.scene.height(0.0, 0.0)

    def height(self, column: Any, row: Any) -> Array:
        """Of the terrain at a place of a map with the image's pixels, above the middle.

        Parameters
        ----------
        column, row : array (...)
            Where the terrain is, not where the image shows it.

        Returns
        -------
        ndarray (...)
            m.
        """
        return self.scene.height(*self._position(column, row)) - self.scene.height(0.0, 0.0)

    def geodetic(self, column: Any, row: Any) -> tuple[Array, Array]:
        """Latitude and longitude of a place of that map, deg.

        Parameters
        ----------
        column, row : array (...)

        Returns
        -------
        tuple of ndarray (...)
        """
        return self.scene.map.geodetic(*self._position(column, row))

    def _terrain(self, column: Any, row: Any) -> tuple[Array, Array, Array]:
        """East, north and height above the middle of what pixels show, m."""
        east, north = self._position(column, row)
        level = self.scene.height(0.0, 0.0)
        if self.view is None:
            return east, north, self.scene.height(east, north) - level
        away = self.view.axes[1]
        x, y, height = east, north, np.zeros_like(east)
        for _ in range(20):
            height = self.scene.height(x, y) - level
            shift = height / np.tan(self.view.incidence)
            x, y = east + shift * away[0], north + shift * away[1]
        return x, y, height

    def _position(self, column: Any, row: Any) -> tuple[Array, Array]:
        """East and north of places, m."""
        rows, columns = self.values.shape
        east = (np.asarray(column, float) - columns // 2) * self.pixel
        return east, (rows // 2 - np.asarray(row, float)) * self.pixel

    def _place(self, east: Array, north: Array) -> tuple[Array, Array]:
        rows, columns = self.values.shape
        return columns // 2 + east / self.pixel, rows // 2 - north / self.pixel


def form_reference(
    scene: Scene,
    view: View,
    *,
    half_width: float = 7000.0,
    pixel: float = 10.0,
    looks: float = 8.0,
    noise: float = -23.0,
    speckle: Any = 0,
    matcher: Matcher = MATCHER,
) -> Reference:
    """The reference image of a scene: facets in another pass's geometry, with its own speckle.

    Parameters
    ----------
    scene : Scene
    view : View
        Of that pass. Rays are parallel if its range is infinite.
    half_width : float
        Of the square, m.
    pixel : float
        m.
    looks : float
        Of the speckle's gamma distribution, independent in each pixel.
    noise : float
        Noise-equivalent reflectivity, dB.
    speckle : int or sequence of int
        Seed.
    matcher : Matcher

    Returns
    -------
    Reference

    Raises
    ------
    ValueError
        Naming the argument, the value found and what is needed.
    """
    for name, value in (("half_width", half_width), ("pixel", pixel), ("looks", looks)):
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name} must be a positive number; found {value}")
    half = int(half_width / pixel)
    n, step = 2 * half + 1, pixel / 2
    turn = abs(np.sin(2 * view.heading)) / 2
    reach = np.ceil(half_width * np.sqrt(1 + 2 * turn) / step + 1)
    along = np.arange(-reach, reach + 1) * step
    shifts = 400.0 / np.tan(view.incidence)  # relief may bring ground in from beyond the edge
    across = np.arange(-reach - shifts // step, reach + shifts // step + 1) * step
    power, height = scene.returns(view, along, across)
    flight, away = view.axes
    level = scene.height(0.0, 0.0)
    seen = across - (height - level) / np.tan(view.incidence)
    total = np.zeros(n * n, np.float32)
    for rows in np.array_split(np.arange(len(along)), 8):  # in parts, to save memory
        x = along[rows, None] * flight[0] + seen[rows] * away[0]
        y = along[rows, None] * flight[1] + seen[rows] * away[1]
        _add(total, n, x / pixel + half, half - y / pixel, power[rows])
    east, north, bright = scene.points
    shift = (scene.height(east, north) - level) / np.tan(view.incidence)
    x, y = east - shift * away[0], north - shift * away[1]
    _add(total, n, x / pixel + half, half - y / pixel, bright)
    area = pixel * pixel
    power = total.reshape(n, n) + area * 10 ** (noise / 10)
    gamma = np.random.default_rng(speckle).standard_gamma(looks, (n, n), dtype=np.float32)
    values = decibels(power * gamma / np.float32(looks)).astype(np.float32)
    return Reference(values, pixel, scene, view, matcher)


def _add(total: Array, n: int, column: Array, row: Array, power: Array) -> None:
    """Share powers linearly between the four nearest of n by n pixels, in place."""
    inside = (column >= 0) & (column < n - 1) & (row >= 0) & (row < n - 1)
    column, row, power = column[inside], row[inside], power[inside]
    j, i = column.astype(np.int64), row.astype(np.int64)
    column, row = column - j, row - i
    for di, in_row in ((0, 1 - row), (1, row)):
        for dj, in_column in ((0, 1 - column), (1, column)):
            index = (i + di) * n + j + dj
            total += np.bincount(index, power * in_row * in_column, total.size).astype(np.float32)


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
    matcher = reference.matcher
    found = matcher.features(image.values)
    mine, its = matcher.pairs(found, reference.features)
    start, end = found.places[mine].astype(float), reference.features.places[its]
    lean = 0.0
    if relief:
        lean = 1 / (np.tan(image.incidence) * image.pixel)
        end = reference.on_terrain[its, :2]
        start[:, 0] += lean * reference.on_terrain[its, 2]
    affine, inliers = matcher.fit(start, end)
    nothing = Match(np.full(3, np.nan), np.nan, np.nan, np.nan, np.nan, np.nan, inliers, None)
    if affine is None:
        return nothing
    row, column = image.centre
    x, y = affine @ [column, row, 1.0]
    if relief:
        for _ in range(20):
            x, y = affine @ [column + lean * float(reference.height(x, y)), row, 1.0]
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


def _cv2() -> Any:
    return needed("cv2", "navfilters[sar]", "geolocation")
