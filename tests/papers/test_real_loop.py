"""The closed loop on files that are written here: each says the same of one simulated scene."""

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from palsar_scene import (
    RADAR,
    SMALL,
    write_reference,
)

from navfilters.papers import pogorelsky2020
from navfilters.papers.pogorelsky2020 import CASES, NOMINAL, real_loop
from navfilters.papers.pogorelsky2020.real_loop import real_table as table
from navfilters.papers.pogorelsky2020.real_loop import run_filter, true_flight
from navfilters.papers.pogorelsky2020.real_patches import cut_patches
from navfilters.space.navigation_state import NavigationState


@pytest.mark.slow
def test_the_boresight_passes_through_the_patches(product, patches):
    setup = replace(CASES["TC-2"], look=30.0)
    flight = true_flight(product, patches, setup)
    assert_allclose(np.diff(flight.times), setup.interval, rtol=0, atol=1 / RADAR.prf)
    for k, patch in enumerate(patches, start=1):
        beam = replace(setup.geometry, T_e_b=flight.T_e_b[k]).boresight(NOMINAL)
        ray = patch.acquired.r_f - flight.x[k, :3]
        assert_allclose(np.linalg.norm(np.cross(beam, ray)), 0.0, atol=1e-6)
        look, squint = np.rad2deg(patch.pointing)
        assert 34.0 < look < 34.6
        assert abs(squint) < 1e-3  # the orbit is circular


def at_the_truth(patch):
    a = patch.acquired
    return NavigationState(a.r[None], a.v[None], NOMINAL[None])


@pytest.mark.slow
def test_no_line_and_no_sample_is_lost(patches):
    """A line is 6.2 m along the track and a sample 4.7 m of range: the mean misses are smaller."""
    images = pogorelsky2020.RealImages(patches, np.zeros((1, 3)), SMALL)
    misses = []
    for k, patch in enumerate(patches, start=1):
        a = patch.acquired
        error = images(k, at_the_truth(patch)).r_f[0] - a.r_f
        axes = np.stack([a.v / a.speed, (a.r_f - a.r) / patch.slant_range])
        misses.append(axes @ error)
    assert (np.abs(misses) < 8.0).all()
    assert (np.abs(np.mean(misses, axis=0)) < 2.5).all()


@pytest.mark.slow
def test_a_reference_of_another_place_is_reported(folder, product, world, tmp_path):
    """Each patch is shown the surroundings of the next: dead reckoning, but a table."""
    shown = [*world.scenes[1:], world.scenes[0]]
    wrong = write_reference(tmp_path / "wrong.tif", world.scenes, shown)
    patches = cut_patches(product, folder / "dem.tif", wrong, imaging=SMALL)
    outcome = run_filter(product, patches, CASES["TC-2"], 1, imaging=SMALL)
    text = table(product, patches, outcome)
    assert len(re.findall(r"no match: \d inliers", text)) == 3
    assert np.isnan(outcome.result.innovations).all()
    assert np.isfinite(outcome.result.errors).all()
    assert len(re.findall(r"^[xyz] \(m\)", text, re.M)) == 3


BLIND = replace(SMALL, reach=10.0, steps=(16.0,))
"""No room for a single step: no climb can find a peak."""


@pytest.mark.slow
def test_a_climb_without_a_peak_is_reported(product, patches):
    outcome = run_filter(product, patches[:1], CASES["TC-2"], 1, imaging=BLIND)
    text = table(product, patches[:1], outcome)
    assert "no image: the climb ended at a limit" in text
    assert "1 of 3 patches: its lines hold no more, longer strips do\n" in text


@pytest.mark.slow
def test_the_range_has_the_runs_own_noise(product, patches):
    images = pogorelsky2020.RealImages(patches, np.array([[1.5, 0.0, 0.0]]), BLIND)
    state = at_the_truth(patches[0])
    found = replace(images, imaging=SMALL)(1, state)
    assert_allclose(found.slant_range, patches[0].slant_range + 1.5)
    none = images(1, state)
    assert all(np.isnan(value).all() for value in none)


def test_a_report_is_the_table_of_the_runs_on_the_files(monkeypatch):
    """Each part is made of those before it."""
    monkeypatch.setattr(real_loop, "open_frames", lambda folder: f"product of {folder}")
    monkeypatch.setattr(real_loop, "cut_patches", lambda product, *files, **_: [product, *files])
    monkeypatch.setattr(real_loop, "run_filter", lambda *given, **_: given[:2])
    monkeypatch.setattr(real_loop, "real_table", lambda *given: given)
    product, patches = "product of A", ["product of A", "B", "C"]
    assert real_loop.report("A", "B", "C", "TC-2") == (product, patches, (product, patches))
