"""PALSAR level-1.0 files, written byte by byte from the format's tables, and read back."""

import datetime

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from palsar_files import (
    DAY,
    IMAGE,
    LINES,
    MS,
    NAME,
    PRI,
    RIGHT,
    SAMPLES,
    WITHIN,
    field,
    image_bytes,
    leader_bytes,
    motion,
    position_rows,
    signal,
    time_rows,
)
from palsar_products import (
    of_line,
    opened,
    refused,
)
from scipy.interpolate import BarycentricInterpolator

from navfilters.sar.palsar import product as opened_product


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


@pytest.mark.parametrize("inside", [1.0, 59.0])
def test_lines_may_lie_between_the_outermost_state_vectors(tmp_path, inside):
    got = opened(tmp_path)
    first, last = got.state_vectors.times[[0, -1]]
    for offset in (first + inside - got.line_times[0], last - inside - got.line_times[-1]):
        moved = opened(tmp_path, clock_offset=offset)
        assert_allclose(moved.line_times, got.line_times + offset, rtol=0, atol=1e-9)


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
