"""A sweep killed at random instants; ``make faults`` tries more of them, and campaigns too."""

import kills
import pytest


@pytest.mark.slow
@pytest.mark.parametrize("work", ["sweep", "sweep with two workers"])
def test_a_sweep_that_was_killed_ends_with_the_same_bytes(work):
    found = kills.study(work, 2, seed=3)
    assert found["files"] == kills.CHUNKS + 1
    assert all(run["same"] for run in found["runs"])
    assert sum(run["killed"] for run in found["runs"]) == 2


def test_other_bytes_are_seen(tmp_path, monkeypatch):
    """What the study compares is what the process left."""
    (tmp_path / "whole").mkdir()
    (tmp_path / "whole" / "chunk").write_bytes(b"right")

    def resumed(folder):
        folder.mkdir(exist_ok=True)
        (folder / "chunk").write_bytes(b"wrong")

    monkeypatch.setattr(kills, "killed", lambda *_: True)
    monkeypatch.setitem(kills.WORK, "sweep", resumed)
    assert not kills.trial("sweep", tmp_path / "whole", tmp_path / "other", 0.0)["same"]
