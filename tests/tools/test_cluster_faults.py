"""The faults of a cluster, one of them tried; ``make faults`` tries all of them, and more often."""

import cluster_faults
import pytest


@pytest.mark.slow
def test_a_killed_worker_leaves_the_same_bytes(tmp_path):
    row = cluster_faults.Study("one worker killed", 3, tmp_path).trial()
    assert row["same"]
    assert row["said"] == ""
    assert row["told"] == cluster_faults.CHUNKS * cluster_faults.SIZE
    assert row["chunks"] == cluster_faults.CHUNKS


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(cluster_faults, "SECONDS", 0.0)


def test_what_is_left_tells_other_bytes_and_not_another_place(quick, tmp_path):
    for place in ("one", "two"):
        cluster_faults.swept(tmp_path / place, workers=1)
    one, two = (cluster_faults.left(tmp_path / place) for place in ("one", "two"))
    assert one == two
    (tmp_path / "two" / "result").write_bytes(b"other")
    assert cluster_faults.left(tmp_path / "two") != one


def test_every_computation_leaves_its_mark(quick, tmp_path):
    row = cluster_faults.swept(tmp_path / "one", workers=1)
    assert row == {"said": "", "told": cluster_faults.CHUNKS * cluster_faults.SIZE}
    marks = (tmp_path / "one" / "marks").read_text().split()
    assert len(set(marks)) == len(marks) == cluster_faults.CHUNKS
