"""Frames of one pass as one product: all but the cut is as in a file that was never cut."""

import re
import tracemalloc
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from palsar_files import (
    LENGTH,
    MS,
    SAMPLES,
    image_bytes,
    leader_bytes,
    position_rows,
)
from palsar_frames import ALL, CODES, REFUSED, WHOLE, frame_bytes, strip, write
from palsar_products import C, opened

from navfilters.sar.palsar.frames import open_frames
from navfilters.sar.palsar.opening import open_product


def same(got, whole):
    assert (got.lines, got.samples, got.day, got.dc) == (
        whole.lines,
        whole.samples,
        whole.day,
        whole.dc,
    )
    for name in ("near_range", "prf", "chirp_rate", "pulse_length", "wavelength", "polarisation"):
        assert getattr(got, name) == getattr(whole, name)
    assert_array_equal(got.missing, whole.missing)
    assert_array_equal(got.valid, whole.valid)
    assert_array_equal(got.read(0, got.lines), whole.read(0, whole.lines))
    assert_allclose(got.line_times, whole.line_times, rtol=0, atol=20e-6)
    f = got.doppler_centroid(0, got.lines)
    assert f == pytest.approx(whole.doppler_centroid(0, whole.lines))


@pytest.mark.parametrize(
    "cuts",
    [
        [(0, 120), (90, 200)],
        [(0, 100), (100, 200)],  # they touch
        [(0, 199), (1, 200)],
        [(0, 80), (60, 140), (130, 200)],
        [(0, 120), (40, 160), (100, 200)],  # the third overlaps the first, too
    ],
)
def test_frames_are_the_strip_that_they_were_cut_from(tmp_path, cuts):
    (tmp_path / "whole").mkdir()
    whole = opened(tmp_path / "whole", image_bytes(**WHOLE))
    folders = strip(tmp_path, *cuts)
    got = open_frames(folders)
    same(got, whole)
    same(open_frames(folders[::-1]), whole)
    assert got.name.count(" + ") == len(cuts) - 1
    assert got.name.startswith(got.image.name)
    for first, last in [(0, 1), (95, 105), (199, 200), (118, 122), (50, 50)]:
        assert_array_equal(got.read(first, last), whole.read(first, last))


def test_one_folder_may_hold_all_frames_and_both_polarisations(tmp_path):
    for k, cut in enumerate([(0, 120), (90, 200)]):
        write(tmp_path, k, frame_bytes(*cut))
        write(tmp_path, k, frame_bytes(*cut, each=[(54, "B2", 1)]), start="IMG-HV")
        write(tmp_path, k, frame_bytes(*cut))
    assert open_frames(str(tmp_path), polarisation="HV").polarisation == "HV"
    got = open_frames(tmp_path, polarisation="HH")
    assert (got.polarisation, got.lines) == ("HH", ALL)
    with pytest.raises(ValueError, match=r"IMG-\.\.\.ALPSR.*0670.*IMG-HH.*IMG-HV.*choose a pol"):
        open_frames(tmp_path)
    with pytest.raises(ValueError, match=r"found .*0670.*, .*0680.*open_frames joins frames"):
        open_product(tmp_path, polarisation="HH")
    next(tmp_path.glob("LED-*0680*")).unlink()
    with pytest.raises(ValueError, match=r"LED-\.\.\. of each scene; found none of IMG-H.*0680"):
        open_frames(tmp_path, polarisation="HH")


def test_an_image_without_a_leader_is_not_left_out(tmp_path):
    for k, cut in enumerate([(0, 80), (60, 140), (130, 200)]):
        write(tmp_path, k, frame_bytes(*cut))
    next(tmp_path.glob("LED-*0690*")).unlink()
    with pytest.raises(ValueError, match=r"LED-\.\.\. of each scene; found none of IMG-HH.*0690"):
        open_frames(tmp_path)


def test_a_single_frame_is_a_product(tmp_path):
    folder = write(tmp_path, 0, frame_bytes(0, 90))
    same(open_frames(folder), open_product(folder))
    got = open_frames([folder], records=(10, 30), clock_offset=1.0)
    same(got, open_product(folder, records=(10, 30), clock_offset=1.0))
    with pytest.raises(ValueError, match="at least one folder; found none"):
        open_frames([])


@pytest.mark.parametrize("rate", [32, 16])
def test_a_later_frames_window_may_have_moved(tmp_path, rate):
    """By whole samples, at its start and within it; the columns are the first frame's."""
    spacing = C / (2e6 * rate)
    moved = {n + 1: round(spacing * (3 if n < 150 else -5)) for n in range(90, ALL)}
    line = {n: [(116, "B4", 850123 + metres)] for n, metres in moved.items()}
    options = {"line": line}
    leader = leader_bytes()
    if rate == 16:  # FBD: half the band
        options["each"] = [(76, "S4", -518518)]
        rows = [(710, "F16", "16.0000000"), (550, "E16", "-5.1851800E+11")]
        leader = leader_bytes(summary=rows)
    (tmp_path / "whole").mkdir()
    whole = opened(tmp_path / "whole", image_bytes(**WHOLE, **options), leader)
    folders = [
        write(tmp_path / f"{k}", k, frame_bytes(*cut, **options | {"line": own}), leader)
        for k, (cut, own) in enumerate(
            [
                ((0, 110), {n: rows for n, rows in line.items() if n <= 110}),
                ((90, 200), line),
            ]
        )
    ]
    got = open_frames(folders)
    same(got, whole)
    assert got.sampling_rate == rate * 1e6
    assert (got.valid[100] == [3, SAMPLES]).all()
    assert (got.valid[180] == [0, SAMPLES - 5]).all()


def test_what_one_frame_misses_the_other_gives(tmp_path):
    lost = {"line": {n: [(96, "B4", 1)] for n in (5, 95, 118, 119, 120)}}
    folders = [
        write(tmp_path / "0", 0, frame_bytes(0, 120, **lost)),
        write(tmp_path / "1", 1, frame_bytes(90, 200, line={95: [(96, "B4", 1)]})),
    ]
    (tmp_path / "whole").mkdir()
    line = {n: [(96, "B4", 1)] for n in (5, 95)}
    same(open_frames(folders), opened(tmp_path / "whole", image_bytes(**WHOLE, line=line)))


def test_each_frame_has_its_own_code_of_zero(tmp_path):
    folders = strip(tmp_path, (0, 120), (90, 200))
    other = leader_bytes(summary=[(818, "F16", "15.2500000")])
    write(folders[1], 1, frame_bytes(90, 200), other)
    echoes = open_frames(folders).read(0, ALL)
    assert_array_equal(echoes[:120].real, CODES[:120, :SAMPLES, 0] - np.float32(15.5))
    assert_array_equal(echoes[120:].real, CODES[120:, :SAMPLES, 0] - np.float32(15.25))


def test_frames_on_either_side_of_midnight(tmp_path):
    times = {"day": 65, "ms": 86_399_950}
    leaders = [
        leader_bytes(position=[(160, "E22", start)], orbit=position_rows(start))
        for start in (85800.0, 85860.0)
    ]
    (tmp_path / "whole").mkdir()
    whole = opened(tmp_path / "whole", image_bytes(**WHOLE, **times), leaders[0])
    folders = [
        write(tmp_path / f"{k}", k, frame_bytes(*cut, **times), leaders[k])
        for k, cut in enumerate([(0, 120), (110, 200)])
    ]
    assert open_product(folders[0]).day < open_product(folders[1]).day
    same(open_frames(folders), whole)
    assert whole.line_times[-1] > 86400


@pytest.mark.parametrize(("cut", "image", "leader", "message"), REFUSED)
def test_frames_that_are_not_one_strip(tmp_path, cut, image, leader, message):
    """Each of them is a product by itself."""
    first = write(tmp_path / "0", 0, frame_bytes(0, 120))
    second = write(tmp_path / "1", 1, frame_bytes(*cut, **image), leader_bytes(**leader))
    open_product(second)
    for folders in ([first, second], [second, first]):
        with pytest.raises(ValueError, match=message):
            open_frames(folders)


def test_lines_that_fall_between_the_other_frames(tmp_path):
    """Three milliseconds late are 6.4 lines."""
    first = write(tmp_path / "0", 0, frame_bytes(0, 120))
    second = write(tmp_path / "1", 1, frame_bytes(100, 200, ms=MS + 3))
    message = r"0680.* must begin on a line of .*0670.*; found 0\.40 of a line"
    with pytest.raises(ValueError, match=message):
        open_frames([first, second])


def test_another_polarisation_and_records_of_two_frames(tmp_path):
    first = write(tmp_path / "0", 0, frame_bytes(0, 120))
    crossed = frame_bytes(90, 200, each=[(54, "B2", 1)])
    second = write(tmp_path / "1", 1, crossed, start="IMG-HV")
    with pytest.raises(ValueError, match=r"polarisation must be HH as in .*found HV"):
        open_frames([first, second])
    with pytest.raises(ValueError, match=r"records must come with a single frame.*found 2 frames"):
        open_frames([first, second], records=(0, 50))


def test_state_vectors_that_end_before_the_last_frame(tmp_path):
    first = write(tmp_path / "0", 0, frame_bytes(0, 120))
    short = leader_bytes(
        position=[(140, "I4", 8), (160, "E22", 36580.19)], orbit=position_rows(36580.19)
    )
    write(tmp_path / "0", 0, frame_bytes(0, 120), short)
    second = write(tmp_path / "1", 1, frame_bytes(110, 200))
    with pytest.raises(ValueError, match=r"number of points must be enough to cover.*found 8, the"):
        open_frames([first, second])


def test_of_the_samples_only_the_overlap_is_read_and_little_at_once(tmp_path):
    """Bytes beyond it may be lost, and what is kept does not grow with a line's length."""
    folders = strip(tmp_path, (0, 120), (110, 200))
    tracemalloc.start()
    try:
        got = open_frames(folders)
        assert tracemalloc.get_traced_memory()[1] < 1_000_000
    finally:
        tracemalloc.stop()
    expected = got.read(119, 122)
    images = [next(folder.glob("IMG*")) for folder in folders]
    images[0].write_bytes(images[0].read_bytes()[:719] + b"?" + b"?" * (119 * LENGTH)
                          + images[0].read_bytes()[720 + 119 * LENGTH :])  # fmt: skip
    images[1].write_bytes(images[1].read_bytes()[: 720 + 12 * LENGTH])
    assert_array_equal(got.read(119, 122), expected)
    message = rf"{images[1].name}, byte {720 + 12 * LENGTH + 412}: line 122 must be 96 bytes long"
    with pytest.raises(ValueError, match=message):
        got.read(119, 123)


def test_codes_of_more_than_five_bits_are_told_of_their_file(tmp_path):
    codes = CODES.copy()
    codes[150, 3] = 40
    got = open_frames(strip(tmp_path, (0, 120), (90, 200), codes=codes))
    with pytest.warns(UserWarning, match=r"IMG-HH-.*0680.*: 2 values of lines 140 to 159"):
        got.read(140, 160)


def test_a_pass_over_the_equator_has_two_orbit_numbers(tmp_path):
    """An orbit begins there: no reason to refuse frames that overlap."""
    folders = strip(tmp_path, (0, 120), (90, 200))
    write(folders[1], 1, frame_bytes(90, 200), leader_bytes(summary=[(444, "A8", "23095")]))
    assert open_frames(folders).lines == ALL


SECOND = frame_bytes(90, 200)
HEADS = st.integers(0, 720 + 412) | st.integers(1, 109).map(lambda n: 720 + n * LENGTH + n % 128)


@pytest.fixture(scope="module")
def damaged(tmp_path_factory):
    folder = tmp_path_factory.mktemp("strip")
    return folder, write(folder, 0, frame_bytes(0, 120))


@settings(max_examples=60)
@given(where=HEADS | st.integers(0, len(SECOND) - 1), byte=st.integers(0, 255))
def test_any_byte_of_a_later_frame_may_be_wrong(damaged, where, byte):
    """Either a product that can be read, or an error that says what must be."""
    folder, _ = damaged
    image = bytearray(SECOND)
    image[where] = byte
    write(folder, 1, bytes(image))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        try:
            got = open_frames(folder)
            assert got.read(0, got.lines).shape == (got.lines, got.samples)
        except ValueError as error:
            assert re.search(r"must .*; found", str(error)), error  # noqa: PT017
