"""Valid files of every kind that the library reads, as bytes."""

from pathlib import Path

import numpy as np
from logs import kalman_log
from palsar_files import IMAGE, LEADER, image_bytes, leader_bytes, motion, state_rows

from navfilters.diagnosis import Log, write_log
from navfilters.sar.ground.terrain import LocalMap

LOG = b"time,innovation_1,S_11\n" + b"".join(b"%d,0.5,2.0\n" % k for k in range(5))
LONGER_LOG = b"""\xef\xbb\xbftime, innovation_1,innovation_2,S_1_1,S_12,S_22,note,error_1,P_11
0,0.5,,2.0,0.1,1.0,first,0.1,0.04
0.5,-0.25,1e-3,2.0,0.1,1.0,"second, late",0.2,0.04
"""
TRACK = b"""2010-11-02T03:00:10.5  RANGE  Uralla  38014.9488
2010-11-02T03:00:05  AZ_EL  Kumsan  180.0  45.0
"""
LONGER_TRACK = b"# two stations\n\n" + 3 * TRACK.replace(b"180.0", b"-1.5e1")
SETTINGS = b"a.b = 1.5\nc[1] = two words\n# a comment\n"
LONGER_SETTINGS = b"orbit.date = 2010-11-02T02:56:15.690;\nbias [0] = 0.1\nbias [1] = -2e-3 ;\n"
FIELD = b"2 0 -0.484165371736e-03 0.0\n2 1 0.0 0.0\n2 2 0.24e-5 -0.14e-5\n"
LONGER_FIELD = b"# n m C S\n0 0 1.0 0.0\n" + FIELD + b"3 0 0.957e-6 0.0 0.1e-10 0.0\n"
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
MORE_CLAIMS = b'''[[claim]]
id = "a-number"
chapter = "a/b"
source = "perea2007, Table 1"
statement = "Words."
kind = "value"
threshold = "printed"
paper_value = [1.5, -2]
reproduced_within = { rel = 0.01 }
shape_rule = { factor = 2 }
ours = [1.504, -2.0]
tolerance = { abs = 1e-3 }
verdict = "reproduced"
[[claim]]
id = "an-order"
chapter = "a/c"
source = "this book"
statement = """Words,
more words."""
kind = "order"
ours = { UKF = 1.0, EKF = 2.0 }
agreement = { abs = 0.1 }
route = "another"
verdict = "established here"
'''
STATEMENTS = b"""[[statement]]
id = "some-1"
work = "perea2007"
section = "1"
what = "figure"
text = "Words."
claims = ["some-claim"]
"""
MORE_STATEMENTS = b"""[[statement]]
id = "some-2"
work = "xiong2009"
section = "2.1"
what = "equation"
text = 'Words.'
set_aside = "a reason"
[[statement]]
id = "some-3"
work = "xiong2009"
section = "3"
what = "number"
text = "Words."
open = "a number"
shown = "fig-some"
"""
PLACE = LocalMap(30.0, -95.0)


def heights(path: Path) -> list[bytes]:
    """Of 24 by 24 posts: in degrees, deflated, as most are that one downloads; in other ways."""
    import geotiff_files

    posts = 200 + np.add.outer(np.arange(24), np.arange(24))
    whole, real = posts.astype("int16"), posts.astype("float32")
    tiles = {"tiled": True, "blockxsize": 16, "blockysize": 16, "compress": "lzw"}
    ways = [
        (whole, {"compress": "deflate"}),
        (whole, {"nodata": -32768}),
        (real, {"units": "ft", "predictor": 3, **tiles}),
        (real, {"BIGTIFF": "YES", "ENDIANNESS": "BIG"}),
    ]
    files = [geotiff_files.dem(path, data, place=PLACE, **way).read_bytes() for data, way in ways]
    at_sea = whole.copy()
    at_sea[:, 10:14] = 0
    maps = [
        (whole, 60.0, "EPSG:32615", {"compress": "deflate"}),
        (real, 200.0, "EPSG:2278", {"units": "ft"}),
        (at_sea, 1 / 1200, "EPSG:4326+5773", {}),
    ]
    return files + [on_map(path, data, step, crs, **way) for data, step, crs, way in maps]


def on_map(path: Path, posts: np.ndarray, step: float, crs: str, **way: str) -> bytes:
    """Posts about the place in any coordinates of the ground, a step in their unit."""
    import geotiff_files
    import rasterio.warp

    at = rasterio.warp.transform("EPSG:4326", crs, [PLACE.longitude], [PLACE.latitude])
    half = len(posts) / 2 * step
    corner = rasterio.Affine(step, 0, at[0][0] - half, 0, -step, at[1][0] + half)
    return geotiff_files.write(path, posts, corner, crs=crs, **way).read_bytes()


def pictures(path: Path) -> list[bytes]:
    """Backscatter, 24 by 24 pixels of 30 m: in dB, as power, and as amplitude in whole numbers."""
    import geotiff_files

    decibels = np.round(geotiff_files.backscatter(size=24))
    power = geotiff_files.power(decibels)
    ways = [
        (decibels, {"compress": "deflate"}),
        (power, {"nodata": 0.0}),
        ((1000 * np.sqrt(power)).astype("uint16"), {"compress": "lzw", "tiled": True,
                                                    "blockxsize": 16, "blockysize": 16}),
        (decibels, {"units": "dB", "BIGTIFF": "YES"}),
        (power, {"name": "sigma0, linear", "units": "linear"}),
        (decibels, {"name": "sigma0 in dB"}),
    ]  # fmt: skip
    return [geotiff_files.image(path, data, 30.0, PLACE, **way).read_bytes() for data, way in ways]


def parquet(path: Path) -> list[bytes]:
    """Also one as another program may write it: whole numbers, a gap, text, not compressed."""
    import pyarrow.parquet

    short = Log(np.arange(5.0), np.full((5, 1), 0.5), np.full((5, 1, 1), 2.0))
    files = [write_log(log, path).read_bytes() for log in (short, kalman_log(steps=30))]
    columns = {"time": [0, 1, 2], "innovation_1": [0.5, None, -0.25], "S_11": [2, 2, 2],
               "note": ["first", "second, late", "third"]}  # fmt: skip
    pyarrow.parquet.write_table(pyarrow.table(columns), path, compression="none")
    return [*files, path.read_bytes()]


def leaders(path: Path) -> list[bytes]:
    """Also with fewer and denser state vectors."""
    del path
    denser = state_rows(np.hstack(motion(36700.0 + 30.0 * np.arange(24))))
    told = [(140, "I4", 24), (160, "E22", 36700.0), (182, "E22", 30.0)]
    return [bytes(LEADER), leader_bytes(orbit=denser, position=told)]


def images(path: Path) -> list[bytes]:
    """Also one that lacks a line, and one with another filler."""
    del path
    gap = [n for n in range(1, 65) if n != 20]
    return [bytes(IMAGE), image_bytes(numbers=gap), image_bytes(filler=b"\0")]
