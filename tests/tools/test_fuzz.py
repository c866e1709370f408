"""The fuzzer itself: an input is known by its number, and each way to break a reader is seen."""

import io
import random
import threading

import damage
import damage_steps
import fuzz
import pytest
import valid_files
from readers import READERS


@pytest.mark.parametrize("name", READERS)
def test_an_input_is_known_by_its_number(name, tmp_path):
    reader = READERS[name]
    if reader.missing:
        pytest.skip(f"needs {reader.package}")
    valid = reader.valid(tmp_path / reader.file)
    twice = [
        [fuzz.damaged(name, valid, reader.layout, 1, number) for number in range(20)]
        for _ in range(2)
    ]
    assert twice[0] == twice[1]
    assert len(set(twice[0])) > 10


@pytest.mark.parametrize("layout", damage.OWN)
def test_damage_stands_any_bytes(layout):
    """Also what earlier damage left of a file."""
    if layout == "parquet":
        pytest.importorskip("pyarrow")
    draw = random.Random(3)
    for _ in range(300):
        data = bytearray(draw.randbytes(draw.randrange(40)))
        for step in (*damage.OWN[layout], *damage_steps.ANY):
            step(data, draw, b"other")


def test_damage_leaves_no_object_to_threads(monkeypatch, tmp_path):
    """tracemalloc, stopped while a thread of Arrow frees what it read, ends the interpreter."""
    pytest.importorskip("pyarrow")
    readers_of_bytes = set()

    class Told(io.BytesIO):
        def read(self, size=-1):
            readers_of_bytes.add(threading.get_ident())
            return super().read(size)

    whole = valid_files.parquet(tmp_path / "log.parquet")[0]
    monkeypatch.setattr(damage.io, "BytesIO", Told)
    damage.column(bytearray(whole), random.Random(1), whole)
    assert readers_of_bytes == {threading.get_ident()}


@pytest.fixture
def studied(monkeypatch, tmp_path):
    """Blocks of four inputs each; one that hangs does so for a second."""
    monkeypatch.setattr(fuzz, "BLOCK", 4)
    monkeypatch.setattr(fuzz, "LONGEST", 1.0)
    monkeypatch.setattr(fuzz.sys.stdout, "write", lambda text: None)

    def study(name, inputs=8):
        return fuzz.study({name: inputs}, 1, 1, tmp_path / "journal", "breaking_readers")[name]

    return study


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("raises", "KeyError: 'file'"),
        ("hides the name", "it is wrong"),
        ("takes memory", "64.0 MiB"),
        ("ends the interpreter", "interpreter ended with -6: Fatal Python error: Aborted"),
        ("hangs", "no end after 1 s, twice"),
    ],
)
def test_each_fault_is_seen_and_the_rest_goes_on(name, message, studied):
    blocks = studied(name)
    assert [row["start"] for row in blocks] == [0, 4]
    found = fuzz.told(blocks, {})
    assert found["inputs"] == 8
    assert found["fault"] == len(found["faults"]) > 0
    assert all(message in fault for fault in found["faults"].values())


@pytest.mark.slow
def test_what_is_done_is_not_done_again(studied, monkeypatch):
    first = studied("sound")
    monkeypatch.setattr(fuzz, "blocks_of", lambda name, seed, inputs, done, module: iter(()))
    assert studied("sound") == first
    assert fuzz.told(first, {})["fault"] == 0


def test_lines_that_damage_reaches_are_counted():
    lines = fuzz.reached("readers", "coefficients", 1, 400)
    assert lines["valid"] < lines["damaged"] <= lines["lines"]
