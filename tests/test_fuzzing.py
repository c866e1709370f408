"""Readers of files under random damage: what they read, or an error that names the file.

NAVFILTERS_FUZZ=100000 asks for more inputs than the few that every run makes.
"""

import os
import tracemalloc
import warnings
from datetime import datetime

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from palsar_files import IMAGE, LEADER, NAME

from navfilters.diagnosis import LogError, read_log
from navfilters.sar.palsar.opening import open_product
from navfilters.tracking import read_coefficients, read_observations, read_settings

INPUTS = int(os.environ.get("NAVFILTERS_FUZZ", "60"))
MEMORY = 20  # MiB beyond the file, where a line of text becomes a row of numbers
LOG = b"time,innovation_1,S_11\n" + b"".join(b"%d,0.5,2.0\n" % k for k in range(5))
TRACK = b"""2010-11-02T03:00:10.5  RANGE  Uralla  38014.9488
2010-11-02T03:00:05  AZ_EL  Kumsan  180.0  45.0
"""
SETTINGS = b"a.b = 1.5\nc[1] = two words\n# a comment\n"
FIELD = b"2 0 -0.484165371736e-03 0.0\n2 1 0.0 0.0\n2 2 0.24e-5 -0.14e-5\n"
EPOCH = datetime(2010, 11, 2, 3)


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
}


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


@pytest.mark.parametrize("name", READERS)
def test_a_damaged_file_is_read_or_named(name, tmp_path):
    file, valid, reader, refusal = READERS[name]
    path = tmp_path / file

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

    path.write_bytes(valid)
    reader(path)
    check()
