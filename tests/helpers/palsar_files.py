"""PALSAR level-1.0 files, byte by byte from the format's tables.

The rows below are (0-based offset, type, value): B, S big-endian integers of that many bytes, I, F,
E ASCII numbers as Fortran writes them, A text. Nothing of the reader's own tables is used.
"""

import datetime
from functools import cache

import numpy as np

LINES, SAMPLES, RIGHT = 64, 48, 4
LENGTH = 412 + 2 * (SAMPLES + RIGHT)
PRI = 469e-6
DAY, MS, WITHIN = datetime.date(2008, 3, 5), 37_000_123, 0.35e-3  # the first line's time
NAME = "ALPSRP230940670-H1.0__A"
START_SUMMARY, START_POSITION, START_ATTITUDE, START_CALIBRATION = 720, 4816, 9496, 17688

IMAGE_ROWS = [
    (0, "B4", 1), (4, "B1", 50), (5, "B1", 192), (6, "B1", 18), (7, "B1", 18), (8, "B4", 720),
    (12, "A2", "A"), (16, "A12", "CEOS-SAR-CCT"), (48, "A16", "AL PSR IMOP"),
    (180, "I6", LINES), (186, "I6", LENGTH), (216, "I4", 8), (220, "I4", 2), (224, "I4", 2),
    (232, "I4", 1), (236, "I8", LINES), (248, "I8", SAMPLES), (268, "A4", "BSQ"),
    (276, "I4", 412), (280, "I8", LENGTH - 412), (400, "A28", "COMPLEX"),
]  # fmt: skip
LINE_ROWS = [
    (4, "B1", 50), (5, "B1", 10), (6, "B1", 18), (7, "B1", 20), (8, "B4", LENGTH),
    (16, "B4", 1), (20, "B4", 0), (24, "B4", SAMPLES), (28, "B4", RIGHT), (32, "B4", 1),
    (48, "B2", 1), (50, "B2", 0), (52, "B2", 0), (54, "B2", 0), (56, "B4", 2132196),
    (60, "B4", 0), (64, "B2", 0), (66, "B2", 0), (68, "B4", 27000), (72, "S4", 0),
    (76, "S4", -1037037), (80, "B4", 0), (96, "B4", 0), (116, "B4", 850123), (120, "B4", 123456),
]  # fmt: skip
LEADER_ROWS = [
    (0, "B4", 1), (4, "B1", 11), (5, "B1", 192), (6, "B1", 18), (7, "B1", 18), (8, "B4", 720),
    (48, "A16", "AL PSR LEAD"), (180, "I6", 1), (186, "I6", 4096), (192, "I6", 0),
    (204, "I6", 1), (210, "I6", 4680), (216, "I6", 1), (222, "I6", 8192), (228, "I6", 0),
    (240, "I6", 0), (252, "I6", 0), (264, "I6", 0), (276, "I6", 0), (288, "I6", 0),
    (300, "I6", 0), (312, "I6", 0), (324, "I6", 0), (336, "I6", 1), (342, "I6", 13212),
    (348, "I6", 0), (420, "I6", 1), (426, "I6", 3072),
]  # fmt: skip
SUMMARY_ROWS = [
    (0, "B4", 2), (4, "B1", 18), (5, "B1", 10), (6, "B1", 18), (7, "B1", 20), (8, "B4", 4096),
    (20, "A32", "ALPSRP230940670"), (68, "A32", "20080305101640123"), (164, "A16", "GRS80"),
    (180, "F16", "6378.1370000"), (196, "F16", "6356.7523141"), (396, "A16", "ALOS"),
    (412, "A32", "ALOS  -L  -HH0"), (444, "A8", "23094"), (476, "F8", "90.000"),
    (484, "F8", "38.700"), (492, "F8", "1.270"), (500, "F16", "0.2360571"),
    (534, "E16", "0.0000000E+00"), (550, "E16", "-1.0370370E+12"), (566, "E16", "0.0000000E+00"),
    (710, "F16", "32.0000000"), (726, "F16", "5671.0000000"), (742, "F16", "27.0000000"),
    (798, "I8", 5), (818, "F16", "15.5000000"), (834, "F16", "15.6250000"),
    (934, "F16", "2132196.0000000"), (1046, "A16", "EOC"), (1062, "A8", "ALOS"),
    (1070, "A8", "1.00"), (1094, "A16", "1.0"), (1534, "A8", "ASCEND"), (1734, "F16", ""),
    (1750, "F16", ""), (1766, "I4", 0), (1770, "I8", 0), (1778, "I8", 0), (1786, "I8", 0),
    (1794, "I8", 0), (1802, "I4", 0), (1806, "I8", 1), (1830, "I4", 0), (1838, "F16", "34.3000000"),
    (1854, "I4", 7),
]  # fmt: skip
POSITION_ROWS = [
    (0, "B4", 3), (4, "B1", 18), (5, "B1", 30), (6, "B1", 18), (7, "B1", 20), (8, "B4", 4680),
    (12, "A32", "2"), (140, "I4", 28), (144, "I4", 2008), (148, "I4", 3), (152, "I4", 5),
    (156, "I4", 65), (160, "E22", 36400.25), (182, "E22", 60.0), (204, "A64", "ECR"),
    (4100, "I1", 0),
]  # fmt: skip


def field(kind, value):
    """Bytes of one value."""
    letter, size = kind[0], int(kind[1:])
    if letter in "BS":
        return int(value).to_bytes(size, "big", signed=letter == "S")
    if isinstance(value, bytes):
        return value
    if letter == "E" and isinstance(value, float):
        value = f"{value:.15E}"
    text = str(value).ljust(size) if letter == "A" else str(value).rjust(size)
    assert len(text) == size, (kind, value)
    return text.encode("latin-1")


def put(data, rows, start=0):
    for offset, kind, value in rows:
        data[start + offset : start + offset + int(kind[1:])] = field(kind, value)


def motion(t):
    """Earth-fixed position and velocity (..., 3) of a circular orbit, t in seconds of DAY."""
    rate, turn, tilt, radius = 1.0617e-3, 7.2921159e-5, np.deg2rad(98.16), 7.0716e6
    s, c = np.sin(rate * t), np.cos(rate * t)
    S, Co = np.sin(turn * t), np.cos(turn * t)
    x, y, z = radius * c, radius * s * np.cos(tilt), radius * s * np.sin(tilt)
    u, v, w = -rate * y / np.cos(tilt), rate * x * np.cos(tilt), rate * x * np.sin(tilt)
    r = np.stack([Co * x + S * y, -S * x + Co * y, z], -1)
    inertial = np.stack([Co * u + S * v, -S * u + Co * v, w], -1)
    return r, inertial - turn * np.stack([-r[..., 1], r[..., 0], 0 * z], -1)


@cache
def position_rows(t0=36400.25, step=60.0, count=28):
    return state_rows(np.hstack(motion(t0 + step * np.arange(count))))


def state_rows(states):
    """Of positions and velocities (n, 6)."""
    return [
        (386 + 132 * k + 22 * i, "E22", float(value))
        for k, state in enumerate(states)
        for i, value in enumerate(state)
    ]


def signal(lines=LINES, bins=SAMPLES + RIGHT, seed=3):
    """Codes (lines, bins, 2)."""
    return np.random.default_rng(seed).integers(0, 32, (lines, bins, 2), dtype=np.uint8)


def time_rows(line, day=65, ms=MS, year=2008, pri=PRI):
    t = ms * 1e-3 + WITHIN + line * pri
    late = int(t // 86400)
    now = int(np.floor((t - 86400 * late) * 1e3))
    return [(36, "B4", year), (40, "B4", day + late), (44, "B4", now)]


def image_bytes(rows=(), each=(), line=None, codes=None, numbers=range(1, LINES + 1), filler=b" ",
                length=LENGTH, **times):  # fmt: skip
    """An image file; ``line`` maps a line number to rows that replace what it would hold."""
    codes = signal() if codes is None else codes
    data = bytearray(720 + length * len(numbers))
    data[12:720] = filler * 708
    put(data, [*IMAGE_ROWS, (180, "I6", len(numbers)), (236, "I8", len(numbers)), *rows])
    prefix = bytearray(b"\xa5" * 412)
    put(prefix, [*LINE_ROWS, *each])
    for k, number in enumerate(numbers):
        start = 720 + k * length
        data[start : start + 412] = prefix
        own = [(0, "B4", k + 2), (12, "B4", number), *time_rows(number - 1, **times)]
        put(data, [*own, *(line or {}).get(number, ())], start)
        samples = codes[number - 1].tobytes()
        data[start + 412 : start + 412 + len(samples)] = samples
    return bytes(data)


def leader_bytes(rows=(), summary=(), position=(), filler=b" ", orbit=None):
    data = bytearray(START_CALIBRATION + 13212 + 3072)
    data[:] = filler * len(data)
    put(data, [*LEADER_ROWS, *rows])
    put(data, [*SUMMARY_ROWS, *summary], START_SUMMARY)
    orbit = position_rows() if orbit is None else orbit
    put(data, [*POSITION_ROWS, *orbit, *position], START_POSITION)
    for number, (start, code, length) in enumerate(
        [(START_ATTITUDE, 40, 8192), (START_CALIBRATION, 130, 13212), (30900, 200, 3072)], 4
    ):
        put(data, [(0, "B4", number), (4, "B1", 18), (5, "B1", code), (6, "B1", 18)], start)
        put(data, [(7, "B1", 20), (8, "B4", length)], start)
    return bytes(data)


IMAGE, LEADER = image_bytes(), leader_bytes()


def product(folder, image=IMAGE, leader=LEADER):
    (folder / f"IMG-HH-{NAME}").write_bytes(image)
    (folder / f"LED-{NAME}").write_bytes(leader)
    return folder
