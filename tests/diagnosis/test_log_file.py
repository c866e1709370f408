"""Logs as files: what is read, and what every fault is called."""

import os
import sys

import numpy as np
import pytest
from logs import kalman_log
from numpy.testing import assert_array_equal

from navfilters.__main__ import main as navfilters
from navfilters.diagnosis import Log, LogError, diagnose, read_log, write_log

HEAD = "time,innovation_1,S_11\n"


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_what_is_written_is_read(tmp_path, ending):
    if ending == "parquet":
        pytest.importorskip("pyarrow")
    log = kalman_log(gaps=0.3)
    again = read_log(write_log(log, tmp_path / f"log.{ending}"))
    for name in ("time", "innovation", "error"):
        assert_array_equal(getattr(again, name), getattr(log, name))
    for name in ("S", "P"):  # one triangle is written
        assert_array_equal(np.triu(getattr(again, name)), np.triu(getattr(log, name)))
    assert again.ignored == ()


def test_either_triangle_long_names_and_other_columns(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(
        "\ufefftime, innovation_1,innovation_2,S_11,S_21,S_2_2,note\n0,1,2,3,0.5,4,hello\n"
    )
    log = read_log(path)
    assert_array_equal(log.S, [[[3.0, 0.5], [0.5, 4.0]]])
    assert log.ignored == ("note",)


def test_both_triangles_may_differ_by_rounding_and_have_empty_cells(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(
        "time,innovation_1,innovation_2,S_11,S_12,S_21,S_22\n"
        "0,1,2,3,0.5,0.50001,4\n1,1,2,3,,0.5,4\n2,1,2,3,0.5,,4\n3,1,2,-3,0.5,9,4\n"
    )
    S = read_log(path).S
    assert_array_equal(S[0], [[3.0, 0.5], [0.50001, 4.0]])
    assert_array_equal(S[1:3], [[[3.0, 0.5], [0.5, 4.0]]] * 2)


FAULTS = {
    "empty": ("", "line of column names"),
    "no time": ("innovation_1,S_11\n1,1\n", "column time is needed; found innovation_1, S_11"),
    "no innovation": ("time,S_11\n1,1\n", "column innovation_1 is needed"),
    "a channel is missing": ("time,innovation_2,S_11,S_12,S_22\n", "innovation_1 is needed"),
    "no variance": ("time,innovation_1\n1,1\n", "column S_11 is needed"),
    "no covariance": ("time,innovation_1,innovation_2,S_11,S_22\n", "S_12 is needed; write 0"),
    "no P": (HEAD.replace("\n", ",error_1\n"), "column P_11 is needed"),
    "twice": ("time,time\n", "found time twice"),
    "a word": (HEAD + "1,abc,1\n", "line 2: innovation_1 must be a number; found 'abc'"),
    "a cell too few": (HEAD + "1,2,3\n1,2\n", "line 3: 3 cells are needed; found 2"),
    "no row": (HEAD, "time must hold at least one update"),
    "time goes back": (HEAD + "2,1,1\n1,1,1\n", "must not decrease; found 1 after 2"),
    "no time in a row": (HEAD + ",1,1\n", "time must be finite"),
    "an infinite innovation": (HEAD + "1,1,1\n2,-inf,1\n", r"found innovation_1 = -inf at time 2"),
    "two triangles": (
        "time,innovation_1,innovation_2,S_11,S_12,S_21,S_22\n1,1,1,1,0.5,0.4,1\n",
        r"S must be symmetric; found S_12 = 0.5 and S_21 = 0.4 at time 1",
    ),
    "two triangles of P": (
        HEAD.strip() + ",error_1,error_2,P_11,P_12,P_21,P_22\n1,1,1,0,0,1,0.5,-0.5,1\n",
        r"P must be symmetric; found P_12 = 0.5 and P_21 = -0.5 at time 1",
    ),
    "measured without S": (HEAD + "1,1,\n", "S must be finite where there is an innovation"),
}


@pytest.mark.parametrize(("content", "message"), FAULTS.values(), ids=FAULTS)
def test_what_is_wrong_with_a_file_is_said(tmp_path, content, message):
    path = tmp_path / "log.csv"
    path.write_text(content)
    with pytest.raises(LogError, match=message) as error:
        read_log(path)
    assert str(path) in str(error.value)


def test_a_cell_that_does_not_end(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text('time,innovation_1,S_11\n0,"' + 150_000 * "1")
    with pytest.raises(LogError, match=r"log\.csv: a CSV file .*field larger than field limit"):
        read_log(path)


@pytest.mark.parametrize("number", ["99999999", 5000 * "9"])
def test_a_channel_of_a_huge_number_takes_no_memory(tmp_path, number):
    path = tmp_path / "log.csv"
    path.write_text(f"time,innovation_1,innovation_{number},S_11\n0,1,1,1\n")
    with pytest.raises(LogError, match=r"log\.csv: column innovation_2 is needed"):
        read_log(path)


def test_parquet_with_other_columns_and_gaps(tmp_path):
    """Whole numbers, text and absent cells, as other programs write them."""
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    table = {"time": [0, 1, 2], "innovation_1": [1.0, None, -1.0], "S_11": [2, 2, 2]}
    path = tmp_path / "log.parquet"
    parquet.write_table(pyarrow.table(table | {"note": ["a", "b", None]}), path)
    log = read_log(path)
    assert_array_equal(log.innovation[:, 0], [1.0, np.nan, -1.0])
    assert log.ignored == ("note",)


def test_a_parquet_column_of_no_text_is_refused(tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    table = {"time": [0.0], "innovation_1": [1.0], "S_11": [2], "remark": [1.0]}
    path = tmp_path / "log.parquet"
    parquet.write_table(pyarrow.table(table), path, store_schema=False)
    path.write_bytes(path.read_bytes().replace(b"remark", b"re\xedark"))
    with pytest.raises(LogError, match=r"log\.parquet: a Parquet file is needed; found: .*utf-8"):
        read_log(path)


@pytest.mark.parametrize("column", ["note", "S_12"])
def test_text_in_parquet_that_is_no_text(tmp_path, column):
    """What a log does not use is not looked at; what it uses is refused."""
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    table = {"time": [0.0], "innovation_1": [1.0], "S_11": [2], column: ["remark"]}
    path = tmp_path / "log.parquet"
    parquet.write_table(pyarrow.table(table), path, compression="none", write_statistics=False)
    path.write_bytes(path.read_bytes().replace(b"remark", b"re\xedark"))
    if column == "note":
        assert read_log(path).ignored == ("note",)
    else:
        with pytest.raises(LogError, match=r"log\.parquet: a Parquet file .*Invalid UTF8"):
            read_log(path)


def test_a_parquet_column_of_dates_is_refused(tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    table = {"time": ["2010-11-02"], "innovation_1": [1.0], "S_11": [2]}
    parquet.write_table(pyarrow.table(table), tmp_path / "log.parquet")
    with pytest.raises(LogError, match="time must be numbers; found string"):
        read_log(tmp_path / "log.parquet")


def test_a_parquet_column_that_numpy_cannot_hold_is_refused(tmp_path):
    """Times of day in nanoseconds, which Arrow gives as Python's, of microseconds."""
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    times = pyarrow.array([1], pyarrow.time64("ns"))
    table = {"time": times, "innovation_1": [1.0], "S_11": [2]}
    parquet.write_table(pyarrow.table(table), tmp_path / "log.parquet")
    with pytest.raises(LogError, match=r"log\.parquet: .*nanoseconds"):
        read_log(tmp_path / "log.parquet")


def test_parquet_without_pyarrow_says_so(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    monkeypatch.delitem(sys.modules, "pyarrow.parquet", raising=False)
    with pytest.raises(ImportError, match="a log in Parquet needs pyarrow: pip install pyarrow"):
        read_log(tmp_path / "log.parquet")


def test_more_than_nine_channels(tmp_path):
    S = np.broadcast_to(np.eye(11), (2, 11, 11))
    log = Log(np.arange(2.0), np.ones((2, 11)), S)
    assert_array_equal(read_log(write_log(log, tmp_path / "log.csv")).S, S)


def test_what_is_no_text(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(LogError, match="UTF-8"):
        read_log(path)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ((np.ones(3), np.ones((3, 2)), np.ones((3, 2))), "S must have 3 axes"),
        ((np.ones(3), np.ones((2, 1)), np.ones((2, 1, 1))), r"shapes \(k,\)"),
        ((np.ones(3), np.ones((3, 1)), np.ones((3, 1, 1)), np.ones((3, 1))), "belong together"),
    ],
)
def test_arrays_that_do_not_fit(fields, message):
    with pytest.raises(LogError, match=message):
        Log(*fields)


def test_the_command_and_its_exit_status(tmp_path, capsys):
    good = write_log(kalman_log(), tmp_path / "good.csv")
    bad = write_log(kalman_log(told_r=0.1), tmp_path / "bad.csv")
    assert navfilters(["diagnose", str(good)]) == 0
    assert "nothing wrong at 95%" in capsys.readouterr().out
    numbers, picture = tmp_path / "found.json", tmp_path / "found.png"
    status = navfilters(
        ["diagnose", str(bad), "--json", str(numbers), "--plot", str(picture), "--angle", "2:360"]
    )
    assert status == 1
    assert "WRONG: the filter is too sure" in capsys.readouterr().out
    assert diagnose(read_log(bad)).findings[0] in numbers.read_text()
    assert picture.stat().st_size > 1000


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
def test_on_a_full_disk_a_log_and_its_numbers_stay_as_they_were(tmp_path, capsys):
    log = write_log(kalman_log(steps=30), tmp_path / "log.csv")
    numbers = tmp_path / "found.json"
    navfilters(["diagnose", str(log), "--json", str(numbers)])
    before = log.read_bytes(), numbers.read_bytes()
    for path in (log, numbers):
        path.with_name(f"{path.name}.part").symlink_to("/dev/full")
    with pytest.raises(OSError, match=r"No space left.*log\.csv"):
        write_log(kalman_log(steps=40), log)
    with pytest.raises(SystemExit) as end:
        navfilters(["diagnose", str(log), "--json", str(numbers)])
    assert end.value.code == 2
    assert "No space left" in (told := capsys.readouterr().err)
    assert "found.json" in told
    assert (log.read_bytes(), numbers.read_bytes()) == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["missing.csv"], "No such file"),
        (["--angle", "x", "log.csv"], "2 or 2:360 is meant"),
        (["--angle", "9", "log.csv"], "channels 1 to 2"),
    ],
)
def test_the_command_says_what_is_wrong(tmp_path, capsys, arguments, message):
    write_log(kalman_log(steps=20), tmp_path / "log.csv")
    given = [str(tmp_path / a) if a.endswith(".csv") else a for a in arguments]
    with pytest.raises(SystemExit) as end:
        navfilters(["diagnose", *given])
    assert end.value.code == 2
    assert message in capsys.readouterr().err
