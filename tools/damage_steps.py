"""Damage to any bytes, and to text: bytes, numbers, words and lines are spoiled.

Each step changes the data in place, draws from one ``random.Random``, and may take from another
valid file.
"""

import random
import re
from collections.abc import Callable

NUMBERS = (
    *("nan", "NaN", "inf", "-inf", "0", "-0.0", "-1", "1", "1e308", "-1e308", "1e-320", "1e999"),
    *("99999999", "-9999999", "2147483647", "2147483648", "18446744073709551616", "1D+05", "1_0"),
    *("0x10", "1.5.2", "--1", "+", ".", "", "true", "1e", "\u0663", "9" * 5000, "1" + "0" * 400),
)
WORDS = (
    *("", " ", "\t", ",", ";", "=", '"', '"""', "'", "#", "[", "]]", "{", "}", "\\", "\\u0000"),
    *("\0", "\r", "\n", "\r\n", "\ufeff", "é", "\U0001f600", "a.b", "time", "S_11", "S_1_1"),
    *("innovation_2", "innovation_0", "innovation_99999999", "error_1", "P_11", "RANGE", "AZ_EL"),
    *("2010-11-02T03:00:10+02:00", "0001-01-01", "9999-12-31T23:59:59", "2010-13-40", "x" * 10000),
    *("[" * 500, "[" * 5000, "{a=" * 2000, "[a]\n", "[[claim]]\n", "[[statement]]\n", "[word.x]\n"),
    *("a" + ".a" * 3000 + " = 1\n", "id = 1\n", "verdict = 'reproduced'\n", "word = 3\n"),
    *("ours = {}\n", "kind = 'value'\n", "kind = 'order'\n", "claims = []\n", "open = 'x'\n"),
)
VALUES = (
    *("1", "-1.5", "nan", "inf", "true", '""', '"x"', "[]", "[1]", "{}", "{ a = 1 }", "1979-05-27"),
    *("[[]]", "07:32:00", "0x7fffffffffffffff", "'reproduced'", "'established here'", "'value'"),
    *("{ rel = 'x' }", "{ at_most = nan }", "{ factor = 0 }", "[{ was = 1 }]"),
)
EDGES = (0, 1, 2, 7, 8, 127, 128, 255, 256, 32767, 32768, 65535, 65536, 2**31 - 1, 2**31, 2**32 - 1)
Step = Callable[[bytearray, random.Random, bytes], None]


def some(data: bytearray, draw: random.Random, most: int = 64) -> slice:
    """A short piece of the data."""
    start = draw.randrange(len(data) + 1)
    return slice(start, start + draw.randint(1, most))


def flip(data: bytearray, draw: random.Random, other: bytes) -> None:
    del other
    for _ in range(draw.choice((1, 1, 2, 8))):
        if data:
            data[draw.randrange(len(data))] ^= 1 << draw.randrange(8)


def overwrite(data: bytearray, draw: random.Random, other: bytes) -> None:
    del other
    at = some(data, draw, 16)
    data[at] = draw.randbytes(len(data[at]))


def fill(data: bytearray, draw: random.Random, other: bytes) -> None:
    del other
    at = some(data, draw, 400)
    data[at] = draw.choice((b"\0", b" ", b"\xff", b"0", b"\n")) * len(data[at])


def whole_number(data: bytearray, draw: random.Random, other: bytes) -> None:
    """A number of a machine in the place of another."""
    del other
    size, at = draw.choice((1, 2, 4, 8)), draw.randrange(len(data) + 1)
    number = draw.choice(EDGES) % 2 ** (8 * size)
    data[at : at + size] = number.to_bytes(size, draw.choice(("big", "little")))


def cut_out(data: bytearray, draw: random.Random, other: bytes) -> None:
    del other
    del data[some(data, draw, 200)]


def insert(data: bytearray, draw: random.Random, other: bytes) -> None:
    del other
    at = some(data, draw).start
    data[at:at] = draw.randbytes(draw.randint(1, 40))


def double(data: bytearray, draw: random.Random, other: bytes) -> None:
    del other
    at = some(data, draw, 200)
    data[at.start : at.start] = data[at] * draw.choice((1, 1, 2, 20))


def swap(data: bytearray, draw: random.Random, other: bytes) -> None:
    del other
    a, b = sorted((some(data, draw), some(data, draw)), key=lambda piece: piece.start)
    if a.stop <= b.start:
        data[a.start : b.stop] = data[b] + data[a.stop : b.start] + data[a]


def end_early(data: bytearray, draw: random.Random, other: bytes) -> None:
    del other
    del data[draw.randrange(len(data) + 1) :]


def splice(data: bytearray, draw: random.Random, other: bytes) -> None:
    """The start of one file and the end of another, at the same place or not."""
    at = draw.randrange(len(data) + 1)
    data[at:] = other[draw.choice((at, draw.randrange(len(other) + 1))) :]


def insert_number(data: bytearray, draw: random.Random, other: bytes) -> None:
    """A number in text over what stands there."""
    del other
    text, at = draw.choice(NUMBERS).encode(), some(data, draw).start
    data[at : at + draw.choice((0, len(text), 8, 16))] = text


ANY: tuple[Step, ...] = (
    *(flip, overwrite, fill, whole_number, cut_out, insert, double, swap, end_early, splice),
    insert_number,
)


TOKEN = re.compile(rb"[-+]?[0-9][-+0-9.eE]*|\w+")
VALUE = re.compile(rb"=[ \t]*([^\n]*)")


def replaced(pattern: re.Pattern[bytes], group: int, choices: tuple[str, ...]) -> Step:
    def step(data: bytearray, draw: random.Random, other: bytes) -> None:
        del other
        found = list(pattern.finditer(data))
        if found:
            at = draw.choice(found)
            data[at.start(group) : at.end(group)] = draw.choice(choices).encode()

    return step


def lines(data: bytearray, draw: random.Random, other: bytes) -> None:
    """One line is left out, doubled, moved, mixed or taken from another file."""
    mine, others = data.splitlines(keepends=True), other.splitlines(keepends=True)
    if not mine or not others:
        return
    at, to = draw.randrange(len(mine)), draw.randrange(len(mine) + 1)
    what = draw.randrange(5)
    if what == 0:
        del mine[at]
    elif what == 1:
        mine[at:at] = mine[at : at + 1] * draw.choice((1, 2, 300))
    elif what == 2:
        mine.insert(to, mine[at])
    elif what == 3:
        draw.shuffle(mine)
    else:
        mine[to:to] = others[draw.randrange(len(others)) :]
    data[:] = b"".join(mine)


def insert_word(data: bytearray, draw: random.Random, other: bytes) -> None:
    del other
    at = some(data, draw).start
    data[at:at] = draw.choice(WORDS).encode()


TEXT: tuple[Step, ...] = (
    replaced(TOKEN, 0, NUMBERS),
    replaced(TOKEN, 0, WORDS),
    replaced(VALUE, 1, VALUES),
    lines,
    lines,
    insert_word,
)
