"""Readers of files under random damage: what they read, or an error that names the file.

``make fuzz`` gives them a million files, of a damage that knows the formats.
"""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from readers import MEMORY, READERS, RESIDENT, measured, outcome, resident

INPUTS = 60


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


# What GDAL says of a name that is not UTF-8, rasterio cannot log, and says so on stderr.
@pytest.mark.filterwarnings("ignore:Exception ignored in.*log_error")
@pytest.mark.parametrize("name", READERS)
def test_a_damaged_file_is_read_or_named(name, tmp_path):
    reader = READERS[name]
    if reader.missing:
        pytest.skip(f"needs {reader.package}")
    path = tmp_path / reader.file
    valid = reader.valid(path)
    most = resident()

    @settings(max_examples=INPUTS, suppress_health_check=list(HealthCheck), deadline=5000)
    @given(data=st.sampled_from(valid).flatmap(damaged) | st.binary(max_size=300))
    def check(data):
        path.write_bytes(data)
        assert measured(reader, path)[1] < 2 * len(data) + MEMORY * 2**20
        assert resident() - most < RESIDENT * 2**20

    for whole in valid:
        path.write_bytes(whole)
        assert outcome(reader, path) == "read"
    check()
