"""Sets of three images as they were computed last, beside the library."""

from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np

from navfilters.papers.pogorelsky2020.image_tables import ImageTable
from navfilters.papers.pogorelsky2020.own_images import OwnImages
from navfilters.runs import stored_arrays

FILE = "own_images.npz"
JOB = "own images, format 1"


def write_own(path: Any, found: OwnImages) -> None:
    """Store sets of images, whole or not at all.

    Parameters
    ----------
    path : path
    found : OwnImages
    """
    arrays = {
        name: np.array([[getattr(t, name) for t in of_k] for of_k in found.variance])
        for name in ImageTable._fields
    }
    entropy = np.array([[t.sharpness for t in of_k] for of_k in found.entropy])
    stored_arrays.save(Path(path), JOB, **arrays, entropy=entropy, normal=found.normal)


def read_own(path: Any = None) -> OwnImages:
    """Stored sets of images.

    Parameters
    ----------
    path : path, optional
        By default the library's own.

    Returns
    -------
    OwnImages

    Raises
    ------
    ValueError
        A file that is damaged or not there, or of another kind.
    """
    names, place = ImageTable._fields, path
    if place is None:
        place = files("navfilters.papers.pogorelsky2020") / FILE
        with as_file(place) as file:
            return read_own(file)
    arrays = stored_arrays.load(
        Path(place),
        JOB,
        (*names, "entropy", "normal"),
        kind="file of own images",
        remedy="the command with --out makes it again",
    )
    if arrays is None:
        raise ValueError(f"path must be a file of own images; found none at {place}")
    *fields, entropy, normal = arrays
    by_k = [
        [ImageTable(*row) for row in zip(*of_k, strict=True)] for of_k in zip(*fields, strict=True)
    ]
    other = [
        [t._replace(sharpness=s) for t, s in zip(of_k, curves, strict=True)]
        for of_k, curves in zip(by_k, entropy, strict=True)
    ]
    return OwnImages(by_k, other, normal)
