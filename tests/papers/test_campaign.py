"""The campaign on small images: stopped and resumed, its parts, its agreement with direct runs."""

import subprocess
import sys
import time
from contextlib import contextmanager

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from small_images import SMALL

from navfilters.papers import pogorelsky2020
from navfilters.papers.pogorelsky2020 import __main__ as command
from navfilters.papers.pogorelsky2020.campaign import run_campaign as campaign
from navfilters.papers.pogorelsky2020.closed_loop import monte_carlo_closed
from navfilters.papers.pogorelsky2020.experiment import CASES
from navfilters.papers.pogorelsky2020.image_tables import assumed_speeds
from navfilters.papers.pogorelsky2020.imaging import Imaging
from navfilters.papers.pogorelsky2020.open_loop import monte_carlo
from navfilters.runs.locked_folder import LOCK, alone_in

pytestmark = pytest.mark.slow

RUNS, DIRECT = 6, 2
CHILD = """
import sys
from navfilters.papers.pogorelsky2020 import run_campaign
from navfilters.papers.pogorelsky2020 import Imaging
from navfilters.sar.raw import Radar
from navfilters.sar.matching import Matcher
run_campaign(sys.argv[1], {runs}, {direct}, imaging={imaging})
"""


class Work:
    """A bar that keeps what it is told."""

    @contextmanager
    def __call__(self, total):
        self.total, self.done = total, 0

        def done(units):
            self.done += units

        yield done


def contents(folder):
    files = (path for path in sorted(folder.iterdir()) if path.name != LOCK)
    return {path.name: path.read_bytes() for path in files}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder, work = tmp_path_factory.mktemp("whole") / "campaign", Work()
    found = campaign(folder, RUNS, DIRECT, imaging=SMALL, progress=work)
    return folder, found, work


def test_everything_is_stored(whole):
    folder, found, _ = whole
    names = {f"image-{k}.npz" for k in (1, 2, 3)} | {f"{case}.npz" for case in CASES}
    names |= {f"direct-{i:03d}-image-{k}.npz" for i in range(DIRECT) for k in (1, 2, 3)}
    assert set(contents(folder)) == names | {"summary.txt"}
    for case in CASES:
        with np.load(folder / f"{case}.npz") as stored:
            assert_array_equal(stored["errors"], found.closed[case].errors)
    assert (folder / "summary.txt").read_text() == pogorelsky2020.campaign_report(found)


def test_it_is_the_closed_loop(whole):
    found = whole[1]
    for case in CASES:
        loop = monte_carlo_closed(case, RUNS, imaging=SMALL)
        assert_array_equal(found.closed[case].errors, loop.errors)
        assert_array_equal(found.opened[case].errors, monte_carlo(case, 3, RUNS).errors)


def test_runs_that_form_their_images_agree(whole):
    """The same peak or, where two neighbours are as sharp, the other one; half a pixel."""
    images, otherwise, speed, pixel, deviations = whole[1].agreement
    assert (images, otherwise) == (3 * DIRECT, 0)
    assert speed <= SMALL.steps[-1] * (1 + 1e-6)
    assert pixel < SMALL.pixel / 2
    assert deviations < 0.1


def test_the_work_is_known_beforehand(whole, tmp_path):
    work = whole[2]
    images = len(assumed_speeds(SMALL))
    assert work.total == work.done == 3 * (2 * 40 + images) + 3 * DIRECT * 14
    again = Work()
    campaign(whole[0], RUNS, DIRECT, imaging=SMALL, progress=again)
    assert again.total == again.done == 0


def test_killed_and_resumed_it_ends_with_the_same_bytes(whole, tmp_path):
    """Killed twice, while tables and while direct runs are made, then finished here."""
    child = CHILD.format(runs=RUNS, direct=DIRECT, imaging=repr(SMALL))
    folder = tmp_path / "campaign"
    for file in ("image-2.npz", "direct-000-image-2.npz"):
        with subprocess.Popen(
            [sys.executable, "-c", child, str(folder)], stderr=subprocess.DEVNULL
        ) as process:
            while not (folder / file).exists():
                assert process.poll() is None
                time.sleep(0.01)
            process.kill()
        assert process.returncode < 0
    assert not (folder / "summary.txt").exists()
    work = Work()
    campaign(folder, RUNS, DIRECT, imaging=SMALL, progress=work)
    assert 0 < work.done == work.total < whole[2].total / 2
    assert contents(folder) == contents(whole[0])


def test_half_a_file_does_not_count(whole, tmp_path):
    """What a process leaves behind that ends while it writes."""
    for name, content in contents(whole[0]).items():
        (tmp_path / name).write_bytes(content)
    content = (tmp_path / "direct-001-image-3.npz").read_bytes()
    (tmp_path / "direct-001-image-3.npz").unlink()
    (tmp_path / "direct-001-image-3.npz.part").write_bytes(content[:100])
    campaign(tmp_path, RUNS, DIRECT, imaging=SMALL, progress=Work())
    assert contents(tmp_path) == contents(whole[0])


def test_damage_and_other_arguments_are_refused(whole, tmp_path):
    for name, content in contents(whole[0]).items():
        (tmp_path / name).write_bytes(content)
    for arguments in ((RUNS + 1, DIRECT), (RUNS, DIRECT, 1)):
        with pytest.raises(ValueError, match=r"TC-1.npz belongs to another campaign"):
            campaign(tmp_path, *arguments, imaging=SMALL, progress=Work())
    other = Imaging(**{**vars(SMALL), "seed": 1})
    with pytest.raises(ValueError, match=r"image-1.npz belongs to another campaign"):
        campaign(tmp_path, RUNS, DIRECT, imaging=other, progress=Work())
    (tmp_path / "image-2.npz").write_bytes(b"not an archive")
    with pytest.raises(ValueError, match=r"image-2.npz is damaged .*; delete it, and what it held"):
        campaign(tmp_path, RUNS, DIRECT, imaging=SMALL, progress=Work())
    (tmp_path / "image-2.npz").unlink()
    campaign(tmp_path, RUNS, DIRECT, imaging=SMALL, progress=Work())
    assert contents(tmp_path) == contents(whole[0])


def test_a_folder_of_the_older_axis_order_is_refused(whole, tmp_path):
    """Runs came first; told apart by the format and not by the shapes, which may be equal."""
    for name, content in contents(whole[0]).items():
        (tmp_path / name).write_bytes(content)
    with np.load(whole[0] / "TC-1.npz") as stored:
        arrays = dict(stored)
    arrays["job"] = np.array(str(arrays["job"]).replace("(2, ", "(", 1))
    for name in ("errors", "covariances", "innovations", "S"):
        arrays[name] = arrays[name].swapaxes(0, 1)
    np.savez(tmp_path / "TC-1.npz", **arrays)
    with pytest.raises(ValueError, match=r"TC-1.npz belongs to another campaign"):
        campaign(tmp_path, RUNS, DIRECT, imaging=SMALL, progress=Work())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"runs": 1}, "runs must be an integer of at least 2"),
        ({"direct": -1}, "direct must be an integer of at least 0"),
        ({"runs": 5, "direct": 6}, "direct must be at most runs, 5; found 6"),
        ({"seed": -1}, "seed must be an integer of at least 0"),
    ],
)
def test_refusals(tmp_path, arguments, message):
    with pytest.raises(ValueError, match=message):
        campaign(tmp_path / "new", **arguments)
    assert not (tmp_path / "new").exists()


def test_a_folder_that_another_uses_or_none_can_write_ends_the_command(tmp_path, capsys):
    (tmp_path / "a file").write_text("not a folder")
    with alone_in(tmp_path / "used"):
        for name, said in (("used", "another process works in this"), ("a file", "can be written")):
            with pytest.raises(SystemExit):
                command.main(["--campaign", str(tmp_path / name)])
            told = capsys.readouterr().err
            assert said in told
            assert str(tmp_path / name) in told
    assert (tmp_path / "a file").read_text() == "not a folder"


def test_the_command_prints_what_it_found(whole, monkeypatch, capsys):
    calls = []

    def stored(*arguments):
        calls.append(arguments)
        return whole[1]

    monkeypatch.setattr(command, "run_campaign", stored)
    command.main(["--campaign", "there", "--runs", "6", "--direct", "2"])
    out = capsys.readouterr().out
    assert calls == [("there", 6, 2, 0)]
    assert out.count("images failed") == 2
    assert "formed directly: 6 images, 0 with another end" in out


def test_the_command_says_what_is_wrong(monkeypatch, capsys):
    with pytest.raises(SystemExit):
        command.main(["--campaign", "there", "--runs", "1"])
    assert "--runs must be at least 2 and --seed at least 0; found 1, 0" in capsys.readouterr().err

    def stopped(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "run_campaign", stopped)
    with pytest.raises(SystemExit, match="stopped; the same command goes on where it was"):
        command.main(["--campaign", "there"])
