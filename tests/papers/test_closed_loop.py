"""The closed loop on small images: the table against direct runs, failures, determinism."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from small_images import SMALL

from navfilters.papers import pogorelsky2020
from navfilters.papers.pogorelsky2020.acquisition import acquire, measure_directly
from navfilters.papers.pogorelsky2020.closed_loop import Images, monte_carlo_closed
from navfilters.papers.pogorelsky2020.experiment import CASES, Setup
from navfilters.papers.pogorelsky2020.image_tables import tabulate
from navfilters.papers.pogorelsky2020.imaging import Imaging
from navfilters.papers.pogorelsky2020.noise_draws import noise
from navfilters.papers.pogorelsky2020.open_loop import monte_carlo
from navfilters.papers.pogorelsky2020.true_flight import truth
from navfilters.sar.images.autofocusing import sharpness
from navfilters.sar.matching.matcher import Matcher
from navfilters.space.image_measurement import Measurement
from navfilters.space.navigation_state import NavigationState

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def closed():
    return monte_carlo_closed("TC-2", 20, imaging=SMALL)


def predicted(k, speeds):
    """States at the truth, but for the velocity's length."""
    x = truth(Setup(), k).x[k]
    v = x[3:] / np.linalg.norm(x[3:]) * np.asarray(speeds)[:, None]
    n = len(v)
    return NavigationState(np.tile(x[:3], (n, 1)), v, np.tile([0.0, 0.0, 0.0, 1.0], (n, 1)))


def test_shapes(closed):
    assert closed.errors.shape == (5, 20, 9)
    assert closed.innovations.shape == (3, 20, 4)
    assert_allclose(closed.times, [0, 25 / 3, 50 / 3, 25, 125 / 3])


def test_most_images_match_and_the_filter_gains(closed):
    assert np.isnan(closed.innovations).any(axis=-1).mean() < 0.2
    first, last = (np.std(closed.errors[i, :, :3]) for i in (0, 3))
    assert last < 0.3 * first


def test_range_has_the_runs_own_noise():
    table, drawn = tabulate("TC-1", 1, SMALL), noise(20, 1, 3).slant_range[:, 0]
    images = Images(Setup(), 20, 3, SMALL)
    found = images(1, predicted(1, np.full(20, table.true_speed)))
    assert_allclose(found.slant_range, table.slant_range + drawn)
    true = np.linalg.norm(table.truth - truth(Setup(), 1).x[1, :3])
    assert_allclose(table.slant_range, true, atol=0.01)


def test_table_agrees_with_a_run_formed_directly():
    acquired, table = acquire(Setup(), 1, SMALL), tabulate("TC-1", 1, SMALL)
    start = table.true_speed + 21.3
    climb, match = measure_directly(acquired, start, SMALL)
    found = Images(Setup(), 1, 0, SMALL)(1, predicted(1, [start]))
    assert_allclose(found.speed, climb.speed)
    assert np.linalg.norm(found.r_f[0] - match.r_f) < 3.0
    assert np.linalg.norm(match.r_f - table.truth) < 6.0


@pytest.mark.parametrize("off", [-41.0, 0.0, 20.0])
def test_climbs_see_the_sharpness_of_the_whole_image(off):
    acquired = acquire(Setup(), 1, SMALL)
    V = acquired.effective(acquired.speed + off)
    images = [f.image(V, acquired.slope) for f in (acquired.climber, acquired.focuser)]
    mine, whole = (sharpness(np.abs(image.pixels) ** 2) for image in images)
    assert_allclose(mine, whole, rtol=1e-5)


def test_a_climb_that_leaves_the_table_is_no_measurement():
    table = tabulate("TC-1", 1, SMALL)
    images = Images(Setup(), 2, 0, SMALL)
    found = images(1, predicted(1, table.true_speed + np.array([0.0, 900.0])))
    assert np.isfinite(found.r_f[0]).all()
    for value in found:
        assert np.isnan(value[1]).all()
    assert images.log[0].ended[1] == "limit"
    assert_array_equal(images.log[0].absent, [False, True])


def test_images_that_never_match_leave_the_prediction():
    """The campaign goes on, as dead reckoning does."""

    def blind(setup, k, imaging):
        table = tabulate(setup, k, imaging)
        return table._replace(r_f=np.full_like(table.r_f, np.nan))

    setup = replace(CASES["TC-1"], walk=False)
    result = monte_carlo(setup, 3, 3, measure=Images(setup, 3, 0, SMALL, tables=blind))
    assert np.isnan(result.innovations).all()
    assert np.isfinite(result.errors).all()

    def nothing(k, state):
        return Measurement(np.full((3, 3), np.nan), np.full(3, np.nan), np.full(3, np.nan))

    none = monte_carlo(setup, 3, 3, measure=nothing)
    assert_array_equal(result.errors, none.errors)


def test_an_image_that_matches_nowhere_still_has_a_table():
    """A rule that no match can satisfy, for one image."""
    strict = replace(SMALL, matcher=Matcher(inliers=1000), lines=128, samples=64, reach=12.0)
    table = tabulate("TC-1", 1, strict)
    assert np.isnan(table.r_f).all()
    assert (table.inliers < 1000).all()
    assert np.isfinite(table.sharpness).all()


def test_a_run_does_not_depend_on_the_others(closed):
    some = monte_carlo_closed("TC-2", [3, 11], imaging=SMALL)
    assert_allclose(some.errors, closed.errors[:, [3, 11]], rtol=1e-9, atol=1e-9)


def test_both_cases_share_their_images():
    assert tabulate("TC-1", 2, SMALL) is tabulate(CASES["TC-2"], 2, SMALL)
    assert tabulate("TC-1", 2, SMALL) is not tabulate("TC-1", 3, SMALL)


def test_predicted_geometry_is_the_nominal_one_at_the_truth():
    table = tabulate("TC-1", 1, SMALL)
    state = predicted(1, [table.true_speed + 5.0])
    nominal, own = (
        Images(Setup(), 1, 0, SMALL, geometry)(1, state).speed
        for geometry in ("nominal", "predicted")
    )
    assert_allclose(own, nominal, atol=1e-9)
    lifted = state._replace(r=state.r * (1 + 1000 / np.linalg.norm(state.r)))
    shift = Images(Setup(), 1, 0, SMALL, "predicted")._offset(1, table, lifted)
    assert 0.0 < abs(shift[0]) < 1.0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: monte_carlo_closed("TC-3"), "case must be a Setup or one of"),
        (lambda: tabulate("TC-1", 0), "k must be an integer of at least 1"),
        (lambda: Images(Setup(), geometry="exact"), "geometry must be 'nominal' or 'predicted'"),
        (lambda: Imaging(near=50.0), "near must be positive and below reach"),
        (lambda: Imaging(seed=-1), "seed must be an integer of at least 0"),
    ],
)
def test_refusals(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_printed_table():
    text = pogorelsky2020.closed_table("TC-2", 5, imaging=SMALL)
    assert "closed loop" in text
    assert text.count("(m)") == 3
    assert "of 15 images failed" in text
