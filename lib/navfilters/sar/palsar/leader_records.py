"""The records of a PALSAR leader file, field by field."""

from navfilters.sar.palsar.ceos_fields import Field

_DAY = 86400.0

LEADER = {
    "file name": Field(48, "A16"),
    "number of data set summary records": Field(180, "I6", 1, 1, seen="A"),
    "number of map projection records": Field(192, "I6", 0, 1, seen="A"),
    "number of platform position records": Field(204, "I6", 1, 1, seen="A"),
    "number of attitude records": Field(216, "I6", 0, 1, seen="B"),
    **{
        f"number of records at byte {offset}": Field(offset, "I6", 0, 99, seen="B")
        for offset in (*range(228, 349, 12), 420)
    },
}

SUMMARY = {
    "scene": Field(20, "A32"),
    "scene centre time": Field(68, "A32"),
    "ellipsoid": Field(164, "A16"),
    "platform": Field(396, "A16", seen="A"),
    "sensor and mode": Field(412, "A32", seen="C"),
    "orbit number": Field(444, "A8", seen="A"),
    "clock angle in deg": Field(476, "F8"),
    "incidence in deg": Field(484, "F8"),
    "frequency in GHz": Field(492, "F8", 0, 10, seen="B"),
    "wavelength in m": Field(500, "F16", 0.2, 0.3, seen="A"),
    "chirp rate in Hz/s": Field(550, "F16", -1e13, 1e13, seen="B"),
    "sampling rate in MHz": Field(710, "F16", 1, 100, seen="A"),
    "range gate in us": Field(726, "F16"),
    "pulse length in us": Field(742, "F16", 0, 100, seen="A"),
    "quantisation bits": Field(798, "I8"),
    "DC bias of I": Field(818, "F16", 1, 31, seen="B"),
    "DC bias of Q": Field(834, "F16", 1, 31, seen="B"),
    "PRF in mHz": Field(934, "F16"),
    "facility": Field(1046, "A16", seen="A"),
    "processing system": Field(1062, "A8", seen="B"),
    "version": Field(1070, "A8"),
    "level": Field(1094, "A16", seen="B"),
    "direction along a line": Field(1534, "A8"),
    "Doppler constant term": Field(1734, "F16"),  # of processed images: shown, never used
    "Doppler linear term": Field(1750, "F16"),
    "calibration data": Field(1766, "I4", 0, 1, seen="B"),
    "first calibration line at the top": Field(1770, "I8", 0, 9_999_999, seen="B"),
    "last calibration line at the top": Field(1778, "I8", 0, 9_999_999, seen="B"),
    "first calibration line at the bottom": Field(1786, "I8", 0, 9_999_999, seen="B"),
    "last calibration line at the bottom": Field(1794, "I8", 0, 9_999_999, seen="B"),
    "PRF changes": Field(1802, "I4"),
    "line of PRF change": Field(1806, "I8"),
    "yaw steering off": Field(1830, "I4"),
    "off-nadir angle in deg": Field(1838, "F16", seen="A"),
    "beam number": Field(1854, "I4", seen="A"),
}

_POINT = 132  # bytes a state vector

_STATE = {
    **{
        f"{axis} in m": Field(386 + 22 * i, "F22", -7.3e6, 7.3e6, seen="A")
        for i, axis in enumerate("xyz")
    },
    **{
        f"v{axis} in m/s": Field(452 + 22 * i, "F22", -8e3, 8e3, seen="A")
        for i, axis in enumerate("xyz")
    },
}

POSITION = {
    "orbit kind": Field(12, "A32", seen="A"),
    "number of points": Field(140, "I4", 8, 28, seen="A"),
    "year": Field(144, "I4", 2006, 2011, seen="A"),  # from launch to the end of the mission
    "month": Field(148, "I4", 1, 12, seen="A"),
    "day": Field(152, "I4", 1, 31, seen="A"),
    "day of year": Field(156, "I4", 1, 366, seen="A"),
    "second of day": Field(160, "F22", 0, _DAY, seen="A"),
    "interval in s": Field(182, "F22", 1, 300, seen="A"),
    "frame": Field(204, "A64", seen="A"),
    **_STATE,
    "leap second flag": Field(4100, "I1", 0, 9, seen="B"),
}

_USED = {10: ("data set summary", 4096, SUMMARY), 30: ("platform position", 4680, POSITION)}

_NAMES = {
    **{code: name for code, (name, _, _) in _USED.items()},
    20: "map projection",
    40: "attitude",
    50: "radiometric",
    60: "data quality",
    130: "calibration",
    200: "facility related",
}

_LATER = {
    "ALOS2": ": a product of PALSAR-2, another radar, which is not read",
    "ALOS4": ": a product of PALSAR-3, another radar, which is not read",
}

_PROCESSED = {
    "1.1": ", an image that is focused already",
    "1.5": ", an image that is focused and projected already",
}
