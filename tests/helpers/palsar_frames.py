"""Frames of one PALSAR pass, cut from one strip of lines, and pairs that are none."""

import numpy as np
from palsar_files import LENGTH, NAME, PRI, image_bytes, leader_bytes, motion, signal, state_rows

ALL = 200
CODES = signal(ALL)
WHOLE = {"codes": CODES, "numbers": range(1, ALL + 1)}


def frame_bytes(first, last, codes=CODES, line=None, **options):
    """Lines of the strip, half-open from 0, whose numbers begin at 1 in each file."""
    own = {n + 1: [(12, "B4", n + 1 - first)] for n in range(first, last)}
    for number, rows in (line or {}).items():
        own[number] = [*own.get(number, []), *rows]
    return image_bytes(codes=codes, numbers=range(first + 1, last + 1), line=own, **options)


def write(folder, number, image, leader=None, start="IMG-HH"):
    """A frame with a scene's number of its own."""
    folder.mkdir(exist_ok=True)
    scene = NAME.replace("0670", f"{670 + 10 * number:04}")
    (folder / f"{start}-{scene}").write_bytes(image)
    (folder / f"LED-{scene}").write_bytes(leader_bytes() if leader is None else leader)
    return folder


def strip(folder, *cuts, **options):
    return [write(folder / f"{k}", k, frame_bytes(*cut, **options)) for k, cut in enumerate(cuts)]


def shifted(**by):
    """A leader whose orbit is another by so many m or m/s."""
    states = np.hstack(motion(36400.25 + 60 * np.arange(28)))
    states[:, 0] += by.get("x", 0.0)
    states[:, 4] += by.get("vy", 0.0)
    return {"orbit": state_rows(states)}


REFUSED = [
    # lines of the second frame, of its image, of its leader; the message
    ((121, 200), {}, {}, rf"0680-H1.0__A must overlap or touch .*0670.*; found a gap of 1 lines, "
     rf"{PRI:.6g} s: the frame between them is needed"),
    ((150, 200), {}, {"summary": [(444, "A8", "23095")]},
     r"a gap of 30 lines, 0\.01407 s, from orbit 23094 to 23095: only frames of one pass"),
    ((90, 200), {"day": 111}, {"position": [(148, "I4", 4), (152, "I4", 20), (156, "I4", 111)]},
     r"found a gap of \d{10} lines, 3\.9744e\+06 s"),
    ((30, 100), {}, {}, r"0680.* must go on after the end of .*0670.*; found its 70 lines within "
     "it, from line 30: leave one"),
    ((90, 200), {"each": [(56, "B4", 2100840)], "pri": 476e-6}, {},
     r"IMG-HH-.*0680.*: prf must be 2132\.19616 Hz as in .*0670.*; found 2100\.84034 Hz"),
    ((90, 200), {"each": [(76, "S4", -1030000)]}, {"summary": [(550, "E16", "-1.0300000E+12")]},
     r"chirp rate must be -1\.037037e\+12 Hz/s as in .*; found -1\.03e\+12 Hz/s"),
    ((90, 200), {"each": [(68, "B4", 26800)]}, {"summary": [(742, "F16", "26.8000000")]},
     r"pulse length must be 2\.7e-05 s as in .*; found 2\.68e-05 s"),
    ((90, 200), {"each": [(76, "S4", -518518)]},
     {"summary": [(710, "F16", "16.0000000"), (550, "E16", "-5.1851800E+11")]},
     r"sampling rate must be 32000000 Hz as in .*; found 16000000 Hz"),
    ((90, 200), {}, {"summary": [(500, "F16", "0.2360600")]}, "wavelength must be 0.2360571 m as"),
    ((90, 200), {}, {"summary": [(1838, "F16", "41.5000000")]},
     r"LED-.*0680.*, byte 2558: off-nadir angle in deg must be '34\.3000000' as in .*LED-.*0670.*; "
     r"found '41\.5000000'"),
    ((90, 200), {}, {"summary": [(1854, "I4", 12)]}, r"byte 2574: beam number must be '7' as in"),
    ((90, 200), {}, {"summary": [(412, "A32", "ALOS  -L  -HH2")]},
     "byte 1132: sensor and mode must be 'ALOS  -L  -HH0' as in"),
    ((90, 200), {}, shifted(x=40.0), r"LED-.*0680.*, byte 5202: x in m must be within 1 m of the "
     r"positions in .*LED-.*0670.*; found 40 m \(orbit kinds '2' and '2'\)"),
    ((90, 200), {}, shifted(vy=0.2), r"byte 5268: vx in m/s must be within 0\.01 m/s of the "
     r"velocities in .*; found 0\.2 m/s"),
    ((90, 200), {"each": [(116, "B4", 850123 + 226)]}, {},
     r"IMG-HH-.*0680.*, byte 836: slant range in m in line 1 must be such that the window meets "
     r"that of the first line of .*IMG-HH-.*0670.*, at 850123 m; found 850349"),
    ((90, 200), {"codes": np.where(np.arange(ALL)[:, None, None] == 99, 31 - CODES, CODES)}, {},
     rf"IMG-HH-.*0680.*, byte {720 + 9 * LENGTH + 412}: sample of line 9 must be \[\d+, \d+\] as "
     rf"the same line has it in .*0670.*, byte {720 + 99 * LENGTH + 412}; found \[\d+, \d+\], and "
     "48 of 48 differ"),
    ((90, 200), {"codes": np.roll(CODES, 1, axis=0)}, {}, "sample of line 0 must be"),
]  # fmt: skip
