"""Stored results are replaced as a whole, or stay as they were."""

import errno

import pytest

from navfilters.problems import stored
from navfilters.problems.fresh import read_fresh, write_fresh
from navfilters.problems.histories import read, write
from navfilters.runs import stored_arrays

COURSES, FOUND = read()
WRITERS = {
    "table": lambda path: stored.write(path, stored.read()[:3]),
    "fresh": lambda path: write_fresh(path, read_fresh()[:3]),
    "histories": lambda path: write(path, COURSES.values(), FOUND[:3]),
}


@pytest.mark.parametrize("store", WRITERS.values(), ids=WRITERS)
def test_a_full_disk_leaves_the_older_result(store, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    path = tmp_path / "stored"
    store(path)
    older = path.read_bytes()
    monkeypatch.setattr(stored_arrays.os, "fsync", full)
    with pytest.raises(OSError, match="what was stored before is whole"):
        store(path)
    assert [p.read_bytes() for p in tmp_path.iterdir()] == [older]


def test_a_computation_that_stops_leaves_the_older_table(tmp_path):
    def stopped():
        yield stored.read()[0]
        raise KeyboardInterrupt

    path = tmp_path / "stored"
    path.write_text("older")
    with pytest.raises(KeyboardInterrupt):
        stored.write(path, stopped())
    assert path.read_text() == "older"
