"""The flight by other measurements: against the paper's own filter, and against physics."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.estimators import considering
from navfilters.papers.pogorelsky2020 import (
    ARCSECOND,
    CASES,
    Trial,
    antenna_table,
    antenna_tables,
    fly,
    fly_with_offsets,
    monte_carlo,
    simulate_images,
    sweep_speed,
    truth,
    white_errors,
    with_pointing_noise,
)
from navfilters.papers.pogorelsky2020.timed_images import TimedImages
from navfilters.runs import nees
from navfilters.space import difference

SETUP = replace(CASES["TC-2"], steps=2)


def test_with_the_antenna_alone_it_is_the_papers_filter():
    ours = fly(SETUP, [Trial("antenna")], 4, runs=3)
    paper = monte_carlo(SETUP, 4, runs=3)
    assert_allclose(ours.errors[:, 0], paper.errors, rtol=1e-6, atol=1e-9)
    unit = np.sqrt(np.diag(SETUP.P0))
    scale = np.outer(unit, unit)
    assert_allclose(ours.covariances[:, 0] / scale, paper.covariances / scale, atol=1e-12)


def test_a_trial_does_not_depend_on_the_others():
    trials = [Trial("plane"), Trial("both", pointing=5.0, told=False), Trial(late=1e-3)]
    together = fly(SETUP, trials, 3, runs=2)
    for i, trial in enumerate(trials):
        alone = fly(SETUP, [trial], 3, runs=[0, 1])
        assert_allclose(alone.errors[:, 0], together.errors[:, i], rtol=1e-9, atol=1e-12)


def test_the_misalignment_stays_where_no_row_depends_on_it():
    found = fly(SETUP, [Trial("plane")], 5, runs=3)
    walk = SETUP.psd_mu * SETUP.interval * np.arange(6)
    variance = np.deg2rad(SETUP.sigma_mu) ** 2 + walk
    assert_allclose(found.covariances[:, 0, :, 8, 8], np.stack([variance] * 3, axis=1), rtol=1e-9)
    true = simulate_images(SETUP, 3, flight=truth(SETUP, 5))
    for k in range(6):
        moved = difference(true.true_state(k).x, true.true_state(0).x)[:, 6:]
        before = found.errors[0, 0, :, 6:]
        assert_allclose(found.errors[k, 0, :, 6:], before + moved, atol=1e-7)


def test_the_pixel_leaves_the_plane_at_the_speed_of_the_sweep():
    """The azimuth of a fixed point, from the flight itself a little before and after."""
    fine = replace(SETUP, interval=0.1, steps=1)
    flight = truth(fine, 2)
    pixel = simulate_images(replace(fine, walk=False), 1, flight=flight).centre(1)[0]
    d, v = pixel - flight.x[:, :3], flight.x[:, 3:]
    ahead = np.sum(d * v, axis=1) / np.linalg.norm(v, axis=1)
    assert_allclose(sweep_speed(fine, flight)[1], (ahead[0] - ahead[2]) / 0.2, rtol=1e-6)


def test_timed_images_have_the_errors_that_they_are_given():
    flight = truth(SETUP, 5)
    images = simulate_images(SETUP, 4, flight=flight)
    plain = TimedImages(images, np.zeros((4, 5)))(2, None)
    error = np.arange(20.0).reshape(4, 5)
    both = np.array([True, False, True, False])
    other = TimedImages(images, error, 3.0, both, ~both)(2, None)
    assert_allclose(other.slant_range - plain.slant_range, 3.0)
    assert_allclose((plain.azimuth - other.azimuth)[1::2], error[1::2, 1])
    assert np.isnan(other.azimuth[::2]).all()
    assert_array_equal(np.isnan(other.ratios[:, 0]), ~both)


def test_pointing_noise_turns_the_beam_and_no_truth():
    images = simulate_images(SETUP, 200, flight=truth(SETUP, 5))
    turned = with_pointing_noise(images, 20 * white_errors(200, 5, 3, 0))
    apart = turned.centre(3) - images.centre(3)
    wanted = 20 * ARCSECOND * images(3, None).slant_range.mean()
    along = apart @ images.flight.x[3, 3:] / np.linalg.norm(images.flight.x[3, 3:])
    assert_allclose(np.std(along), wanted, rtol=0.2)
    ours = fly(SETUP, [Trial("antenna", pointing=20.0)], 1, runs=2)
    assert_allclose(ours.errors[0], fly(SETUP, [Trial("antenna")], 1, runs=2).errors[0])


def test_an_offset_without_uncertainty_changes_nothing():
    e, P = fly_with_offsets(SETUP, [Trial("both")], {"delay": 0.0, "azimuth": 0.0}, runs=2)
    plain = fly(SETUP, [Trial("both")], runs=2)
    unit = np.sqrt(np.diag(SETUP.P0))
    assert_allclose(e[..., :9] / unit, plain.errors / unit, atol=1e-8)
    assert not P[..., 9:].any()


def test_a_delay_is_paid_for_by_its_state_considered_or_estimated():
    late, sigma = [Trial("antenna", delay=3.0)], {"delay": 3.0}
    told = fly_with_offsets(SETUP, late, sigma, runs=40)
    held = fly_with_offsets(SETUP, late, sigma, runs=40, estimator=considering(SETUP.mekf, [9]))
    untold = fly(SETUP, late, runs=40)
    assert nees(untold.errors[-1], untold.covariances[-1]).mean() > 100
    for e, P in (told, held):
        assert 6 < nees(e[-1, :, :, :9], P[-1, :, :, :9, :9]).mean() < 12
        assert_allclose(np.sqrt(P[-1, ..., 9, 9]), 3.0, rtol=0.01)
    assert_allclose(held[0][..., 9], 3.0)


def test_bad_input():
    with pytest.raises(ValueError, match=r"measured must be one of .*; found 'radar'"):
        Trial("radar")
    with pytest.raises(ValueError, match="trials must be at least one; found none"):
        fly(SETUP, [])
    with pytest.raises(ValueError, match=r"sigma must be of .*; found \['height'\]"):
        fly_with_offsets(SETUP, [Trial()], {"height": 1.0})


def test_rows_of_the_table_are_flown_together():
    trials = [Trial(late=1e-3), Trial("plane")]
    found = fly("TC-2", trials, 2, [3, 5], 1)
    rows = [antenna_tables.Row("a row", trial, 2) for trial in trials]
    errors, covariances = antenna_tables._flown("TC-2", rows, [3, 5], 1)
    assert_array_equal(errors, found.errors[2])
    assert_array_equal(covariances, found.covariances[2])


@pytest.mark.slow
def test_the_table_names_every_trial():
    lines = antenna_table("TC-2", 2).splitlines()
    assert len(lines) == 38 + 1
    assert lines[5].startswith("plane, 72 images")
    assert all(np.isfinite(float(line[34:40])) for line in lines[1:])


def test_a_trial_is_a_clock_of_a_tenth_of_a_millisecond_and_nothing_else():
    """As the chapter says of its flights where it says no more."""
    ideal = Trial("plane", clock=0.1e-3, late=0.0, pointing=0.0, told=True, delay=0.0)
    assert Trial() == ideal
