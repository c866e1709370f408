"""A full disk, a folder that cannot be written, two processes in one folder: told, no damage."""

import errno
import os
import re
import subprocess
import sys
from contextlib import contextmanager

import pytest
from sweeps import BASE, EKF, assert_same, priors

from navfilters import sweep
from navfilters.runs import stored_arrays
from navfilters.runs.locked_folder import LOCK, alone_in

SECOND = "chunk-000001.npz"


def stored(folder, progress=False):
    """Four chunks, one after the other."""
    options = {"steps": 3, "chunk": 3, "workers": 1, "checkpoint": folder, "progress": progress}
    return sweep(EKF, priors(12), BASE.z, BASE.model, **options)


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != LOCK}


@contextmanager
def files_of_at_most(size):
    """The system stops a write at this length, halfway through a chunk."""
    resource = pytest.importorskip("resource")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        yield lambda _: resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def test_a_write_that_stops_halfway_leaves_what_was_there(tmp_path):
    with files_of_at_most(700) as from_now_on, pytest.raises(OSError, match="too large") as told:
        stored(tmp_path, progress=from_now_on)
    assert told.value.errno == errno.EFBIG
    assert told.value.filename == str(tmp_path / SECOND)
    assert "what was stored before is whole; call again" in str(told.value)
    assert list(contents(tmp_path)) == ["chunk-000000.npz"]
    wanted = stored(tmp_path / "undisturbed")
    assert_same(stored(tmp_path).final, wanted.final)
    for name, content in contents(tmp_path / "undisturbed").items():
        assert (tmp_path / name).read_bytes() == content


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
def test_a_full_disk_is_told(tmp_path):
    (tmp_path / f"{SECOND}.part").symlink_to("/dev/full")
    with pytest.raises(OSError, match=re.escape(str(tmp_path / SECOND))) as told:
        stored(tmp_path)
    assert told.value.errno == errno.ENOSPC
    assert list(contents(tmp_path)) == ["chunk-000000.npz"]


@pytest.mark.parametrize("stage", ["fsync", "replace"])
def test_a_file_that_cannot_be_replaced_is_as_it_was(stage, tmp_path, monkeypatch):
    def fails(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    path = tmp_path / "some.npz"
    stored_arrays.write(path, b"older")
    monkeypatch.setattr(stored_arrays.os, stage, fails)
    with pytest.raises(OSError, match=r"No space left on device; what was stored.*some\.npz"):
        stored_arrays.write(path, b"newer")
    assert contents(tmp_path) == {"some.npz": b"older"}


def test_content_is_on_the_disk_before_its_name(tmp_path, monkeypatch):
    """Else a power cut could leave a chunk of the right name and length, full of zeros."""
    order = []
    for stage in ("fsync", "replace"):
        real = getattr(os, stage)
        monkeypatch.setattr(
            stored_arrays.os, stage, lambda *a, s=stage, real=real: order.append(s) or real(*a)
        )
    stored_arrays.write(tmp_path / "some.npz", b"content")
    assert order == ["fsync", "replace"]


def a_file(place):
    place.write_text("mine")


def below_a_file(place):
    place.parent.write_text("mine")


def without_a_lock(place):
    (place / LOCK).mkdir(parents=True)


def read_only(place):
    if not hasattr(os, "geteuid") or os.geteuid() == 0:
        pytest.skip("root may write everywhere")
    place.mkdir()
    place.chmod(0o500)


@pytest.mark.parametrize("make", [a_file, below_a_file, without_a_lock, read_only])
def test_a_folder_that_cannot_be_written_is_told_before_any_chunk(make, tmp_path):
    place, computed = tmp_path / "one" / "two", []
    place.parent.parent.mkdir(exist_ok=True)
    if make is not below_a_file:
        place.parent.mkdir()
    make(place)
    with pytest.raises(OSError, match="a folder that can be written is needed") as told:
        stored(place, progress=computed.append)
    assert told.value.filename == str(place)
    assert computed == []


def test_a_folder_that_goes_away_on_the_way_is_told(tmp_path):
    folder = tmp_path / "some"
    with pytest.raises(FileNotFoundError, match=re.escape(str(folder / SECOND))):
        stored(folder, progress=lambda _: folder.exists() and folder.rename(tmp_path / "moved"))
    assert list(contents(tmp_path / "moved")) == ["chunk-000000.npz"]


def test_a_chunk_that_cannot_be_read_is_not_called_damaged(tmp_path):
    (tmp_path / SECOND).mkdir()
    with pytest.raises(OSError, match=re.escape(SECOND)):
        stored(tmp_path)


def test_a_second_sweep_in_the_folder_is_refused(tmp_path):
    def again(_):
        with pytest.raises(BlockingIOError, match=r"another process works in this folder; wait"):
            stored(tmp_path)
        refused.append(contents(tmp_path))

    refused = []
    wanted = stored(tmp_path, progress=again)
    assert [len(files) for files in refused] == [1, 2, 3, 4]
    assert_same(stored(tmp_path).final, wanted.final)


HOLDS = """
import sys, time
from pathlib import Path
from navfilters.runs.locked_folder import alone_in
with alone_in(Path(sys.argv[1])):
    print("in", flush=True)
    time.sleep(60)
"""


def test_a_lock_ends_with_its_process_however_that_ends(tmp_path):
    command = [sys.executable, "-c", HOLDS, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        with pytest.raises(BlockingIOError, match="another process") as told:
            stored(tmp_path)
        assert told.value.filename == str(tmp_path)
        process.kill()
    stored(tmp_path)


def test_where_no_file_can_be_locked_work_goes_on(tmp_path, monkeypatch):
    """Some file systems of clusters have no locks."""
    fcntl = pytest.importorskip("fcntl")

    def none(*_):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", none)
    with alone_in(tmp_path), alone_in(tmp_path):
        assert (tmp_path / LOCK).exists()
