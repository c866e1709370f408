"""The divergence maps: their points, I against a run of one point, and the command."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import run
from navfilters.models import RangeBearing
from navfilters.papers.perea2007 import __main__ as command
from navfilters.papers.perea2007 import divergence_maps
from navfilters.papers.perea2007.experiment import FILTERS, Setup, improvement, isotropic


@pytest.mark.parametrize("size", [4, 40, 48, 256])
def test_no_start_lies_on_the_line_of_sight_or_on_the_jump(size):
    points = divergence_maps.starts(size)
    assert points.shape == (size, size, 2)
    assert np.abs(points[..., 0] - points[..., 1]).min() > 100 / size
    assert np.abs(points[..., 1]).min() > 10 / size
    low, high = divergence_maps.WINDOW
    assert low < points.min() < points.max() < high
    assert_allclose(points[0, 1] - points[0, 0], [600 / size, 0])


def test_one_point_of_each_map_is_a_run_from_there():
    setup = Setup()
    h = run(
        FILTERS["UKFz"], isotropic(divergence_maps.starts(4)[2, 1], 100.0), setup.z, setup.model, 30
    )
    I = divergence_maps.over_starts(FILTERS["UKFz"], 4, steps=30)
    assert_allclose(I[2, 1], improvement(h, setup.x_true), rtol=1e-9)

    sigma, ratio = divergence_maps.noises(4)
    R = np.diag([setup.bearing_variance * ratio[2] ** 2, setup.bearing_variance])
    model = RangeBearing(R, wrap=False)
    h = run(FILTERS["EKF"], isotropic(setup.x0, sigma[1]), setup.z, model, 30)
    I = divergence_maps.over_noises(FILTERS["EKF"], 4, steps=30)
    assert_allclose(I[2, 1], improvement(h, setup.x_true), rtol=1e-9)


def test_a_last_bit_is_one_and_changes_the_map_a_little():
    assert_array_equal(divergence_maps.next_bit([1.0, -1.0]), [1 + 2**-52, -1 + 2**-53])
    I = divergence_maps.over_starts(FILTERS["B-EKF 2"], 4, steps=20)
    changed = divergence_maps.over_starts(FILTERS["B-EKF 2"], 4, steps=20, changed=True)
    assert 0 < np.abs(changed / I - 1).max() < 1e-9


def test_maps_of_one_sweep_are_those_of_three():
    mtsof = FILTERS["mtSOF"]  # rounding decides
    found = divergence_maps.over_both(mtsof, 4, 3)
    assert_array_equal(found.starts, divergence_maps.over_starts(mtsof, 4))
    assert_array_equal(found.changed, divergence_maps.over_starts(mtsof, 4, changed=True))
    assert_array_equal(found.noises, divergence_maps.over_noises(mtsof, 3))


def test_a_change_is_relative_and_has_a_floor():
    found = divergence_maps.relative_change([1.0, 2.0, 1.0, np.nan], [1.0, 3.0, np.nan, 1.0])
    assert_array_equal(found, [2**-52, 0.5, np.nan, np.nan])


@pytest.mark.slow
def test_the_command_stores_every_map(tmp_path, capsys):
    out = tmp_path / "new" / "m"
    command.main(["--size", "3", "--steps", "2", "--out", str(out)])
    with np.load(f"{out}.npz") as stored:
        assert len(stored.files) == 4 * len(FILTERS)
        for key, expected in (
            ("starts mtSOF", divergence_maps.over_starts(FILTERS["mtSOF"], 3, steps=2)),
            (
                "noises changed UKF",
                divergence_maps.over_noises(FILTERS["UKF"], 3, changed=True, steps=2),
            ),
        ):
            assert_array_equal(stored[key], expected)
    assert sorted(p.suffix for p in out.parent.iterdir()) == [".npz"] + [".png"] * 4
    assert "UKFz: " in capsys.readouterr().out


@pytest.mark.parametrize("wrong", [["--size", "1"], ["--steps", "0"]])
def test_the_command_refuses_what_makes_no_map(wrong, capsys):
    with pytest.raises(SystemExit):
        command.main(wrong)
    assert "must be at least" in capsys.readouterr().err
