"""Every refusal of a PALSAR product: the reason that is told is what was done to the files."""

import ast
import re
from pathlib import Path

import numpy as np
import pytest
from palsar_files import (
    IMAGE,
    LEADER,
    LENGTH,
    LINES,
    MS,
    NAME,
    image_bytes,
    leader_bytes,
    motion,
    position_rows,
    state_rows,
)
from palsar_frames import REFUSED as OF_FRAMES
from palsar_frames import frame_bytes, write
from palsar_products import of_line

from navfilters.sar import palsar
from navfilters.sar.palsar.frames import open_frames
from navfilters.sar.palsar.opening import open_product

MODULES = [
    *("ceos_fields", "ceos_records", "contents", "frames", "image_grid", "image_headers"),
    *("leader_file", "leader_records", "opening", "orbit_and_pulse", "product"),
]


def image(rows=(), **options):
    return {"image": image_bytes(rows=rows, **options)}


def line(number, *rows):
    return image(line={number: list(rows)})


def leader(**parts):
    return {"leader": leader_bytes(**parts)}


def summary(*row):
    return leader(summary=[row])


def position(*row):
    return leader(position=[row])


def inertial():
    states = np.hstack(motion(36400.25 + 60 * np.arange(28)))
    states[:, 3:] += 7.2921159e-5 * np.stack([-states[:, 1], states[:, 0], 0 * states[:, 0]], -1)
    return leader(orbit=state_rows(states))


ODD = 720 + 12 * LENGTH + 3
NO_PULSE = image(each=[(76, "S4", 0)]) | summary(550, "E16", "")
WIDE = image(each=[(76, "S4", -1_300_000)]) | summary(550, "E16", "")
STILL = {number: [(40, "B4", 65)] for number in range(1, LINES + 1)}

REASONS = {
    # what was done: the file, the byte, and what is told
    "an archive": ({"image": b"PK\3\4" + IMAGE}, "IMG", 0, "found a zip archive: unpack it"),
    "less than a descriptor": (
        {"image": IMAGE[:700]}, "IMG", 700, "at least 720 bytes long; found its end at byte 700"),
    "ERSDAC's length": (image([(8, "B4", 16252)]), "IMG", 8, "found 16252, ERSDAC's layout"),
    "other byte order": (
        image([(8, "A4", b"\xd0\2\0\0")]), "IMG", 8, r"\(720 in the wrong byte order\)"),
    "an image as leader": ({"leader": IMAGE}, "LED", 4, "50 192 18 18, an image file's"),
    "a leader cut in a record": (
        {"leader": LEADER[:5000]}, "LED", 4824, "4496 bytes are missing, the file is cut"),
    "a leader cut between records": (
        {"leader": LEADER[:30900]}, "LED", 30900,
        r"record 6 of 6 must be there; found the end of the file"),
    "an image cut in a prefix's header": (
        {"image": IMAGE[:724]}, "IMG", 720, "12 bytes long; found the end of the file at byte 724"),
    "an image cut in a line": (
        {"image": IMAGE[:ODD]}, "IMG", ODD, f"64 records of {LENGTH}; found {ODD} bytes"),
    "another radar's image": (
        image([(48, "A16", "AL2 SARCIMOP")]), "IMG", 48, "an image of PALSAR-2, another radar"),
    "16 bits": (image([(216, "I4", 16)]), "IMG", 216, "16: an image of a processed level"),
    "processed records": (
        image(each=[(5, "B1", 11)]), "IMG", 724, "found 50 11 18 20, processed data"),
    "another record length": (
        image([(186, "I6", 600)]), "IMG", 186, f"{LENGTH}, as the first record says; found 600"),
    "lines that are not records": (
        image([(236, "I8", 63)]), "IMG", 236, "64, the number of signal records; found 63"),
    "no number": (image([(180, "I6", "6A")]), "IMG", 180, r"an integer from 2 .* found '    6A'"),
    "a line of another kind": (
        line(9, (5, "B1", 12)), "IMG", of_line(9, 4),
        "record codes in line 9 must be 50 10 18 20; found 50 12 18 20"),
    "a line of another length": (
        line(9, (8, "B4", 500)), "IMG", of_line(9, 8), f"in line 9 must be {LENGTH}; found 500"),
    "all lines flagged": (
        image(each=[(96, "B4", 1)]), "IMG", 720, "2 records that are not missing; found 0 of 64"),
    "ScanSAR": (
        image(each=[(60, "B4", 4)]), "IMG", of_line(1, 60), "4: the bursts of ScanSAR are not"),
    "compressed": (
        image(each=[(64, "B2", 1)]), "IMG", of_line(1, 64), "1: pulses that are compressed on"),
    "coded pulses": (image(each=[(66, "B2", 1)]), "IMG", of_line(1, 66), "only a linear chirp"),
    "another decade": (
        image(year=2015), "IMG", of_line(1, 36), "2015: ALOS flew from 2006 to 2011"),
    "a line twice": (
        line(9, (12, "B4", 8)), "IMG", of_line(9, 12), "above that of the line before; found 8"),
    "a leap of lines": (
        line(64, (12, "B4", 900)), "IMG", of_line(64, 12), "half of the lines are there; found 90"),
    "a new rate": (
        image(line={n: [(56, "B4", 2100840)] for n in range(31, 65)}), "IMG", of_line(31, 56),
        r"2132196 as in the lines before; records=\(0, 30\) or \(30, 64\) open one side; found 2"),
    "one line's rate": (
        line(31, (56, "B4", 2100840)), "IMG", of_line(31, 56),
        r"before; records=\(0, 30\) opens one side; found 2100840"),
    "the second line's rate": (
        line(2, (56, "B4", 2100840)), "IMG", of_line(2, 56), "lines before; found 2100840"),
    "a line's year": (
        line(9, (36, "B4", 2009)), "IMG", of_line(9, 36), "year in line 9 must be 2008: 2008-03"),
    "a line's day": (
        line(9, (40, "B4", 64)), "IMG", of_line(9, 40), "must be 65: 2008-03-05, to which the lin"),
    "a day that does not end": (
        image(line=STILL, ms=86_399_990) | leader(
            position=[(160, "E22", 85800.0)], orbit=position_rows(85800.0)),
        "IMG", of_line(22, 40), "in line 22 must be 66: 2008-03-06, to which the lin.* found 65"),
    "a line's millisecond": (
        line(9, (44, "B4", MS + 90)), "IMG", of_line(9, 44), "even steps of 469 us .* 37000213"),
    "a name's polarisation": (
        image(each=[(54, "B2", 1)]), "IMG", of_line(1, 54), r"0 \(H\), as the file's name says; f"),
    "too many samples": (
        line(9, (24, "B4", 60)), "IMG", of_line(9, 24), "at most 52 with the fill .*; found 60"),
    "a window elsewhere": (
        line(9, (116, "B4", 851000)), "IMG", of_line(9, 116),
        "window meets that of the first line, at 850123 m; found 851000"),
    "another satellite": (summary(396, "A16", "ALOS2"), "LED", 1116, "a product of PALSAR-2"),
    "another agency": (summary(1046, "A16", "ERSDAC"), "LED", 1766, "the agency's own layout"),
    "another system": (summary(1062, "A8", "SKY"), "LED", 1782, "found 'SKY'"),
    "another level": (
        summary(1094, "A16", "1.1"), "LED", 1814, "raw signal data.*found '1.1', an image that is"),
    "a summary's length": (
        leader(summary=[(8, "B4", 4095)]), "LED", 728,
        "length of the data set summary must be 4096; found 4095"),
    "no summary": (
        leader(summary=[(5, "B1", 11)]), "LED", 725, "10, data set summary, too; found 11, 30, 40"),
    "no state vectors' frame": (position(204, "A64", "ECI"), "LED", 5020, "ECR, Earth-fixed; fou"),
    "the 30th of February": (
        leader(position=[(148, "I4", 2), (152, "I4", 30)]), "LED", 4968, "a day of the month"),
    "a day of another month": (
        position(148, "I4", 4), "LED", 4972, "96, as the date 2008-04-05 says; found 65"),
    "a point in the Earth": (
        position(386, "E22", 0.0), "LED", 5202, "a radius from 6.9e6 to 7.3e6 m; found"),
    "inertial velocities": (inertial(), "LED", 5268, "rate of the positions; found .* % from it"),
    "an orbit of another time": (
        position(160, "E22", 30000.0), "LED", 4976,
        "cover the lines, 37000.123 to 37000.153 s; found state vectors from 30000.000 to 31620"),
    "no chirp": (NO_PULSE, "LED", 1270, "given: the magnitude of the chirp.* blank or 0"),
    "two chirps": (
        image(each=[(76, "S4", -518518)]), "IMG", of_line(1, 76), "within 1 % of the magnitude of"),
    "two carriers": (summary(492, "F8", "5.300"), "LED", 1212, "within 1 % of the wavelength"),
    "a wide chirp": (
        summary(710, "F16", "20.0000000"), "LED", 1270, "band over 2.7e-05 s fits 2e.07 Hz"),
    "a wide chirp of the lines": (WIDE, "IMG", of_line(1, 76), "fits 3.2e.07 Hz; found 1.3e.06"),
}  # fmt: skip


def told(folder, files, options=None):
    """The error of opening a product with some files in place of those that are right."""
    (folder / f"IMG-HH-{NAME}").write_bytes(files.get("image", IMAGE))
    (folder / f"LED-{NAME}").write_bytes(files.get("leader", LEADER))
    with pytest.raises(ValueError) as caught:  # noqa: PT011, its text is looked at here
        open_product(folder, **options or {})
    return caught.value


@pytest.mark.parametrize("done", REASONS)
def test_the_reason_is_what_was_done(tmp_path, done):
    files, file, byte, words = REASONS[done]
    message = str(told(tmp_path, files))
    name = f"{'IMG-HH' if file == 'IMG' else file}-{NAME}"
    assert message.startswith(f"{tmp_path / name}, byte {byte}: "), message
    assert re.search(r" must be .*; found ", message), message
    assert re.search(words, message), message


def refusals():
    """Places (file, first line, last line) at which the reader raises or refuses something."""
    root = Path(palsar.__file__).parent
    for module in MODULES:
        for node in ast.walk(ast.parse((root / f"{module}.py").read_text())):
            called = isinstance(node, ast.Call) and getattr(node.func, "attr", "")
            if isinstance(node, ast.Raise) or called == "refuse":
                yield f"{module}.py", node.lineno, node.end_lineno


def passed(error):
    """The lines (file, number) of the reader through which an error came."""
    trace = error.__traceback__
    while trace:
        yield Path(trace.tb_frame.f_code.co_filename).name, trace.tb_lineno
        trace = trace.tb_next


def beyond_the_table(folder):
    """Errors of calls, of folders, and of frames."""
    calls = [({}, {"records": (0, 1)}), ({}, {"records": (0, 99)})]
    yield from (told(folder, *call) for call in calls)
    product = open_product(folder)
    for first, last in [(0, 999), (3, 4)]:
        with pytest.raises(ValueError, match="must") as caught:
            (product.read if last > LINES else product.doppler_centroid)(first, last)
        yield caught.value
    (folder / f"LED-{NAME}").rename(folder / "LED-OTHER")
    with pytest.raises(ValueError, match="image and leader of one scene") as caught:
        open_product(folder)
    yield caught.value
    (folder / f"IMG-HH-{NAME}").unlink()
    with pytest.raises(ValueError, match="must hold one file IMG") as caught:
        open_product(folder)
    yield caught.value
    short = leader_bytes(
        position=[(140, "I4", 8), (160, "E22", 36580.19)], orbit=position_rows(36580.19)
    )
    pairs = [(frame_bytes(*cut, **im), leader_bytes(**le)) for cut, im, le, _ in OF_FRAMES]
    late = frame_bytes(100, 200, ms=MS + 3), LEADER
    pairs = [(LEADER, *pair) for pair in [*pairs, late]]
    for k, (one, *two) in enumerate([*pairs, (short, frame_bytes(110, 200), LEADER)]):
        first = write(folder / f"{k}-0", 0, frame_bytes(0, 120), one)
        second = write(folder / f"{k}-1", 1, *two)
        with pytest.raises(ValueError, match="must") as caught:
            open_frames([first, second])
        yield caught.value
    for given, options in [([], {}), ([first, second], {"records": (0, 9)})]:
        with pytest.raises(ValueError, match="must") as caught:
            open_frames(given, **options)
        yield caught.value
    for k in range(3):
        write(folder, k, IMAGE)
    next(folder.glob("LED-*0690*")).unlink()
    (folder / "LED-OTHER").unlink()
    with pytest.raises(ValueError, match="leader file") as caught:
        open_frames(folder)
    yield caught.value


def test_no_refusal_is_without_a_case(tmp_path):
    """Each place of the code that refuses is passed by a case here whose words are looked at."""
    seen = set()
    for files, *_ in REASONS.values():
        seen.update(passed(told(tmp_path, files)))
    for error in beyond_the_table(tmp_path):
        seen.update(passed(error))
    missed = [
        (file, first)
        for file, first, last in refusals()
        if not any(name == file and first <= line <= last for name, line in seen)
    ]
    assert missed == []
