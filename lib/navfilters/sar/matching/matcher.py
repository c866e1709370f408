"""Features of images, and how they are paired."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from navfilters.numerics import validation
from navfilters.numerics.extras import needed
from navfilters.sar.in_parts import blocks
from navfilters.types import Array


class Features(NamedTuple):
    """What SIFT found in an image.

    Parameters
    ----------
    places : array (n, 2) of float32
        Column and row, pixels.
    descriptors : array (n, 128) of float32
    contrast : array (n,) of float32
        Threshold up to which each is found.
    """

    places: Array
    descriptors: Array
    contrast: Array

    def above(self, contrast: float) -> "Features":
        """Those that a higher threshold leaves.

        Parameters
        ----------
        contrast : float

        Returns
        -------
        Features
        """
        return Features(*(a[self.contrast >= np.float32(contrast)] for a in self))


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
            return Features(*(np.zeros((0, *n), np.float32) for n in ((2,), (128,), ())))
        places = np.array([point.pt for point in points], np.float32)
        contrast = 3 * np.array([point.response for point in points], np.float32)  # of 3 layers
        return Features(places, descriptors, contrast)

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
        index, nearest, second = _two_nearest(image.descriptors, reference.descriptors)
        good = np.flatnonzero(nearest < self.ratio * second)
        return good, index[good]

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

LINES, PIECE = 64, 32
"""Features in a product of descriptors: so few that BLAS starts no threads, which would wait."""


def _two_nearest(of: Array, among: Array) -> tuple[Array, Array, Array]:
    """Which descriptor is nearest to each, its distance, and that of the next.

    Distances are exact: SIFT's descriptors are whole numbers, the sums of whose squares single
    precision holds.
    """
    n, m = len(of), -(-len(among) // PIECE) * PIECE
    padded = np.zeros((m, among.shape[1]), np.float32)
    padded[: len(among)] = among
    half = np.full(m, np.inf, np.float32)  # |a - b|^2 / 2 = |a|^2 / 2 + (|b|^2 / 2 - a . b)
    half[: len(among)] = np.einsum("ij,ij->i", among, among) / 2
    pieces = padded.reshape(-1, PIECE, padded.shape[1]).mT
    index, less = np.empty(n, int), np.empty((2, n), np.float32)
    for lines in blocks(n, LINES):
        here = of[lines]
        beyond, row = np.empty((len(here), m), np.float32), np.arange(len(here))
        np.matmul(here, pieces, out=beyond.reshape(len(here), -1, PIECE).swapaxes(0, 1))
        np.subtract(half, beyond, out=beyond)
        index[lines] = first = beyond.argmin(axis=1)
        less[0, lines] = beyond[row, first]
        beyond[row, first] = np.inf
        less[1, lines] = beyond.min(axis=1)
    distance = np.sqrt(np.einsum("ij,ij->i", of, of) + 2 * less).astype(float)
    return index, distance[0], distance[1]


def _cv2() -> Any:
    return needed("cv2", "navfilters[sar]", "geolocation")
