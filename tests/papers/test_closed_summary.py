"""The table of the closed loop beside the open one, of errors whose statistics are known."""

from types import SimpleNamespace

import numpy as np

from navfilters.papers.pogorelsky2020.campaign import Agreement, Campaign, campaign_report
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


def test_a_campaigns_report():
    """A parabola of sharpness about 1.5 m/s above the truth: 10 - 0.02 x^2, so that 15 m/s below
    and above it are 54 and 36 per cent less.
    """
    speed = 7000.0 + np.arange(-20.0, 21.0)
    image = SimpleNamespace(
        speed=speed,
        sharpness=10 - 0.02 * (speed - 7001.5) ** 2,
        true_speed=7000.0,
        truth=np.zeros(3),
        r_f=np.array([[3.0, 4.0, 0.0], [1.0, 0.0, 0.0]]),
        inliers=np.array([40, 25]),
    )
    cases = {"TC-2": runs(30.0, 400.0, 2)}, {"TC-2": runs(60.0, 3600.0, 0)}
    table = summary(cases[0]["TC-2"], cases[1]["TC-2"])
    lines = campaign_report(Campaign([image], *cases, Agreement(6, 1, 0.25, 3.5, 0.125)))
    assert lines.splitlines() == [
        "image 1: sharpest at +1.50 m/s, 15 m/s off 54 and 36 % less; centre within 5.0 m, by 25 "
        "inliers",
        "TC-2, 10 runs, 1-sigma position at 25 s",
        *table.splitlines(),
        "formed directly: 6 images, 1 with another end; velocity within 0.25 m/s, pixel within 3.5 "
        "m, state within 0.12 deviations",
    ]
    without = campaign_report(Campaign([image], *cases, None)).splitlines()
    assert without == lines.splitlines()[:-1]
