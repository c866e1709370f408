"""Every reader of files: valid files of its kind, what it must raise, and what passes.

``make fuzz`` and ``tests/test_fuzzing.py`` give each of them damaged files.
"""

import importlib.util
import sys
import tracemalloc
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
import valid_files as files
from palsar_files import IMAGE, LEADER, NAME
from valid_files import PLACE

from navfilters.book import claims
from navfilters.book.claims import ledger
from navfilters.book.claims.statements import load_statements
from navfilters.diagnosis import LogError, read_log
from navfilters.sar.ground.land_cover import LandCover
from navfilters.sar.ground.scene import Points, Scene
from navfilters.sar.ground.terrain import Terrain
from navfilters.sar.palsar.geotiff_reader import median_height, read_reference, read_terrain
from navfilters.sar.palsar.opening import open_product
from navfilters.tracking import read_coefficients, read_observations, read_settings

MEMORY = 8  # MiB of Python's objects beyond twice the file
RESIDENT = 200  # MiB by which a process may grow that reads many

EPOCH = datetime(2010, 11, 2, 3)


def orbit_of(path: Path) -> None:
    partner(path.parent / f"IMG-HH-{NAME}", IMAGE)
    open_product(path.parent)


def image_of(path: Path) -> None:
    partner(path.parent / f"LED-{NAME}", LEADER)
    open_product(path.parent)


def partner(path: Path, data: bytes) -> None:
    """The other file of a product, which is whole."""
    if not path.exists():
        path.write_bytes(data)


def heights_of(path: Path) -> None:
    median_height(path, PLACE, 300.0)
    read_terrain(path, PLACE, 300.0)


def backscatter_of(path: Path) -> None:
    none = np.zeros(0)
    flat = Terrain(np.zeros((41, 41)), 29.98, -95.02, 1e-3)
    scene = Scene(PLACE, flat, LandCover(np.ones((1, 1)), 1.0), Points(none, none, none))
    read_reference(path, scene, half_width=300.0, pixel=30.0, needed=200.0)


def claims_of(path: Path) -> None:
    """Read anew: the ledger keeps what it read until the file's time changes, in steps of 4 ms."""
    ledger._load.cache_clear()
    claims.load(path)


def settings_of(path: Path) -> None:
    """Read, and every setting asked for as a number, a date and one of many."""
    read = read_settings(path)
    for key, index in read.values:
        for ask in (lambda k=key, i=index: read.number(k, i), lambda k=key: read.numbers(k),
                    lambda k=key: read.date(k)):  # fmt: skip
            try:
                ask()
            except ValueError as error:
                assert path.name in str(error), error  # noqa: PT017


def track_of(path: Path) -> None:
    read_observations(path, ("Uralla", "Kumsan"), EPOCH)


@dataclass(frozen=True)
class Reader:
    """One kind of file.

    Parameters
    ----------
    file : str
        Its name.
    layout : str
        "ceos leader", "ceos image", "tiff", "text" or "parquet": what damage of its own it meets.
    valid : function
        Of a path that it may write to; bytes of files that are read.
    read : function
        Of a path.
    refusal : exception, or several
        What it may raise, naming the file.
    modules : tuple of str
        Which parts of the library read it.
    package : str
        What is needed for it, "" for nothing more.
    """

    file: str
    layout: str
    valid: Callable[[Path], list[bytes]]
    read: Callable[[Path], object]
    refusal: type[Exception] | tuple[type[Exception], ...]
    modules: tuple[str, ...]
    package: str = ""

    @property
    def missing(self) -> bool:
        """Whether what it needs is not installed."""
        return bool(self.package) and importlib.util.find_spec(self.package) is None


def texts(*whole: bytes) -> Callable[[Path], list[bytes]]:
    return lambda path: list(whole)


PALSAR, TRACKING, CLAIMS = "navfilters.sar.palsar", "navfilters.tracking.files", "navfilters.book"
ANY_FAULT = (ValueError, OSError)
ENTRIES = tuple(f"{CLAIMS}.claims.{module}" for module in ("entries", "ledger"))
READERS = {
    "leader": Reader(f"LED-{NAME}", "ceos leader", files.leaders, orbit_of, ValueError, (PALSAR,)),
    "image": Reader(f"IMG-HH-{NAME}", "ceos image", files.images, image_of, ValueError, (PALSAR,)),
    "log": Reader(
        "log.csv",
        "text",
        texts(files.LOG, files.LONGER_LOG),
        read_log,
        LogError,
        ("navfilters.diagnosis.log_file",),
    ),
    "parquet": Reader(
        "log.parquet",
        "parquet",
        files.parquet,
        read_log,
        LogError,
        ("navfilters.diagnosis.log_file",),
        "pyarrow",
    ),
    "observations": Reader(
        "track.txt",
        "text",
        texts(files.TRACK, files.LONGER_TRACK),
        track_of,
        ValueError,
        (TRACKING,),
    ),
    "settings": Reader(
        "some.in",
        "text",
        texts(files.SETTINGS, files.LONGER_SETTINGS),
        settings_of,
        ValueError,
        (TRACKING,),
    ),
    "coefficients": Reader(
        "field",
        "text",
        texts(files.FIELD, files.LONGER_FIELD),
        lambda path: read_coefficients(path, 2),
        ValueError,
        (TRACKING,),
    ),
    "ledger": Reader(
        "claims.toml",
        "text",
        texts(files.LEDGER, files.LEDGER + files.MORE_CLAIMS),
        claims_of,
        claims.ClaimError,
        ENTRIES,
    ),
    "statements": Reader(
        "statements.toml",
        "text",
        texts(files.STATEMENTS, files.STATEMENTS + files.MORE_STATEMENTS),
        load_statements,
        claims.ClaimError,
        (*ENTRIES, f"{CLAIMS}.claims.statements"),
    ),
    "heights": Reader(
        "dem.tif", "tiff", files.heights, heights_of, ANY_FAULT, (PALSAR,), "rasterio"
    ),
    "reference": Reader(
        "image.tif", "tiff", files.pictures, backscatter_of, ANY_FAULT, (PALSAR,), "rasterio"
    ),
}


def outcome(reader: Reader, path: Path) -> str:
    """What became of a file: "read" or "refused".

    Raises
    ------
    AssertionError
        It was refused without its name.
    Exception
        Any that is no refusal.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of what is odd and read all the same
        try:
            reader.read(path)
        except reader.refusal as error:
            assert path.name in str(error), error  # noqa: PT017, any text is right if it has it
            return "refused"
    return "read"


def measured(reader: Reader, path: Path) -> tuple[str, int]:
    """The same, and the most bytes that Python's objects took meanwhile."""
    tracemalloc.start()
    try:
        return outcome(reader, path), tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def resident() -> int:
    """The most memory that the process ever had, bytes: what libraries in C take is in it."""
    if sys.platform == "win32":
        return 0
    import resource

    unit = 1 if sys.platform == "darwin" else 1024
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
