"""Damage to valid files: of any bytes, and such as keeps a file's layout and spoils what it says.

All of it is drawn from one ``random.Random``, so that an input is known by its seed.
"""

import io
import random
import struct
from datetime import datetime

import palsar_files as palsar
from damage_steps import ANY, EDGES, NUMBERS, TEXT, Step

EPOCH = datetime(2010, 11, 2)
LEADER_FIELDS = [
    (start + offset, kind)
    for start, rows in (
        (0, palsar.LEADER_ROWS),
        (palsar.START_SUMMARY, palsar.SUMMARY_ROWS),
        (palsar.START_POSITION, palsar.POSITION_ROWS + palsar.position_rows()[:12]),
    )
    for offset, kind, _ in rows
]
LINE_FIELDS = [(offset, kind) for offset, kind, _ in palsar.LINE_ROWS] + [
    (0, "B4"), (12, "B4"), (36, "B4"), (40, "B4"), (44, "B4"),
]  # fmt: skip
LINE_STARTS = range(720, len(palsar.IMAGE), palsar.LENGTH)
IMAGE_FIELDS = [(offset, kind) for offset, kind, _ in palsar.IMAGE_ROWS]


def field(fields: list[tuple[int, str]]) -> Step:
    """Another value in a field of the format, in the field's own way of writing."""

    def step(data: bytearray, draw: random.Random, other: bytes) -> None:
        start, kind = draw.choice(fields)
        spoil(data, start, kind, draw, other)

    return step


def line_field(data: bytearray, draw: random.Random, other: bytes) -> None:
    """One field of one line, of all lines, or of all from one on."""
    offset, kind = draw.choice(LINE_FIELDS)
    first = draw.randrange(len(LINE_STARTS))
    last = draw.choice((first + 1, len(LINE_STARTS)))
    before = LINE_STARTS[first] + offset
    spoil(data, before, kind, draw, other)
    size = int(kind[1:])
    for start in LINE_STARTS[first + 1 : last]:
        data[start + offset : start + offset + size] = data[before : before + size]


def spoil(data: bytearray, start: int, kind: str, draw: random.Random, other: bytes) -> None:
    size = int(kind[1:])
    old = bytes(data[start : start + size])
    if draw.randrange(5) == 0:
        new = other[start : start + size] if draw.randrange(2) else draw.randbytes(size)
    elif kind[0] in "BS":
        near = int.from_bytes(old, "big") + draw.choice((-1000, -1, 1, 1000))
        new = (draw.choice((near, *EDGES)) % 2 ** (8 * size)).to_bytes(size, "big")
    else:
        text = draw.choice((*NUMBERS, near_text(old, draw)))
        new = (text.ljust if kind[0] == "A" else text.rjust)(size).encode()[:size]
    data[start : start + size] = new


def near_text(old: bytes, draw: random.Random) -> str:
    """One digit of a number is another."""
    text = list(old.decode("latin-1"))
    digits = [i for i, letter in enumerate(text) if letter.isdigit()]
    if digits:
        text[draw.choice(digits)] = draw.choice("0123456789-. ")
    return "".join(text)


def records(starts: list[int]) -> Step:
    """Whole records are left out, doubled or swapped, or one is longer than it says."""

    def step(data: bytearray, draw: random.Random, other: bytes) -> None:
        del other
        pieces = [data[a:b] for a, b in zip(starts, [*starts[1:], len(data)], strict=True)]
        a, b = draw.randrange(len(pieces)), draw.randrange(len(pieces))
        what = draw.randrange(4)
        if what == 0:
            del pieces[a]
        elif what == 1:
            pieces.insert(b, pieces[a])
        elif what == 2:
            pieces[a], pieces[b] = pieces[b], pieces[a]
        else:
            pieces[a] = pieces[a] + draw.randbytes(draw.choice((1, 4, 412)))
        data[:] = b"".join(pieces)

    return step


RECORDS = [0, palsar.START_SUMMARY, palsar.START_POSITION, palsar.START_ATTITUDE,
           palsar.START_CALIBRATION]  # fmt: skip
LEADER: tuple[Step, ...] = (field(LEADER_FIELDS),) * 5 + (records(RECORDS),)
IMAGE: tuple[Step, ...] = (
    *(line_field, line_field, line_field, field(IMAGE_FIELDS), field(IMAGE_FIELDS)),
    records([0, *LINE_STARTS]),
)


def directory(data: bytearray) -> tuple[str, int, int, list[int]]:
    """Byte order, classic (4) or big (8), and where the first directory and its entries begin."""
    order = ">" if data[:2] == b"MM" else "<"
    wide = data[2:4] in (b"\x2b\0", b"\0\x2b")
    head, count, size = ("Q", "Q", 20) if wide else ("I", "H", 12)
    try:
        (at,) = struct.unpack_from(order + head, data, 8 if wide else 4)
        (n,) = struct.unpack_from(order + count, data, at)
    except (struct.error, OverflowError):
        return order, 4, 0, []
    first = at + struct.calcsize(count)
    entries = [first + size * k for k in range(min(n, 64)) if first + size * (k + 1) <= len(data)]
    return order, 8 if wide else 4, at, entries


TAGS = (254, 256, 257, 258, 259, 262, 273, 277, 278, 279, 284, 317, 322, 323, 324, 325, 338, 339,
        33550, 33922, 34264, 34735, 34736, 34737, 42112, 42113)  # fmt: skip


def tag(data: bytearray, draw: random.Random, other: bytes) -> None:
    """One part of one entry: its tag, type, count, value, or a number that the value points to."""
    order, width, _, entries = directory(data)
    if not entries:
        return
    at = draw.choice(entries)
    what = draw.randrange(6)
    if what == 0:
        struct.pack_into(order + "H", data, at, draw.choice(TAGS))
    elif what == 1:
        struct.pack_into(order + "H", data, at + 2, draw.randrange(20))
    elif what == 2:
        struct.pack_into(order + "Q" * (width == 8) + "I" * (width == 4), data, at + 4,
                         draw.choice(EDGES))  # fmt: skip
    elif what == 3:
        number = draw.choice((*EDGES, data[at + 4 + width] + draw.choice((-1, 1)) & 255))
        short = draw.randrange(2)
        struct.pack_into(order + "HI"[not short], data, at + 4 + width, number % 65536 if short
                         else number)  # fmt: skip
    elif what == 4:
        b = draw.choice(entries)
        size = 12 + 8 * (width == 8)
        data[at : at + size], data[b : b + size] = data[b : b + size], data[at : at + size]
    else:
        (points,) = struct.unpack_from(order + "QI"[width == 4], data, at + 4 + width)
        spot = points + 8 * draw.randrange(4)
        if spot <= len(data) - 8:
            number = draw.choice((0.0, -1.0, 1e-300, 1e300, float("nan"), float("inf"), 90.0,
                                  -180.0, 1e-5, 6378137.0))  # fmt: skip
            struct.pack_into(order + "d", data, spot, number)


def chain(data: bytearray, draw: random.Random, other: bytes) -> None:
    """The directory has another place or length, or another behind it, such as itself."""
    del other
    order, width, at, entries = directory(data)
    if not entries:
        return
    place = draw.choice((0, 4, 8, at, at + 2, len(data) - 6, len(data), draw.choice(EDGES)))
    letter = "QI"[width == 4]
    where = draw.randrange(3)
    if where == 0:
        struct.pack_into(order + letter, data, width, place)
    elif where == 1 and entries[-1] + 12 + 8 * (width == 8) + width <= len(data):
        struct.pack_into(order + letter, data, entries[-1] + 12 + 8 * (width == 8), place)
    else:
        struct.pack_into(order + "H", data, at, draw.choice((0, 1, len(entries) - 1, 500, 65535)))


COLUMNS = ("time", "innovation_1", "innovation_2", "innovation_9", "S_11", "S_12", "S_1_1",
           "error_1", "P_11", "note", "")  # fmt: skip


def column(data: bytearray, draw: random.Random, other: bytes) -> None:
    """One column of a table has another name, kind, order or number of rows, or lacks a number."""
    del other
    import pyarrow
    from pyarrow import parquet

    try:
        # By this thread alone: others would give back Python's objects later, which ends CPython
        # before 3.12.9 and 3.13.2 if tracemalloc stops meanwhile (python/cpython issue 128679).
        file = parquet.ParquetFile(io.BytesIO(bytes(data)), pre_buffer=False)
        table = file.read(use_threads=False)
        columns = {name: table[name].to_pylist() for name in table.column_names}
    except Exception:  # pyarrow raises nearly anything; a file that is damaged already stays so
        return
    if not columns:
        return
    name, what = draw.choice(list(columns)), draw.randrange(6)
    values = columns[name]
    if what == 0:
        columns[draw.choice(COLUMNS)] = columns.pop(name)
    elif what == 1:
        columns[name] = draw.choice((
            [str(v) for v in values], [bool(v) for v in values], [[v] for v in values],
            [EPOCH for _ in values], list(range(len(values))), [None for _ in values],
        ))  # fmt: skip
    elif what == 2:
        values.reverse()
    elif what == 3 and values:
        values[draw.randrange(len(values))] = draw.choice(
            (None, float("nan"), float("inf"), -1e308, 0.0)
        )
    elif what == 4:
        rows = draw.randrange(len(values) + 1)
        columns = {key: every[:rows] for key, every in columns.items()}
    else:
        del columns[name]
    whole = io.BytesIO()
    try:
        parquet.write_table(pyarrow.table(columns), whole)
    except (pyarrow.ArrowException, OverflowError, ValueError):  # of several kinds, or too large
        return
    data[:] = whole.getvalue()


TIFF: tuple[Step, ...] = (tag,) * 5 + (chain,)
OWN: dict[str, tuple[Step, ...]] = {
    "ceos leader": LEADER,
    "ceos image": IMAGE,
    "text": TEXT,
    "tiff": TIFF,
    "parquet": (column,),
}
"""Damage that keeps the layout."""


def damaged(valid: list[bytes], layout: str, draw: random.Random) -> bytes:
    """One file of several valid ones with one to four faults, or, of a hundred, bytes of any kind.

    Parameters
    ----------
    valid : list of bytes
    layout : str
        A key of ``OWN``. Of the faults two thirds keep this layout.
    draw : random.Random

    Returns
    -------
    bytes
    """
    if draw.randrange(100) == 0:
        return draw.randbytes(draw.randrange(300))
    data, other = bytearray(draw.choice(valid)), draw.choice(valid)
    for _ in range(draw.choice((1, 1, 1, 2, 2, 3, 4))):
        steps = OWN[layout] if draw.randrange(3) else ANY
        draw.choice(steps)(data, draw, other)
    return bytes(data)
