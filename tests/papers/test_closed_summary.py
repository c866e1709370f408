"""The table of the closed loop beside the open one, of errors whose statistics are known."""

from types import SimpleNamespace

import numpy as np

from navfilters.papers.pogorelsky2020.closed_loop import UPDATES, summary


def runs(size, variance, lost):
    """Errors of plus and minus so much in each state: five runs up, five down."""
    errors = np.tile(size * np.array([1.0, -1.0] * 5)[:, None], (UPDATES + 1, 1, 9))
    errors[:UPDATES] = 1e6  # only the last update counts
    covariances = np.tile(variance * np.eye(9), (UPDATES + 1, 10, 1, 1))
    innovations = np.zeros((UPDATES, 10, 4))
    innovations[0, :lost, 1] = np.nan
    return SimpleNamespace(errors=errors, covariances=covariances, innovations=innovations)


def test_predicted_and_sample_deviations_nees_and_failures():
    """NEES of nine states is 9 (size)^2 / variance, the sample's deviation size sqrt(10 / 9)."""
    lines = summary(runs(30.0, 400.0, 2), runs(60.0, 3600.0, 0)).splitlines()
    for axis, line in zip("xyz", lines[2:5], strict=True):
        assert line.split() == [axis, "(m)", "20.0", "31.6", "60.0", "63.2"]
    assert lines[5].split() == ["NEES", "20.2", "9.0"]
    assert lines[6] == f"2 of {10 * UPDATES} images failed"
