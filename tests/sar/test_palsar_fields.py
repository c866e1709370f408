"""Fields of a PALSAR product that are blank, contradict each other or are wrong; its windows."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from palsar_files import (
    IMAGE,
    LINES,
    NAME,
    SAMPLES,
    START_SUMMARY,
    image_bytes,
    leader_bytes,
    motion,
    position_rows,
    product,
    signal,
)
from palsar_products import (
    C,
    of_line,
    opened,
    refused,
)

from navfilters.sar.palsar.opening import open_product

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
