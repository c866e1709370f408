"""The command of the lecture: three filters' errors beside what they claim."""

import pytest

from navfilters.papers.lecture16.__main__ import main as command


def test_the_command_prints_errors_beside_claims(capsys):
    """Near the plan all three are as good as they say; from 2.2 rad the linearised one is not."""
    lines = {}
    for released in ("0.5", "2.2"):
        command(["--runs", "1", "--released", released, "--step", "0.01"])
        out = capsys.readouterr().out
        assert out.startswith(f"Released at {released} rad; over the second half of 20 s,\n")
        rows = [line.split() for line in out.splitlines()[4:]]
        lines[released] = {name: (float(error), float(said)) for name, error, said in rows}
    assert list(lines["0.5"]) == ["CT-LKF", "CT-EKF", "DT-EKF"]
    for error, said in lines["0.5"].values():
        assert 0.3 * said < error < 3 * said
    assert lines["2.2"]["CT-LKF"][0] > 10 * lines["2.2"]["CT-EKF"][0]


@pytest.mark.parametrize(
    ("option", "value", "needs"),
    [
        ("--runs", "0", "--runs must be at least 1; found 0"),
        ("--step", "0", "--step must be above 0 and at most 5 s; found 0"),
        ("--step", "7", "--step must be above 0 and at most 5 s; found 7"),
        ("--step", "nan", "--step must be above 0 and at most 5 s; found nan"),
        ("--released", "4", "--released must be within pi of 0; found 4"),
    ],
)
def test_the_command_refuses_by_name(option, value, needs, capsys):
    with pytest.raises(SystemExit) as stopped:
        command([option, value])
    assert stopped.value.code == 2
    assert needs in capsys.readouterr().err
