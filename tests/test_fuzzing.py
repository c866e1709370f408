"""Readers of files under random damage: what they read, or an error that names the file.

NAVFILTERS_FUZZ=100000 asks for more inputs than the few that every run makes.
"""

import importlib.util
import os
import sys
import tracemalloc
import warnings
from datetime import datetime

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from palsar_files import IMAGE, LEADER, NAME

from navfilters.book import claims
from navfilters.book.claims.statements import load_statements
from navfilters.diagnosis import LogError, read_log
from navfilters.sar.ground.land_cover import LandCover
from navfilters.sar.ground.scene import Points, Scene
from navfilters.sar.ground.terrain import LocalMap, Terrain
from navfilters.sar.palsar.geotiff_reader import median_height, read_reference, read_terrain
from navfilters.sar.palsar.opening import open_product
from navfilters.tracking import read_coefficients, read_observations, read_settings

INPUTS = int(os.environ.get("NAVFILTERS_FUZZ", "60"))
MEMORY = 20  # MiB beyond the file, where a line of text becomes a row of numbers
RESIDENT = 200  # MiB by which a process may grow that reads many
LOG = b"time,innovation_1,S_11\n" + b"".join(b"%d,0.5,2.0\n" % k for k in range(5))
TRACK = b"""2010-11-02T03:00:10.5  RANGE  Uralla  38014.9488
2010-11-02T03:00:05  AZ_EL  Kumsan  180.0  45.0
"""
SETTINGS = b"a.b = 1.5\nc[1] = two words\n# a comment\n"
FIELD = b"2 0 -0.484165371736e-03 0.0\n2 1 0.0 0.0\n2 2 0.24e-5 -0.14e-5\n"
EPOCH = datetime(2010, 11, 2, 3)
PLACE = LocalMap(30.0, -95.0)
LEDGER = b"""[word.much]
meaning = "a ratio"
rule = { at_least = 10 }
[[claim]]
id = "some-claim"
chapter = "a/b"
source = "perea2007, Fig. 1"
statement = "Words."
kind = "bound"
threshold = "ours"
word = "much"
paper_value = { at_least = 10 }
revised = [{ was = "a rule", why = "a reason" }]
ours = { left = 1.5, right = [1, 2] }
verdict = "not reproduced"
reason = "a reason"
"""
STATEMENTS = b"""[[statement]]
id = "some-1"
work = "perea2007"
section = "1"
what = "figure"
text = "Words."
claims = ["some-claim"]
"""


def missing(module):
    return [] if importlib.util.find_spec(module) else [pytest.mark.skip(f"needs {module}")]


def geotiff(path):
    """Heights of 24 by 24 posts in degrees, deflated, as most are that one downloads."""
    import geotiff_files

    posts = (200 + np.add.outer(np.arange(24), np.arange(24))).astype("int16")
    return geotiff_files.dem(path, posts, place=PLACE, compress="deflate").read_bytes()


def parquet(path):
    from navfilters.diagnosis import Log, write_log

    log = Log(np.arange(5.0), np.full((5, 1), 0.5), np.full((5, 1, 1), 2.0))
    return write_log(log, path).read_bytes()


def image_tiff(path):
    """Backscatter in dB, 24 by 24 pixels of 30 m."""
    import geotiff_files

    decibels = np.round(geotiff_files.backscatter(size=24))
    return geotiff_files.image(path, decibels, 30.0, PLACE, compress="deflate").read_bytes()


def backscatter_of(path):
    none = np.zeros(0)
    flat = Terrain(np.zeros((41, 41)), 29.98, -95.02, 1e-3)
    scene = Scene(PLACE, flat, LandCover(np.ones((1, 1)), 1.0), Points(none, none, none))
    read_reference(path, scene, half_width=300.0, pixel=30.0, needed=200.0)


def heights_of(path):
    median_height(path, PLACE, 300.0)
    read_terrain(path, PLACE, 300.0)


def orbit_of(path):
    (path.parent / f"IMG-HH-{NAME}").write_bytes(IMAGE)
    open_product(path.parent)


def image_of(path):
    (path.parent / f"LED-{NAME}").write_bytes(LEADER)
    open_product(path.parent)


READERS = {
    "leader": (f"LED-{NAME}", bytes(LEADER), orbit_of, ValueError),
    "image": (f"IMG-HH-{NAME}", bytes(IMAGE), image_of, ValueError),
    "log": ("log.csv", LOG, read_log, LogError),
    "observations": (
        "track.txt",
        TRACK,
        lambda path: read_observations(path, ("Uralla", "Kumsan"), EPOCH),
        ValueError,
    ),
    "settings": ("some.in", SETTINGS, read_settings, ValueError),
    "coefficients": ("field", FIELD, lambda path: read_coefficients(path, 2), ValueError),
    "ledger": ("claims.toml", LEDGER, claims.load, claims.ClaimError),
    "statements": ("statements.toml", STATEMENTS, load_statements, claims.ClaimError),
    "geotiff": ("dem.tif", geotiff, heights_of, (ValueError, OSError)),
    "reference": ("image.tif", image_tiff, backscatter_of, (ValueError, OSError)),
    "parquet": ("log.parquet", parquet, read_log, LogError),
}
NEEDS = {"parquet": missing("pyarrow")} | dict.fromkeys(
    ("geotiff", "reference"), missing("rasterio")
)


def resident():
    """The most memory that the process ever had, bytes: what libraries in C take is in it."""
    if sys.platform == "win32":
        return 0
    import resource

    unit = 1 if sys.platform == "darwin" else 1024
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


@st.composite
def damaged(draw, valid):
    """A valid file with some bytes written over, inserted or cut out; or bytes of any kind."""
    data = bytearray(valid)
    for _ in range(draw(st.integers(0, 4))):
        at = draw(st.integers(0, max(len(data) - 1, 0)))
        new = draw(st.binary(max_size=12) | st.from_regex(rb"[0-9eE+. ,-]{1,12}", fullmatch=True))
        data[at : at + draw(st.sampled_from([0, len(new), 30]))] = new
    cut = draw(st.just(len(data)) | st.integers(0, len(data)))
    return bytes(data[:cut])


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=NEEDS.get(name, [])) for name in READERS]
)
def test_a_damaged_file_is_read_or_named(name, tmp_path):
    file, valid, reader, refusal = READERS[name]
    path = tmp_path / file
    valid = valid(path) if callable(valid) else valid
    most = resident()

    @settings(max_examples=INPUTS, suppress_health_check=list(HealthCheck), deadline=5000)
    @given(data=damaged(valid) | st.binary(max_size=300))
    def check(data):
        path.write_bytes(data)
        tracemalloc.start()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of what is odd and read all the same
                reader(path)
        except refusal as error:
            assert path.name in str(error), error  # noqa: PT017, any text is right if it has it
        finally:
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
        assert peak < MEMORY * 2**20
        assert resident() - most < RESIDENT * 2**20

    path.write_bytes(valid)
    reader(path)
    check()
