"""Shards of a large study: drawn by their number, and counted once."""

import json
import sys
from pathlib import Path

import pytest
from distributed import Client, LocalCluster
from numpy.testing import assert_array_equal
from sweeps import LOCAL

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))
import billion  # noqa: E402

sys.path.remove(str(BENCHMARKS))


def test_a_shard_is_its_number():
    (number, counts), (_, again), (_, other) = (billion.shard(n, 500, 3) for n in (7, 7, 8))
    assert number == 7
    assert counts.sum() == 500
    assert_array_equal(counts, again)
    assert (counts != other).any()


@pytest.mark.slow
def test_a_study_goes_on_where_it_was(tmp_path, monkeypatch):
    options = {"members": 300, "steps": 3}
    wanted = sum(billion.shard(n, **options)[1] for n in range(5))
    with LocalCluster(n_workers=1, processes=False, **LOCAL) as cluster, Client(cluster) as client:
        assert_array_equal(billion.study(client, tmp_path, 5, **options), wanted)
        billion.name(tmp_path, 3).unlink()
        sent = []
        monkeypatch.setattr(
            client,
            "map",
            lambda f, numbers, real=client.map, **o: sent.extend(numbers) or real(f, numbers, **o),
        )
        assert_array_equal(billion.study(client, tmp_path, 5, **options), wanted)
        assert sent == [3]
        with pytest.raises(ValueError, match="belongs to another study"):
            billion.study(client, tmp_path, 5, members=301, steps=3)


def test_the_stored_measurement_is_whole():
    stored = json.loads(billion.STORED.read_text())
    assert [int(size) for size in stored["chunks"]] == list(billion.CHUNKS)
    assert list(stored["files"]) == list(stored["chunks"])
    assert stored["edges"] == list(billion.EDGES[:-1])
    for row, shards in zip(stored["growth"], billion.GROWTH, strict=True):
        assert row["configurations"] == shards * stored["members"]
        assert sum(row["counts"]) == row["configurations"]  # all were finite
    _, fresh = billion.shard(0, stored["members"], stored["steps"])
    moved = abs(fresh - stored["growth"][0]["counts"])  # by last bits, at a border of two classes
    assert moved.max() <= 1e-3 * stored["members"]
