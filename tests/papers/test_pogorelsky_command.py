"""The experiment as a command: its tables, its arguments, and files that are not there."""

import re
import subprocess
import sys
from functools import partial

import numpy as np
import pytest
from palsar_scene import LOST, SMALL

from navfilters.papers import pogorelsky2020
from navfilters.papers.pogorelsky2020 import __main__ as command
from navfilters.papers.pogorelsky2020 import real_loop


@pytest.mark.slow
def test_the_command_navigates(folder, capsys, monkeypatch):
    """From the files to the table, each number of which is read back here."""
    monkeypatch.setattr(command, "report", partial(pogorelsky2020.report, imaging=SMALL))
    command.main(
        f"--closed-loop --palsar {folder} --dem {folder}/dem.tif --reference "
        f"{folder}/reference.tif --case TC-2 --runs 2 --seed 1".split()
    )
    out = capsys.readouterr().out
    assert out.startswith("IMG-HH-ALPSRP230940670-H1.0__A, 2008-03-05, 3 of 3 patches\n")
    assert f"{LOST} of 2248" in out
    rows = re.findall(
        r"^ +(\d) +(\d) +([\d.]+) +(-[\d.]+) +([\d.]+) m +(-?[\d.]+) m/s +(\d+)$", out, re.M
    )
    assert [row[:2] for row in rows] == [(r, k) for r in "12" for k in "123"]
    found = np.array(rows, float)
    assert (found[:, 4] < 12.0).all()
    assert (np.abs(found[:, 5]) < 8.0).all()
    assert (found[:, 6] >= 8).all()
    totals = np.array(re.findall(r"^[xyz] \(m\) +(.+)$", out, re.M))
    before, _, after, sigma = np.array([row.split() for row in totals], float).T
    assert np.linalg.norm(after) < 0.4 * np.linalg.norm(before)
    assert (after < 4 * sigma).all()


def test_options_reach_the_reader(monkeypatch, capsys):
    def opening(folders, **options):
        raise ValueError(f"{' '.join(folders)} {options}")

    monkeypatch.setattr(real_loop, "open_frames", opening)
    options = "--polarisation HV --records 5 900 --clock-offset -0.002"
    with pytest.raises(SystemExit) as ended:
        command.main(f"--closed-loop --palsar A E --dem B --reference C {options}".split())
    assert ended.value.code == (
        "A E {'polarisation': 'HV', 'records': [5, 900], 'clock_offset': -0.002}"
    )


def test_the_unit_of_the_reference_reaches_its_reader(monkeypatch, capsys):
    monkeypatch.setattr(real_loop, "open_frames", lambda folders, **options: None)

    def cutting(product, elevation, reference, **options):
        raise ValueError(f"{elevation} {reference} {options['unit']} {options['geoid']}")

    monkeypatch.setattr(real_loop, "cut_patches", cutting)
    for more, said in (("--reference-unit linear --geoid 7", "linear 7.0"), ("", "None 0.0")):
        with pytest.raises(SystemExit) as ended:
            command.main(f"--closed-loop --palsar A --dem B --reference C {more}".split())
        assert ended.value.code == f"B C {said}"


def test_the_closed_loop_is_a_command_of_its_own(monkeypatch):
    asked = []
    monkeypatch.setattr(command, "closed_table", lambda *a, **o: asked.append(a) or "")
    command.main(["--closed-loop", "--case", "TC-2", "--seed", "3"])
    assert asked == [("TC-2", 100, 3)]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--palsar A", "--palsar must come with --closed-loop, --dem, --reference"),
        ("--palsar A --dem B --reference C", "--palsar must come with --closed-loop"),
        ("--palsar A --closed-loop --dem B", "--palsar must come with --reference"),
        ("--dem B", "--dem must come with --palsar"),
        ("--closed-loop --clock-offset 0", "--clock-offset must come with --palsar"),
        (
            "--palsar A --closed-loop --dem B --reference C --runs 0",
            "--runs must be at least 1 and --seed at least 0; found 0, 0",
        ),
        ("--closed-loop --runs 1", "--runs must be at least 2"),
    ],
)
def test_arguments_that_do_not_fit(arguments, message, capsys):
    with pytest.raises(SystemExit) as ended:
        command.main(arguments.split())
    assert ended.value.code == 2
    assert message in capsys.readouterr().err


def test_files_that_are_not_there_end_the_command(tmp_path):
    command = [sys.executable, "-m", "navfilters.papers.pogorelsky2020", "--closed-loop"]
    files = ["--palsar", str(tmp_path / "none"), "--dem", "B", "--reference", "C"]
    done = subprocess.run([*command, *files], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert str(tmp_path / "none") in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_a_product_without_its_elevation_model_ends_the_command(folder, monkeypatch):
    monkeypatch.setattr(command, "report", partial(pogorelsky2020.report, imaging=SMALL))
    with pytest.raises(SystemExit) as ended:
        command.main(
            f"--closed-loop --palsar {folder} --dem {folder}/none.tif --reference C".split()
        )
    assert "none.tif: No such file" in ended.value.code


def test_the_table_stands_beside_the_papers(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm", None)  # as where it is not installed
    command.main(["--case", "TC-2", "--runs", "2"])
    out, err = capsys.readouterr()
    assert out.startswith("TC-2, 2 runs, 1-sigma position at 600 s\n")
    assert "138 m, 86.2 %" in out
    assert "NEES" in out
    assert "\r1/72" in err


def test_the_module_runs_as_a_command():
    command = [sys.executable, "-m", "navfilters.papers.pogorelsky2020", "--runs", "1"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "--runs must be at least 2 and --seed at least 0; found 1, 0" in done.stderr


def test_table_of_the_command(monkeypatch, capsys):
    monkeypatch.setattr(
        command, "closed_table", lambda case, runs, seed, progress: f"{case} {runs} {seed}"
    )
    command.main(["--closed-loop", "--case", "TC-2", "--runs", "7"])
    assert capsys.readouterr().out == "TC-2, 7 runs, 1-sigma position at 25 s\nTC-2 7 0\n"
    with pytest.raises(SystemExit):
        command.main(["--closed-loop", "--runs", "1"])
    capsys.readouterr()


def test_the_flight_without_the_antenna_is_a_table_too(monkeypatch, capsys):
    asked = []

    def table(case, runs, seed, progress):
        asked.append((case, runs, seed))
        return "a table"

    monkeypatch.setattr(command, "antenna_table", table)
    command.main(["--without-antenna", "--case", "TC-2", "--runs", "3", "--seed", "4"])
    assert asked == [("TC-2", 3, 4)]
    assert capsys.readouterr().out.endswith("a table\n")
    with pytest.raises(SystemExit):
        command.main(["--without-antenna", "--closed-loop"])
    assert "--without-antenna is open-loop" in capsys.readouterr().err


def test_own_images_are_flown_and_stored(monkeypatch, tmp_path, capsys):
    found = pogorelsky2020.read_own()
    monkeypatch.setattr(command, "own_tables", lambda runs: found)
    command.main(["--own-images", "--runs", "2", "--out", str(tmp_path / "own.npz")])
    assert capsys.readouterr().out.count("TC-2, entropy") == 3
    again = pogorelsky2020.read_own(tmp_path / "own.npz")
    assert np.array_equal(again.errors, found.errors)
    with pytest.raises(SystemExit):
        command.main(["--out", "own.npz"])
    assert "--out must come with --own-images" in capsys.readouterr().err
    with pytest.raises(SystemExit):  # before hours of computing, and not after
        command.main(["--own-images", "--out", str(tmp_path / "none" / "own.npz")])
    assert "--out must be in a folder that exists" in capsys.readouterr().err
