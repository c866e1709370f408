"""PALSAR level-1.0 files, written byte by byte from the format's tables, and read back."""

import datetime
import re
import subprocess
import sys
import tracemalloc
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from palsar_files import (
    DAY,
    IMAGE,
    IMAGE_ROWS,
    LEADER,
    LEADER_ROWS,
    LENGTH,
    LINE_ROWS,
    LINES,
    MS,
    NAME,
    POSITION_ROWS,
    PRI,
    RIGHT,
    SAMPLES,
    START_ATTITUDE,
    START_POSITION,
    START_SUMMARY,
    SUMMARY_ROWS,
    WITHIN,
    field,
    image_bytes,
    leader_bytes,
    motion,
    position_rows,
    product,
    put,
    signal,
    time_rows,
)
from scipy.interpolate import BarycentricInterpolator

from navfilters.sar.palsar import leader_file
from navfilters.sar.palsar import product as opened_product
from navfilters.sar.palsar.__main__ import main
from navfilters.sar.palsar.leader_file import read_leader
from navfilters.sar.palsar.opening import open_product

C = 299792458.0


def opened(folder, image=IMAGE, leader=LEADER, **options):
    return open_product(product(folder, image, leader), **options)


def refused(folder, byte, *words, image=IMAGE, leader=LEADER, file="IMG-HH", **options):
    """The message has the file, the byte, what is needed and what was found."""
    product(folder, image, leader)
    with pytest.raises(ValueError) as caught:  # noqa: PT011, its text is looked at here
        open_product(folder, **options)
    message = str(caught.value)
    assert message.startswith(f"{folder / f'{file}-{NAME}'}, byte {byte}: "), message
    assert " must be " in message
    assert "; found " in message
    for word in words:
        assert word in message, message


def of_line(number, offset):
    return 720 + (number - 1) * LENGTH + offset


def test_the_bytes_are_big_endian_and_the_numbers_are_fortran():
    assert field("B4", 2132196) == bytes.fromhex("002088e4")
    assert field("S4", -1037037) == bytes.fromhex("fff02d13")
    assert field("E22", -7503.25) == b"-7.503250000000000E+03"
    assert field("I6", 28) == b"    28"


@pytest.mark.parametrize("filler", [b" ", b"7", b"\0"])
def test_what_a_product_holds(tmp_path, filler):
    """With digits against every field, a reading that is one byte off is another number."""
    image, leader = image_bytes(filler=filler), leader_bytes(filler=filler)
    got = opened(tmp_path, image, leader)
    assert (got.lines, got.samples) == (LINES, SAMPLES)
    assert got.day == DAY
    assert got.prf == pytest.approx(1 / PRI, rel=1e-15)
    assert got.near_range == 850123
    assert got.sampling_rate == 32e6
    assert got.chirp_rate == pytest.approx(-1.037037e12, rel=1e-12)
    assert got.pulse_length == pytest.approx(27e-6, rel=1e-12, abs=0)
    assert got.wavelength == 0.2360571
    assert got.dc == 15.5 + 15.625j
    assert got.polarisation == "HH"
    assert not got.missing.any()
    assert_array_equal(got.valid, np.tile([0, SAMPLES], (LINES, 1)))
    r, v = motion(36400.25 + 60 * np.arange(28))
    assert_allclose(got.state_vectors.times, 36400.25 + 60 * np.arange(28), rtol=0, atol=1e-9)
    assert_allclose(got.state_vectors.positions, r, rtol=1e-15)
    assert_allclose(got.state_vectors.velocities, v, rtol=1e-14)


def test_echoes(tmp_path):
    got = opened(tmp_path).read(0, LINES)
    codes = signal()[:, :SAMPLES].astype(np.float32)
    assert got.dtype == np.complex64
    assert_array_equal(got, (codes[..., 0] - 15.5) + 1j * (codes[..., 1] - 15.625))


def test_lines_are_read_by_range(tmp_path):
    got = opened(tmp_path)
    whole = got.read(0, LINES)
    for first, last in [(0, 1), (5, 9), (63, 64), (7, 7), (64, 64)]:
        assert_array_equal(got.read(first, last), whole[first:last])


@pytest.mark.parametrize(
    ("first", "last", "message"),
    [(-1, 3, "first"), (4, 3, "last"), (0, 65, "last"), (0.0, 3, "first"), (0, True, "last")],
)
def test_lines_that_are_not_there(tmp_path, first, last, message):
    with pytest.raises(ValueError, match=f"{message} must be"):
        opened(tmp_path).read(first, last)


def test_only_the_lines_asked_for_are_read(tmp_path):
    """All but the second line's samples are cut away after opening."""
    got = opened(tmp_path)
    expected = got.read(1, 2)
    (tmp_path / f"IMG-HH-{NAME}").write_bytes(IMAGE[: of_line(3, 0)])
    assert_array_equal(got.read(1, 2), expected)
    with pytest.raises(ValueError, match=rf"byte {of_line(3, 412)}: line 2 must be 96 bytes long"):
        got.read(1, 3)


def test_the_time_of_a_line_is_better_than_its_millisecond(tmp_path):
    got = opened(tmp_path)
    truth = MS * 1e-3 + WITHIN + PRI * np.arange(LINES)
    assert_allclose(got.line_times, truth, rtol=0, atol=20e-6)
    later = opened(tmp_path, clock_offset=-2.0835e-3)
    assert_allclose(later.line_times, got.line_times - 2.0835e-3, rtol=0, atol=1e-10)
    with pytest.raises(ValueError, match="clock_offset must be"):
        opened(tmp_path, clock_offset=np.nan)


@pytest.mark.parametrize(
    ("prf", "rate"),
    [
        (2100840, 1 / 476e-6),
        (2114165, 1 / 473e-6),
        (2132196, 1 / 469e-6),
        (2132197, 2132.197),  # not that of 469 us to its last digit
        (1000000, 1000.0),
        (3831418, 1 / 522e-6),  # two polarisations alternate
    ],
)
def test_the_pulse_interval_is_in_whole_microseconds(tmp_path, prf, rate):
    got = opened(tmp_path, image_bytes(each=[(56, "B4", prf)], pri=1 / rate))
    assert got.prf == pytest.approx(rate, rel=1e-12)
    assert_allclose(np.diff(got.line_times), 1 / rate, rtol=0, atol=1e-10)


def interpolated(got, t):
    """By 8 points, in the product's own seconds."""
    near = np.argsort(np.abs(got.state_vectors.times - t.mean()))[:8]
    times = got.state_vectors.times[near] - t.mean()
    return BarycentricInterpolator(times, got.state_vectors.positions[near])(t - t.mean())


@pytest.mark.parametrize(
    ("first", "line_day", "ms", "day"),
    [
        (36400.25, 65, 37_000_123, DAY),  # neither crosses
        (85800.0, 66, 100_123, datetime.date(2008, 3, 6)),  # between first vector and first line
        (85800.0, 65, 86_399_990, DAY),  # between two lines
        (85800.0, 65, 86_300_000, DAY),  # after the last line
    ],
)
def test_lines_and_state_vectors_share_their_seconds_across_midnight(
    tmp_path, first, line_day, ms, day
):
    """The place of a line is that of the orbit when it was made."""
    leader = leader_bytes(position=[(160, "E22", first)], orbit=position_rows(first))
    got = opened(tmp_path, image_bytes(day=line_day, ms=ms), leader)
    assert got.day == day
    assert (np.diff(got.line_times) > 0).all()
    truth = (line_day - 65) * 86400 + ms * 1e-3 + WITHIN + PRI * np.arange(LINES)
    assert_allclose(interpolated(got, got.line_times), motion(truth)[0], rtol=0, atol=0.2)
    assert_allclose(got.state_vectors.times[0], first - 86400 * (line_day - 65), atol=1e-9)


def test_the_end_of_a_year_is_a_midnight_too(tmp_path):
    position = [(144, "I4", 2008), (148, "I4", 12), (152, "I4", 31), (156, "I4", 366)]
    leader = leader_bytes(position=[*position, (160, "E22", 86000.0)])
    got = opened(tmp_path, image_bytes(year=2009, day=1, ms=100_000), leader)
    assert got.day == datetime.date(2009, 1, 1)
    assert got.state_vectors.times[0] == -400


def test_a_flagged_leap_second_is_told(tmp_path):
    with pytest.warns(UserWarning, match="leap second"):
        opened(tmp_path, leader=leader_bytes(position=[(4100, "I1", 1)]))


SHIFTS = {1: 0, 5: 3, 6: 3, 7: -4, 20: 40, 21: -40, 64: 1}


@pytest.mark.parametrize("rate", [32, 16])
def test_windows_are_aligned_to_the_first_lines(tmp_path, rate):
    """Each line's bytes are cut from codes by range; column k is range bin k in every line."""
    codes, window, line = signal(bins=160), [], {}
    spacing = C / (2 * rate * 1e6)
    shift = np.array([SHIFTS.get(number, 0) for number in range(1, LINES + 1)])
    for k, s in enumerate(shift):
        window.append(codes[k, 50 + s : 50 + s + SAMPLES])
        line[k + 1] = [(116, "B4", 850123 + round(s * spacing))]
    summary = [(710, "F16", f"{rate:.7f}")]
    if rate == 16:
        summary += [(550, "E16", "5.1851850E+11")]
        line = {k: [*rows, (76, "S4", 518518)] for k, rows in line.items()}
    image = image_bytes(line=line, codes=np.array(window))
    got = opened(tmp_path, image, leader_bytes(summary=summary))
    echoes = got.read(0, LINES)
    expected = codes[:, 50 : 50 + SAMPLES] - np.float32([15.5, 15.625])
    column = np.arange(SAMPLES)
    valid = (column >= shift[:, None]) & (column < shift[:, None] + SAMPLES)
    assert_array_equal(echoes, np.where(valid, expected[..., 0] + 1j * expected[..., 1], 0))
    assert_array_equal(got.valid[:, 0], np.maximum(shift, 0))
    assert_array_equal(got.valid[:, 1], np.minimum(shift + SAMPLES, SAMPLES))


def test_a_window_that_moves_by_half_a_sample_is_told(tmp_path):
    image = image_bytes(line={9: [(116, "B4", 850123 + 7)]})
    with pytest.warns(UserWarning, match=r"parts of a sample, up to 0\.49"):
        assert opened(tmp_path, image).valid[8, 0] == 1


@pytest.mark.parametrize("slant", [850123 + 226, 850123 - 226, 650000])
def test_a_window_that_leaves_the_first_lines_is_refused(tmp_path, slant):
    image = image_bytes(line={9: [(116, "B4", slant)]})
    refused(tmp_path, of_line(9, 116), f"found {slant}", "850123", image=image)


def test_fill_samples_are_never_data(tmp_path):
    codes, fill = signal(), {4: (3, SAMPLES, 1), 8: (0, SAMPLES - 5, 9), 9: (2, SAMPLES + 2, 0)}
    line = {
        number: [(20 + 4 * i, "B4", count) for i, count in enumerate(counts)]
        for number, counts in fill.items()
    }
    got = opened(tmp_path, image_bytes(line=line))
    echoes = got.read(0, LINES)
    for number, (left, data, _) in fill.items():
        kept = min(data, SAMPLES)
        I = codes[number - 1, left : left + kept, 0] - np.float32(15.5)
        assert_array_equal(echoes[number - 1, :kept].real, I)
        assert_array_equal(echoes[number - 1, kept:], 0)
        assert_array_equal(got.valid[number - 1], [0, kept])


def test_flagged_lines_are_missing_and_nothing_in_them_counts(tmp_path):
    rubbish = [(offset, "B4", 0xFFFFFFFF) for offset in (12, 20, 24, 28, 36, 44, 56, 60, 68, 116)]
    flagged = [1, 2, 30, 64]
    image = image_bytes(line={number: [*rubbish, (96, "B4", 1)] for number in flagged})
    whole = opened(tmp_path)
    expected = whole.read(0, LINES)
    got = opened(tmp_path, image)
    rows = np.array(flagged) - 1
    assert_array_equal(np.flatnonzero(got.missing), rows)
    assert_array_equal(got.valid[rows], 0)
    expected[rows] = 0
    assert_array_equal(got.read(0, LINES), expected)
    assert got.lines == LINES
    assert_allclose(got.line_times, whole.line_times, rtol=0, atol=20e-6)


def test_gaps_in_the_line_numbers_are_missing_lines(tmp_path):
    numbers = [n for n in range(1, LINES + 1) if n not in (2, 20, 21, 22)]
    whole = opened(tmp_path)
    expected = whole.read(0, LINES)
    got = opened(tmp_path, image_bytes(numbers=numbers))
    rows = np.array([1, 19, 20, 21])
    assert got.lines == LINES
    assert_array_equal(np.flatnonzero(got.missing), rows)
    expected[rows] = 0
    assert_array_equal(got.read(0, LINES), expected)
    assert_allclose(got.line_times, whole.line_times, rtol=0, atol=20e-6)


def test_calibration_lines_hold_no_echo(tmp_path):
    rows = [(1766, "I4", 1), (1770, "I8", 1), (1778, "I8", 4), (1786, "I8", 60), (1794, "I8", 64)]
    got = opened(tmp_path, leader=leader_bytes(summary=rows))
    assert_array_equal(np.flatnonzero(got.missing), [0, 1, 2, 3, 59, 60, 61, 62, 63])
    assert not opened(tmp_path, leader=leader_bytes(summary=rows[1:])).missing.any()
    none = leader_bytes(summary=[(1766, "I4", 1)])
    assert not opened(tmp_path, leader=none).missing.any()
    every = leader_bytes(summary=[*rows[:2], (1778, "I8", 63)])
    refused(tmp_path, 720, "at least 2", "1 of 64", leader=every)
    for offset in (1770, 1778, 1786, 1794):
        leader = leader_bytes(summary=[*rows, (offset, "I8", -1)])
        refused(tmp_path, 720 + offset, "0 to 9999999", leader=leader, file="LED")


@pytest.mark.parametrize("number", [3, 4, 0])
def test_line_numbers_that_do_not_rise(tmp_path, number):
    image = image_bytes(line={5: [(12, "B4", number)]})
    refused(tmp_path, of_line(5, 12), f"found {number}", image=image)


def test_a_gap_in_numbers_alone_or_in_time_alone(tmp_path):
    """Lines that cannot be placed are refused, from three lines on; a line or two is told."""
    jump = {n: [(12, "B4", n + 9)] for n in range(30, LINES + 1)}
    refused(tmp_path, of_line(30, 44), "2 ms", image=image_bytes(line=jump))
    late = {n: time_rows(n + 8) for n in range(30, LINES + 1)}
    refused(tmp_path, of_line(30, 44), "469 us", image=image_bytes(line=late))
    late = {n: time_rows(n) for n in range(30, LINES + 1)}
    with pytest.warns(UserWarning, match=r"1\.4\d ms"):
        opened(tmp_path, image_bytes(line=late))


def test_more_gap_than_lines(tmp_path):
    numbers = [*range(1, 20), 200]
    image = image_bytes(numbers=numbers, codes=signal(200))
    refused(tmp_path, of_line(20, 12), "half of the lines", image=image)
    image = image_bytes(line={64: [(12, "B4", 0xFFFFFFFF)]})
    refused(tmp_path, of_line(64, 12), "4294967295", image=image)


def test_a_changed_rate_is_refused_and_either_side_opens(tmp_path):
    late = {n: [(56, "B4", 2100840)] for n in range(31, LINES + 1)}
    for n, rows in late.items():
        ms = (MS * 1e-3 + WITHIN + 30 * PRI + (n - 31) * 476e-6) * 1e3
        rows.append((44, "B4", int(ms)))
    image = image_bytes(line=late)
    words = ("2132196", "found 2100840", "line 31", "records=(0, 30) or (30, 64)")
    refused(tmp_path, of_line(31, 56), *words, image=image)
    whole = opened(tmp_path).read(0, LINES)
    before, after = (opened(tmp_path, image, records=part) for part in [(0, 30), (30, 64)])
    assert (before.lines, after.lines) == (30, 34)
    assert before.prf == pytest.approx(1 / 469e-6)
    assert after.prf == pytest.approx(1 / 476e-6)
    assert after.line_times[0] == pytest.approx(MS * 1e-3 + WITHIN + 30 * PRI, abs=40e-6)
    assert_array_equal(np.vstack([before.read(0, 30), after.read(0, 34)]), whole)
    for part in [(0, 65), (4, 5), (9, 3)]:
        with pytest.raises(ValueError, match="records must be two or more of the 64 records"):
            opened(tmp_path, image, records=part)
    for part in [(-1, 9), (0, 30.0), (True, 30)]:
        with pytest.raises(ValueError, match=r"records\[\d\] must be an integer"):
            opened(tmp_path, image, records=part)


@pytest.mark.parametrize("offset", [52, 54, 68, 76])
def test_a_pulse_that_changes(tmp_path, offset):
    value = field("S4", -1030000) if offset == 76 else b"\0\1" if offset < 68 else b"\0\0\x69\x79"
    image = image_bytes(line={12: [(offset, f"A{len(value)}", value)]})
    refused(tmp_path, of_line(12, offset), "as in the lines before", image=image)


def test_codes_of_more_than_5_bits_are_counted(tmp_path):
    codes = signal()
    codes[3, 2], codes[4, 5, 1], codes[4, SAMPLES + 1] = 32, 255, 99  # the last is fill
    got = opened(tmp_path, image_bytes(codes=codes))
    with pytest.warns(UserWarning, match="3 values of lines 2 to 7 are above 31"):
        assert got.read(2, 8)[2, 5].imag == 255 - 15.625


@pytest.mark.parametrize("f", [-300.0, 0.0, 77.0, 900.0])
def test_doppler_centroid(tmp_path, monkeypatch, f):
    n = np.arange(LINES)[:, None]
    start = np.random.default_rng(1).uniform(0, 2 * np.pi, SAMPLES + RIGHT)
    z = 14 * np.exp(1j * (2 * np.pi * f * PRI * n + start))
    codes = np.rint(np.stack([z.real + 15.5, z.imag + 15.625], -1)).astype(np.uint8)
    line = {8: [(96, "B4", 1)], 20: [(116, "B4", 850123 + 47)]}
    codes[19] = np.roll(codes[19], -10, axis=0)
    got = opened(tmp_path, image_bytes(codes=codes, line=line))
    assert got.doppler_centroid(0, LINES) == pytest.approx(f, abs=1.0)
    z = got.read(0, LINES)
    monkeypatch.setattr(opened_product, "_BLOCK", 7)
    phase = np.angle(np.sum(z[:-1].conj() * z[1:]))
    assert got.doppler_centroid(0, LINES) == pytest.approx(phase / (2 * np.pi * PRI), abs=1e-3)
    with pytest.raises(ValueError, match="last must be at most the 64 lines"):
        got.doppler_centroid(0, 65)
    with pytest.raises(ValueError, match="two neighbours"):
        got.doppler_centroid(7, 9)
    with pytest.raises(ValueError, match="two neighbours"):
        got.doppler_centroid(0, 1)


def test_any_polarisation_that_the_name_does_not_deny(tmp_path):
    folder = product(tmp_path)
    crossed = image_bytes(each=[(54, "B2", 1)])
    refused(folder, of_line(1, 54), "0 (H)", "found 1", image=crossed)
    (folder / f"IMG-HV-{NAME}").write_bytes(crossed)
    (folder / f"IMG-HH-{NAME}").write_bytes(IMAGE)
    with pytest.raises(ValueError, match=r"one file IMG-\.\.\.; found IMG-HH.*, IMG-HV.*choose"):
        open_product(folder)
    assert open_product(folder, polarisation="HV").polarisation == "HV"
    assert open_product(str(folder), polarisation="hh").polarisation == "HH"
    with pytest.raises(ValueError, match=r"one file IMG-VV-\.\.\.; found none"):
        open_product(folder, polarisation="VV")


NUMBERS = [
    ("0.2360571", 0.2360571), ("2.360571E-01", 0.2360571), ("2.360571D-01", 0.2360571),
    ("2.360571d-1", 0.2360571), (".2360571", 0.2360571), ("+0.2360571", 0.2360571),
    (b"0.2360571       ", 0.2360571),
]  # fmt: skip


@pytest.mark.parametrize(("text", "value"), NUMBERS)
def test_numbers_as_fortran_writes_them(tmp_path, text, value):
    got = opened(tmp_path, leader=leader_bytes(summary=[(500, "F16", text)]))
    assert got.wavelength == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    "text",
    ["", b"\0" * 16, "*" * 16, "NaN", "Inf", "-Infinity", "0.236 0571", "0x1p-2", "0.2_4", "0,236",
     "1E999", "0.236E", "E5", ".", "0.2\xb2", "0.2360571E-1234", "23.60571", "-0.2360571", "0",
     b"0.2360571\0\0\0\0\0\0\0"],
)  # fmt: skip
def test_what_is_no_number_is_refused(tmp_path, text):
    leader = leader_bytes(summary=[(500, "F16", text)])
    words = ("wavelength", "from 0.2 to 0.3")
    refused(tmp_path, START_SUMMARY + 500, *words, leader=leader, file="LED")


def test_state_vectors_with_either_exponent(tmp_path):
    rows = [(o, k, f"{v:.15E}".replace("E", "D")) for o, k, v in position_rows()]
    got = opened(tmp_path, leader=leader_bytes(orbit=rows)).state_vectors
    assert_allclose(got.positions, motion(36400.25 + 60 * np.arange(28))[0], rtol=1e-15)


BLANKS = {
    "lines in the image": ("rows", 236, 8), "prefix bytes": ("rows", 276, 4),
    "frequency": ("summary", 492, 8), "chirp": ("summary", 550, 16), "pulse": ("summary", 742, 16),
    "level": ("summary", 1094, 16), "calibration": ("summary", 1766, 36),
    "PRF": ("summary", 934, 16), "leap second": ("position", 4100, 1),
}  # fmt: skip


@pytest.mark.parametrize("name", BLANKS)
@pytest.mark.parametrize("blank", [b" ", b"\0"])
def test_blank_fields_that_another_can_replace(tmp_path, name, blank):
    part, offset, size = BLANKS[name]
    rows = {part: [(offset, f"A{size}", blank * size)]}
    if part == "rows":
        got = opened(tmp_path, image=image_bytes(**rows))
    else:
        got = opened(tmp_path, leader=leader_bytes(**rows))
    assert got.chirp_rate == pytest.approx(-1.037037e12, rel=1e-12)
    assert got.pulse_length == pytest.approx(27e-6)


def test_blank_bias_is_the_middle_and_zero_in_a_line_is_not_given(tmp_path):
    leader = leader_bytes(summary=[(818, "F16", ""), (834, "F16", "")])
    assert opened(tmp_path, leader=leader).dc == 15.5 + 15.5j
    got = opened(tmp_path, image_bytes(each=[(68, "B4", 0), (76, "S4", 0)]))
    assert (got.chirp_rate, got.pulse_length) == pytest.approx((-1.037037e12, 27e-6))


@pytest.mark.parametrize("stored", ["1.0370370E+12", "-1.0370370E+12"])
@pytest.mark.parametrize("line", [1037037, -1037037])
def test_the_chirp_falls_whatever_its_sign_in_the_file(tmp_path, stored, line):
    leader = leader_bytes(summary=[(550, "E16", stored)])
    assert opened(tmp_path, image_bytes(each=[(76, "S4", line)]), leader).chirp_rate < 0


LEADER_FAULTS = [
    # rows of, row, byte, words
    ("rows", (4, "B1", 50), 4, "11 192 18 18"),
    ("rows", (5, "B1", 10), 4, "11 10 18 18"),
    ("rows", (8, "B4", 721), 8, "720; found 721"),
    ("rows", (8, "A4", b"\xd0\2\0\0"), 8, "wrong byte order"),
    ("rows", (8, "B4", 16252), 8, "ERSDAC"),
    ("rows", (180, "I6", 2), 180, "must be 1; found"),
    ("rows", (204, "I6", 0), 204, "must be 1; found"),
    ("rows", (216, "I6", 2), 216, "0 to 1"),
    ("rows", (420, "I6", 2), 33972, "record 7 of 7 must be there; found the end of the file"),
    ("rows", (420, "I6", 999999), 420, "0 to 99"),
    ("rows", (420, "I6", "1E2"), 420, "0 to 99"),
    ("summary", (5, "B1", 11), 725, "10, data set summary"),
    ("summary", (8, "B4", 4095), 728, "4096; found 4095"),
    ("summary", (8, "B4", 0), 728, "from 12 to"),
    ("summary", (8, "B4", 11), 728, "from 12 to"),
    ("summary", (8, "B4", 0xFFFFFFFF), 728, "found 4294967295"),
    ("summary", (8, "A4", b"\0\x10\0\0"), 728, "wrong order"),
    ("summary", (396, "A16", "JERS-1"), 720 + 396, "ALOS; found 'JERS-1'"),
    ("summary", (492, "F8", "5.300"), 720 + 492, "within 1 %"),
    ("summary", (710, "F16", "20.0000000"), 720 + 550, "band"),
    ("summary", (710, "F16", ""), 720 + 710, "1 to 100"),
    ("summary", (742, "F16", "101.0000000"), 720 + 742, "0 to 100"),
    ("summary", (492, "F8", "-1.270"), 720 + 492, "0 to 10"),
    ("summary", (550, "E16", "1.1000000E+13"), 720 + 550, "-1e+13 to 1e+13"),
    ("summary", (818, "F16", "0.0000000"), 720 + 818, "1 to 31"),
    ("summary", (834, "F16", "-15.5000000"), 720 + 834, "1 to 31"),
    ("summary", (1046, "A16", "ERSDAC"), 720 + 1046, "layout"),
    ("summary", (1062, "A8", "SKY"), 720 + 1062, "layout"),
    ("summary", (1094, "A16", "1.1"), 720 + 1094, "1.0"),
    ("summary", (1766, "I4", 2), 720 + 1766, "0 to 1"),
    ("position", (5, "B1", 31), 725, "30, platform position"),
    ("position", (8, "B4", 4681), 4824, "4680; found 4681"),
    ("position", (140, "I4", 7), 4816 + 140, "8 to 28"),
    ("position", (140, "I4", 29), 4816 + 140, "8 to 28"),
    ("position", (140, "I4", ""), 4816 + 140, "8 to 28"),
    ("position", (144, "I4", 1999), 4816 + 144, "2006 to 2011"),
    ("position", (148, "I4", 13), 4816 + 148, "1 to 12"),
    ("position", (148, "I4", 2), 4816 + 156, "36"),
    ("position", (152, "I4", 32), 4816 + 152, "1 to 31"),
    ("position", (156, "I4", 64), 4816 + 156, "65, as the date 2008-03-05"),
    ("position", (160, "E22", 86401.0), 4816 + 160, "0 to 86400"),
    ("position", (160, "E22", 37000.2), 4816 + 160, "cover the lines"),
    ("position", (160, "E22", 30000.0), 4816 + 160, "cover the lines"),
    ("position", (182, "E22", 0.0), 4816 + 182, "1 to 300"),
    ("position", (182, "E22", -60.0), 4816 + 182, "1 to 300"),
    ("position", (182, "E22", 61.5), 4816 + 452, "rate of the positions"),
    ("position", (204, "A64", "ECI"), 4816 + 204, "ECR"),
    ("position", (386 + 132 * 27, "E22", ""), 4816 + 386 + 132 * 27, "found ' "),
    ("position", (386, "E22", 1e99), 4816 + 386, "-7300000 to 7300000"),
    ("position", (452, "E22", -1e99), 4816 + 452, "-8000 to 8000"),
    ("position", (386, "E22", 0.0), 4816 + 386, "radius"),
    ("position", (452 + 132 * 4, "E22", 0.0), 4816 + 452 + 132 * 4, "speed"),
]  # fmt: skip


@pytest.mark.parametrize(("part", "row", "byte", "word"), LEADER_FAULTS)
def test_leaders_that_are_refused(tmp_path, part, row, byte, word):
    refused(tmp_path, byte, word, leader=leader_bytes(**{part: [row]}), file="LED")


@pytest.mark.parametrize(
    ("row", "byte"), [((550, "E16", "1.0580000E+12"), 76), ((742, "F16", "16.0000000"), 68)]
)
def test_a_leader_that_contradicts_the_lines(tmp_path, row, byte):
    words = ("within 1 %", f"LED-{NAME}, byte {START_SUMMARY + row[0]}")
    refused(tmp_path, of_line(1, byte), *words, leader=leader_bytes(summary=[row]))


def test_inertial_velocities_are_refused(tmp_path):
    orbit = np.hstack(motion(36400.25 + 60 * np.arange(28)))
    orbit[:, 3:] += 7.2921159e-5 * np.stack([-orbit[:, 1], orbit[:, 0], 0 * orbit[:, 0]], -1)
    rows = [(386 + 132 * k + 22 * i, "E22", float(v)) for k, x in enumerate(orbit)
            for i, v in enumerate(x)]  # fmt: skip
    refused(tmp_path, 4816 + 452, "rate of the positions", leader=leader_bytes(orbit=rows),
            file="LED")  # fmt: skip


def test_the_thirtieth_of_february(tmp_path):
    leader = leader_bytes(position=[(148, "I4", 2), (152, "I4", 30)])
    refused(tmp_path, 4816 + 152, "day of the month", leader=leader, file="LED")


def test_no_pulse_at_all(tmp_path):
    image = image_bytes(each=[(68, "B4", 0), (76, "S4", 0)])
    for offset in (550, 742):
        leader = leader_bytes(summary=[(offset, "F16", "")])
        refused(tmp_path, 720 + offset, "given", image=image, leader=leader, file="LED")


IMAGE_FAULTS = [
    ((5, "B1", 10), 4, "any 192 18 18; found 50 10 18 18"),
    ((8, "B4", 412), 8, "720; found 412"),
    ((8, "A4", b"\xd0\2\0\0"), 8, "wrong byte order"),
    ((8, "B4", 16252), 8, "ERSDAC"),
    ((180, "I6", 63), 720 + 63 * LENGTH, f"{720 + 63 * LENGTH} bytes"),
    ((180, "I6", 65), 720 + 64 * LENGTH, f"found {720 + 64 * LENGTH} bytes"),
    ((180, "I6", 1), 180, "2 to 999999"),
    ((180, "I6", ""), 180, "2 to 999999"),
    ((180, "I6", "-64"), 180, "2 to 999999"),
    ((180, "I6", 999999), 720 + 64 * LENGTH, f"{720 + 999999 * LENGTH} bytes"),
    ((186, "I6", LENGTH - 1), 186, f"{LENGTH}, as the first record says"),
    ((186, "I6", 999999), 186, f"{LENGTH}, as the first record says"),
    ((236, "I8", 63), 236, "64"),
    ((276, "I4", 292), 276, "must be 412; found"),
]
LINE_FAULTS = [
    ((4, "B1", 51), 4, "50 10 18 20; found 51 10 18 20"),
    ((5, "B1", 11), 4, "50 10 18 20; found 50 11 18 20"),
    ((7, "B1", 0), 4, "found 50 10 18 0"),
    ((8, "B4", LENGTH + 1), 8, f"{LENGTH}"),
    ((20, "B4", 5), 24, "at most 52"),
    ((20, "B4", 0xFFFFFFFF), 20, "found 4294967295"),
    ((24, "B4", 0), 24, "1 to"),
    ((24, "B4", 53), 24, "at most 52"),
    ((24, "A4", b"\x30\0\0\0"), 24, "found 805306368"),
    ((28, "B4", 0x80000000), 28, "found 2147483648"),
    ((36, "B4", 2005), 36, "2006 to 2011"),
    ((36, "B4", 2009), 44, "2 ms"),
    ((40, "B4", 0), 40, "1 to 366"),
    ((40, "B4", 367), 40, "1 to 366"),
    ((44, "B4", 86401000), 44, "0 to 86400999"),
    ((44, "B4", MS - 5), 44, "2 ms"),
    ((52, "B2", 2), 52, ""),
    ((56, "B4", 2132197), 56, "2132196"),
    ((56, "A4", b"\xe4\x88\x20\0"), 56, "2132196"),
    ((60, "B4", 3), 60, "ScanSAR"),
    ((64, "B2", 1), 64, "must be 0; found 1"),
    ((66, "B2", 1), 66, "must be 0; found 1"),
    ((96, "B4", 2), 96, "0 to 1"),
    ((116, "B4", 599999), 116, "600000 to 1300000"),
    ((116, "A4", b"\xcb\xf8\x0c\0"), 116, "600000 to 1300000"),
]


@pytest.mark.parametrize(("row", "byte", "word"), IMAGE_FAULTS)
def test_images_that_are_refused(tmp_path, row, byte, word):
    refused(tmp_path, byte, word, image=image_bytes(rows=[row]))


@pytest.mark.parametrize("number", [2, 40, 64])
@pytest.mark.parametrize(("row", "byte", "word"), LINE_FAULTS)
def test_lines_that_are_refused(tmp_path, number, row, byte, word):
    refused(tmp_path, of_line(number, byte), word, image=image_bytes(line={number: [row]}))


@pytest.mark.parametrize(
    ("row", "byte", "word"),
    [
        ((56, "A4", b"\xe4\x88\x20\0"), 56, "1000000 to 5000000"),
        ((52, "B2", 2), 52, "0 to 1"),
        ((54, "B2", 2), 54, "0 to 1"),
        ((68, "B4", 100001), 68, "0 to 100000"),
        ((68, "B4", 16000), 68, "within 1 %"),
        ((76, "S4", -518518), 76, "within 1 %"),
    ],
)
def test_what_every_line_says_can_be_wrong_too(tmp_path, row, byte, word):
    refused(tmp_path, of_line(1, byte), word, image=image_bytes(each=[row]))


@pytest.mark.parametrize("size", [0, 1, 11, 12, 719])
def test_files_without_a_descriptor(tmp_path, size):
    refused(tmp_path, size, "at least 720 bytes", image=IMAGE[:size])
    refused(tmp_path, size, "at least 720 bytes", leader=LEADER[:size], file="LED")


@pytest.mark.parametrize("record", range(6))
def test_leaders_cut_about_each_record(tmp_path, record):
    """Cut at a boundary, the next record is missing; elsewhere the one before it is not whole."""
    starts = [720, 4816, 9496, 17688, 30900, 33972]
    start = starts[record]
    if record > 0:
        refused(tmp_path, starts[record - 1] + 8, leader=LEADER[: start - 1], file="LED")
    if record < 5:
        for cut, byte in [(0, start), (1, start), (11, start), (12, start + 8)]:
            refused(tmp_path, byte, leader=LEADER[: start + cut], file="LED")


@pytest.mark.parametrize("record", [1, 2, 63])
def test_images_cut_about_each_record(tmp_path, record):
    for cut in (0, 1, 11, 12, 411, 412, LENGTH - 1):
        size = 720 + record * LENGTH + cut
        refused(tmp_path, size, f"found {size} bytes", image=IMAGE[:size])


def test_images_cut_about_the_first_record(tmp_path):
    for cut, byte in [(0, 720), (11, 720), (12, 728), (412, 728), (LENGTH - 1, 728)]:
        refused(tmp_path, byte, image=IMAGE[: 720 + cut])


def test_an_image_with_more_after_its_end(tmp_path):
    refused(tmp_path, len(IMAGE), "64 records", image=IMAGE + b"\0")


def test_exchanged_names(tmp_path):
    refused(tmp_path, 4, "11 192 18 18", leader=IMAGE, image=LEADER, file="LED")
    refused(tmp_path, 724, "50 10 18 20, raw signal data; found 18 10 18 20", image=LEADER)


def test_processed_data_under_a_raw_name(tmp_path):
    image = image_bytes(each=[(5, "B1", 11)])
    refused(tmp_path, 724, "50 11 18 20, processed data", image=image)


@pytest.mark.parametrize("text", [b"Not a SAR image.\n" * 99, b"\0" * 5000, b"\xff" * 5000])
def test_files_of_another_kind(tmp_path, text):
    refused(tmp_path, 8, "720", image=text)
    refused(tmp_path, 8, "720", leader=text, file="LED")


def sparse(path, start, size):
    with open(path, "wb") as file:
        file.write(start)
        file.truncate(size)


def test_absurd_claims_allocate_nothing(tmp_path):
    """Claims of 1 TB in a small file, and files of 100 GB that hold next to nothing."""
    huge, large = 100 << 30, (4 << 30) - 1
    claim = image_bytes(rows=[(180, "I6", 999999), (186, "I6", 999999)], each=[(8, "B4", 999999)])
    product(tmp_path)
    image, leader = tmp_path / f"IMG-HH-{NAME}", tmp_path / f"LED-{NAME}"
    one_record = bytearray(IMAGE[: 720 + 412])
    put(one_record, [(8, "B4", large)], 720)
    two = bytearray(LEADER[:4816])
    put(two, [(8, "B4", huge // 64)], 720)
    tracemalloc.start()
    try:
        for path, start, size, byte in [
            (image, claim, len(claim), 728),
            (image, IMAGE, huge, len(IMAGE)),
            (image, one_record, huge, 186),
            (image, IMAGE[:720], huge, 728),
            (leader, two, huge, 728),
            (leader, LEADER[:720], huge, 728),
        ]:
            product(tmp_path)
            sparse(path, start, size)
            tracemalloc.reset_peak()
            before = tracemalloc.get_traced_memory()[0]
            with pytest.raises(ValueError, match=rf"{path.name}, byte {byte}: .*must be"):
                open_product(tmp_path)
            assert tracemalloc.get_traced_memory()[1] - before < 300_000
    finally:
        tracemalloc.stop()
        image.unlink()
        leader.unlink()


def test_folders_that_hold_no_product(tmp_path):
    with pytest.raises(ValueError, match=rf"{tmp_path} must hold one file IMG-\.\.\.; found none"):
        open_product(tmp_path)
    product(tmp_path)
    (tmp_path / "LED-other").write_bytes(LEADER)
    with pytest.raises(ValueError, match=r"one file LED-\.\.\.; found LED-ALPSRP.*, LED-other"):
        open_product(tmp_path)
    (tmp_path / f"LED-{NAME}").unlink()
    with pytest.raises(ValueError, match="image and leader of one scene"):
        open_product(tmp_path)
    (tmp_path / "LED-other").unlink()
    (tmp_path / f"LED-{NAME}").mkdir()
    with pytest.raises(ValueError, match=r"one file LED-\.\.\.; found none"):
        open_product(tmp_path)


BESIDE = [
    # what other programs leave in a product's folder
    ("IMG-HH-{}.aux.xml", "LED-{}.aux.xml"),
    ("IMG-HH-{}.raw", "IMG-HH-{}.PRM", "IMG-HH-{}.LED", "IMG-HH-{}.SLC"),
    ("IMG-HH-{}.ovr", "IMG-HH-{}.md5", "LED-{}.md5", "IMG-HH-{}~", "LED-{}.bak"),
    ("IMG-HH-{} (1)", "LED-{} (1)", "IMG-HH-{}:Zone.Identifier", "._IMG-HH-{}", "IMG-HH-{}.1"),
    ("VOL-{}", "TRL-{}", "summary.txt", "workreport", "IMG-HH.hdr", "LED-"),
]


@pytest.mark.parametrize("beside", BESIDE)
@pytest.mark.parametrize("options", [{}, {"polarisation": "HH"}])
@pytest.mark.parametrize("copy", [False, True])
def test_what_other_programs_leave_beside_the_files_hides_nothing(tmp_path, beside, options, copy):
    """Whether it is text or as good as the files themselves."""
    product(tmp_path)
    for name in beside:
        own = LEADER if name.startswith("LED") else IMAGE
        marked = name.startswith(("IMG-HH-{}", "LED-{}", "._"))
        (tmp_path / name.format(NAME)).write_bytes(own if copy and marked else b"<PAMDataset/>")
    got = open_product(tmp_path, **options)
    assert (got.image.name, got.leader.name) == (f"IMG-HH-{NAME}", f"LED-{NAME}")


def test_two_scenes_whose_names_begin_alike_are_two(tmp_path):
    for scene in ("scene1", "scene10", "scene1-b", "scene1_b"):
        for name, data in ((f"IMG-HH-{scene}", IMAGE), (f"LED-{scene}", LEADER)):
            (tmp_path / name).write_bytes(data)
    with pytest.raises(
        ValueError, match=r"one file IMG-\.\.\.; found .*scene1, .*scene1-b, .*scene10"
    ):
        open_product(tmp_path)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("ALPSRP230940670.raw", "none, but GMTSAR"),
        ("ALPSRP230940670-L1.0.zip", "none, but GMTSAR"),
        ("scene.ZIP", "none, but an archive: unpack it"),
        ("VOL-X", "none, but a volume directory"),
        ("ALOS2015976960-140909_FBDR1.5GUA.kml", "none, but files of PALSAR-2"),
    ],
)
def test_a_folder_without_an_image_says_what_it_has(tmp_path, name, words):
    (tmp_path / name).write_bytes(b"?")
    with pytest.raises(ValueError, match=f"one file IMG-...; found {words}"):
        open_product(tmp_path)


KINDS = [
    (b"PK\3\4" + b"\0" * 900, "a zip archive: unpack it"),
    (b"\x1f\x8b\x08" + b"\0" * 900, "a gzip archive"),
    (b"\x89HDF\r\n\x1a\n" + b"\0" * 900, "an HDF5 file"),
    (b"II*\0" + b"\0" * 900, "a TIFF image, so of a processed level"),
    (b"<PAMDataset/>", "markup text"),
    (bytes([0, 0, 0, 1, 192, 192, 18, 18, 0, 0, 1, 104]) + b" " * 1788, "the volume directory"),
    (bytes([0, 0, 0, 1, 63, 192, 18, 18, 0, 0, 2, 208]) + b" " * 9000, "the trailer"),
]


@pytest.mark.parametrize(("data", "words"), KINDS)
def test_another_file_under_a_products_name_is_called_what_it_is(tmp_path, data, words):
    """Codes and lengths of volume directory and trailer as a product of ALOS-2 has them."""
    needed = "an image file IMG-... or a leader file LED-..."
    refused(tmp_path, 0, needed, words, image=data)
    refused(tmp_path, 0, needed, words, leader=data, file="LED")


@pytest.mark.parametrize("kind", ["VOL", "TRL"])
@pytest.mark.parametrize("data", [b"", b"\0" * 800, IMAGE])
def test_the_command_names_files_that_are_never_read(tmp_path, kind, data):
    path = tmp_path / f"{kind}-{NAME}"
    path.write_bytes(data)
    with pytest.raises(SystemExit) as ended:
        main([str(path)])
    assert f"({kind})" in ended.value.code
    assert "IMG-... or a leader file LED-..." in ended.value.code


@pytest.mark.parametrize(
    ("platform", "words"),
    [
        ("ALOS2", "'ALOS2': a product of PALSAR-2"),
        ("ALOS-2", "'ALOS-2': a product of PALSAR-2"),
        ("ALOS4", "'ALOS4': a product of PALSAR-3"),
        ("ALOSX", "'ALOSX'"),
        ("ADEOS", "'ADEOS'"),
        ("", "''"),
    ],
)
def test_another_satellite_is_refused_by_its_name(tmp_path, platform, words):
    """Before anything of its other records is read, which have another layout there."""
    leader = leader_bytes(
        summary=[(396, "A16", platform)], position=[(8, "B4", 4000), (144, "I4", 2015)]
    )
    refused(tmp_path, 720 + 396, "must be ALOS; found " + words, leader=leader, file="LED")


@pytest.mark.parametrize("level", ["1.1", "1.5", "1.5GUA", "2.0"])
def test_another_level_is_refused_before_its_other_records_are_read(tmp_path, level):
    leader = leader_bytes(summary=[(1094, "A16", level)], position=[(8, "B4", 4000)])
    words = ["1.0, raw signal data", f"found '{level}'"]
    words += ["focused already"] if level == "1.1" else []
    words += ["focused and projected already"] if "1.5" in level else []
    refused(tmp_path, 720 + 1094, *words, leader=leader, file="LED")


def test_an_image_of_another_radar_or_level_says_so_by_its_descriptor(tmp_path):
    """As those of a genuine level-1.5 product of ALOS-2 do."""
    rows = [(48, "A16", "AL2 SARCIMOP"), (216, "I4", 16)]
    refused(tmp_path, 48, "'AL2 SARCIMOP': an image of PALSAR-2", image=image_bytes(rows=rows))
    refused(tmp_path, 216, "16: an image of a processed", image=image_bytes(rows=rows[1:]))
    for bits in (5, 8, ""):
        assert opened(tmp_path, image_bytes(rows=[(216, "I4", bits)])).lines == LINES


def facilities(*lengths, extra=b""):
    """A leader with more records of facilities than the one that the descriptor counts first."""
    data = bytearray(LEADER)
    for length in lengths:
        record = bytearray(length)
        put(
            record, [(4, "B1", 18), (5, "B1", 200), (6, "B1", 18), (7, "B1", 70), (8, "B4", length)]
        )
        data += record
    return bytes(data) + extra


def counted(data, *lengths):
    data = bytearray(data)
    for k, length in enumerate(lengths):
        put(data, [(434 + 14 * k, "I6", 1), (440 + 14 * k, "I8", length)])
    return bytes(data)


def test_a_leader_is_walked_to_its_end(tmp_path):
    """Genuine ones have a pair of count and length for each kind of facility, or none."""
    for leader in (facilities(5000, 728), counted(facilities(5000, 728), 5000, 728)):
        (tmp_path / f"LED-{NAME}").write_bytes(leader)
        records = read_leader(tmp_path / f"LED-{NAME}").records
        assert [(start, length) for start, _, length in records[-3:]] == [
            (30900, 3072), (33972, 5000), (38972, 728),
        ]  # fmt: skip
        assert opened(tmp_path, leader=leader).lines == LINES


@pytest.mark.parametrize("left", [12, 13, 700, 4999])
def test_a_leader_cut_in_a_record_that_is_not_used(tmp_path, left):
    leader = facilities(5000)[: 33972 + left]
    words = (
        "record 7 (facility related), codes 18 200 18 70,",
        f"from 12 to the {left} bytes that the file has left; found 5000",
        f"{5000 - left} bytes are missing, the file is cut",
    )
    refused(tmp_path, 33980, *words, leader=leader, file="LED")
    leader = counted(leader, 5000)
    refused(tmp_path, 33980, "record 7 of 7 (facility", leader=leader, file="LED")


@pytest.mark.parametrize("size", [33972, 38972])
def test_a_leader_cut_between_records_that_are_not_used(tmp_path, size):
    leader = counted(facilities(5000, 728), 5000, 728)[:size]
    number = 7 if size == 33972 else 8
    refused(
        tmp_path, size, f"record {number} of 8 must be there; found the end of the file",
        leader=leader, file="LED",
    )  # fmt: skip


@pytest.mark.parametrize("extra", [b"\0" * 5, b"\0" * 4096, b" " * 100, b"end of file\n" * 9])
def test_what_follows_the_last_record_is_told(tmp_path, extra):
    found = rf"LED-{NAME}, byte 33972: {len(extra)} bytes after the last of 6 records"
    with pytest.warns(UserWarning, match=found):
        assert opened(tmp_path, leader=LEADER + extra).lines == LINES


def test_errors_of_the_system_stay_its_own(tmp_path, monkeypatch):
    with pytest.raises(FileNotFoundError):
        open_product(tmp_path / "nowhere")
    product(tmp_path)
    with pytest.raises(NotADirectoryError):
        open_product(tmp_path / f"LED-{NAME}")

    def deny(path, *_, **__):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(leader_file, "open", deny, raising=False)
    with pytest.raises(PermissionError, match=f"LED-{NAME}"):
        open_product(tmp_path)


def survives(folder, image, leader):
    """Either a product, or a ValueError that names file, byte, need and finding."""
    message = ""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        try:
            got = opened(folder, image, leader)
            assert got.read(0, got.lines).shape == (got.lines, got.samples)
        except ValueError as error:
            message = f"{type(error).__name__}: {error}"
    needed = r"ValueError: .*(IMG-HH|LED)-ALP.*, byte \d+: .* must be .*; found "
    assert not message or re.match(needed, message), message


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("product")


HEADS = st.integers(0, 720 + 412) | st.integers(2, LINES).map(lambda n: of_line(n, n % 128))
USED = st.integers(0, START_ATTITUDE + 12)


@settings(max_examples=100)
@given(where=HEADS | st.integers(0, len(IMAGE) - 1), byte=st.integers(0, 255))
def test_any_byte_of_an_image_may_be_wrong(folder, where, byte):
    image = bytearray(IMAGE)
    image[where] = byte
    survives(folder, bytes(image), LEADER)


@settings(max_examples=100)
@given(where=USED | st.integers(0, len(LEADER) - 1), byte=st.integers(0, 255))
def test_any_byte_of_a_leader_may_be_wrong(folder, where, byte):
    leader = bytearray(LEADER)
    leader[where] = byte
    survives(folder, IMAGE, bytes(leader))


@given(size=st.integers(0, len(IMAGE)), rest=st.integers(0, len(LEADER)))
def test_any_part_of_the_files_may_be_lost(folder, size, rest):
    survives(folder, IMAGE[:size], LEADER[:rest])
    survives(folder, IMAGE[size:], LEADER)


@given(where=st.integers(0, 4000), some=st.binary(max_size=200))
def test_any_bytes_may_be_overwritten(folder, where, some):
    survives(folder, IMAGE[:where] + some + IMAGE[where + len(some) :], LEADER)
    survives(folder, IMAGE, LEADER[:where] + some + LEADER[where + len(some) :])


def test_every_field_is_printed_as_it_stands(tmp_path, capsys):
    """Each printed byte and value is a row of the tables above, amid digits that are in none."""
    product(tmp_path, image_bytes(filler=b"7"), leader_bytes(filler=b"7"))
    line = [(12, "B4", 1), *time_rows(0), *LINE_ROWS, (4, "A11", "50 10 18 20")]
    parts = {
        "IMG-HH": [(0, IMAGE_ROWS), (720, line)],
        "LED": [
            (0, LEADER_ROWS),
            (START_SUMMARY, SUMMARY_ROWS),
            (START_POSITION, [*POSITION_ROWS, *position_rows()]),
        ],
    }
    for file, rows in parts.items():
        written = {
            start + offset: (kind, value) for start, part in rows for offset, kind, value in part
        }
        main([str(tmp_path / f"{file}-{NAME}")])
        printed = capsys.readouterr().out.split("lines; smallest")[0]
        shown = re.findall(r"^ +(\d+)  (?!record)(.{38}) (.*)$", printed, re.M)
        assert len(shown) >= 30
        for byte, name, text in shown:
            kind, value = written[int(byte)]
            expected = field(kind, value).decode().strip() if kind[0] in "AEFI" else str(value)
            assert text == expected, name


def test_the_command_prints_fields_with_their_bytes(tmp_path, capsys):
    product(tmp_path)
    main([str(tmp_path / f"IMG-HH-{NAME}")])
    text = capsys.readouterr().out
    assert re.search(rf"^ +186 +signal record length +{LENGTH}$", text, re.M)
    assert re.search(r"^ +776 +PRF in mHz +2132196$", text, re.M)
    assert re.search(r"^ +724 +record codes +50 10 18 20$", text, re.M)
    assert re.search(r"^ +line number +1 to 64$", text, re.M)
    assert "slant range in m" in text
    main([str(tmp_path / f"LED-{NAME}")])
    text = capsys.readouterr().out
    assert re.search(r"^ +4816 +record 18 30 18 20, 4680 bytes$", text, re.M)
    assert re.search(r"^ +1220 +wavelength in m +0\.2360571$", text, re.M)
    assert re.search(r"^ +5020 +frame +ECR$", text, re.M)
    assert re.search(r"^ +30900 +record 18 200 18 20, 3072 bytes$", text, re.M)


def test_the_command_says_what_is_wrong(tmp_path):
    (tmp_path / "notes.txt").write_text("Not a SAR image.\n" * 99)
    for name, message in [
        ("notes.txt", "byte 8: length of the file descriptor"),
        ("no", "No such"),
    ]:
        with pytest.raises(SystemExit, match=message):
            main([str(tmp_path / name)])


def test_the_module_runs_as_a_command(tmp_path):
    product(tmp_path)
    command = [sys.executable, "-m", "navfilters.sar.palsar", str(tmp_path / f"LED-{NAME}")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "wavelength in m" in done.stdout
    assert done.stderr == ""
