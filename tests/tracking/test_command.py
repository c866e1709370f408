"""The command that flies every filter."""

import pytest

from navfilters.tracking.__main__ import CURES, main


@pytest.mark.slow
def test_it_prints_a_row_for_each_filter_start_and_leak(capsys):
    main(["--draws", "2", "--steps", "3", "--filters", "EKF", "gate"])
    rows = capsys.readouterr().out.splitlines()
    assert len(rows) == 1 + 2 * 2 * 3
    assert rows[1].split()[:5] == ["EKF", "no", "10", "0", "of"]
    assert "STF" in CURES


def test_no_draws_are_refused(capsys):
    with pytest.raises(SystemExit):
        main(["--draws", "0"])
    assert "--draws and --steps must be at least 1; found 0" in capsys.readouterr().err
