"""The figures that compute in the page: equal to the ledger and the library, by mouse and key."""

import numpy as np
import pytest
from browser import ROOT
from numpy.testing import assert_allclose
from shown import settled, told

from navfilters import SigmaPoints, run
from navfilters.book import claims
from navfilters.models import RangeBearing
from navfilters.papers.perea2007 import FILTERS, Setup, divergence_maps, position_error

DIVERGENCE = "book/range-bearing/ekf-divergence"
SETUP = Setup()
KERNEL = """([name, R, wrap, points, steps]) => {
    const { kernel } = navfilters, z = kernel.h([100, 100]);
    let state = { mean: [20, 80], cov: [1e4, 0, 0, 1e4] };
    const errors = [];
    for (let k = 0; k < steps; k++) {
        state = kernel.update(name, state, z, { R, wrap }, points ?? kernel.POINTS);
        errors.push(kernel.distance(state.mean, [100, 100]));
    }
    return errors;
}"""
NAMELESS = """[...document.querySelectorAll('.stage :is(input, select, button, [tabindex])')]
    .map(e => e.labels?.[0]?.textContent || e.textContent || e.getAttribute('aria-label'))
    .filter(name => !name.trim()).length"""


@pytest.fixture(scope="module")
def page(browser):
    """The chapter with two figures, at work."""
    with browser.visit(DIVERGENCE) as visit:
        visit.page.wait_for_selector("[data-figure=start] .stage[data-ready]")
        visit.page.wait_for_selector("[data-figure=two-updates] .stage[data-ready]")
        yield visit.page


@pytest.mark.parametrize("name", FILTERS)
def test_the_kernel_is_the_library(page, name):
    ours = position_error(
        run(FILTERS[name], SETUP.prior, SETUP.z, SETUP.model, 12).mean, (100, 100)
    )
    R = [SETUP.range_variance, 0, 0, SETUP.bearing_variance]
    theirs = page.evaluate(KERNEL, [name, R, False, None, 12])
    assert_allclose(theirs, ours[1:], rtol=1e-6)


@pytest.mark.parametrize("root", ["cholesky", "symmetric"])
@pytest.mark.parametrize(("alpha", "beta", "kappa"), [(1.0, 2.0, 1.0), (0.5, 0.0, 3.0)])
@pytest.mark.parametrize("wrap", [False, True])
def test_any_sigma_points(page, root, alpha, beta, kappa, wrap):
    points = SigmaPoints(alpha, beta, kappa, root)
    model = RangeBearing(np.diag([1.0, 6e-3]), wrap=wrap)
    states = run(FILTERS["UKF"].having(points=points), SETUP.prior, SETUP.z, model, 8).mean
    given = {"alpha": alpha, "beta": beta, "kappa": kappa, "root": root}
    theirs = page.evaluate(KERNEL, ["UKF", [1.0, 0, 0, 6e-3], wrap, given, 8])
    assert_allclose(theirs, position_error(states, SETUP.x_true)[1:], rtol=1e-9)


def test_it_shows_what_the_ledger_records(page):
    ledger = claims.load(ROOT / "book" / "claims.toml")
    factor = told(page, "start", "error") / told(page, "start", "claimed")
    assert factor == pytest.approx(ledger["perea-ekf-error-against-claim"].ours, rel=0.01)
    larger = told(page, "two-updates", "two") / told(page, "two-updates", "one")
    assert larger == pytest.approx(ledger["perea-ekf-second-larger"].ours, rel=0.01)


def test_a_repair_of_the_ellipse_repairs_the_second_update(page):
    choice = page.locator("[data-figure=two-updates] select")
    worst = told(page, "two-updates", "two")
    for repair in ("turned to the new tangent", "rounded", "decorrelated"):
        choice.select_option(repair)
        settled(page)
        assert told(page, "two-updates", "two") < told(page, "two-updates", "one") < worst
    choice.select_option("as it is")


def test_keys_move_the_start_and_the_address_remembers(browser):
    with browser.visit(DIVERGENCE) as visit:
        page = visit.page
        knob = page.locator("[data-figure=start] .handle")
        knob.wait_for()
        before = told(page, "start", "error")
        knob.focus()
        for _ in range(5):
            page.keyboard.press("ArrowRight")
        page.wait_for_function("location.hash.includes('x0=30')")
        after = told(page, "start", "error")
        assert after != before
        page.reload()
        page.wait_for_selector("[data-figure=start] .stage[data-ready]")
        assert told(page, "start", "error") == after
        assert not visit.errors


def test_a_pointer_drags_the_start(browser):
    with browser.visit(DIVERGENCE) as visit:
        page = visit.page
        knob = page.locator("[data-figure=start] .handle")
        knob.wait_for()
        knob.scroll_into_view_if_needed()
        box = knob.bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 80, y, steps=4)
        page.mouse.up()
        page.wait_for_function(
            "document.querySelector('[data-figure=start] .stage').figure.state.x0[0] > 40"
        )


@pytest.mark.alone
def test_playing_runs_all_updates_at_thirty_frames_a_second(browser):
    with browser.visit(DIVERGENCE) as visit:
        page = visit.page
        page.locator("[data-figure=start]").get_by_text("Play", exact=True).click()
        frames = page.evaluate("""() => new Promise(done => {
            let frames = 0;
            const begin = performance.now();
            const tick = now => now - begin > 1500 ? done(frames / 1.5)
                : (frames++, requestAnimationFrame(tick));
            requestAnimationFrame(tick);
        })""")
        assert frames >= 30
        page.wait_for_function(
            "document.querySelector('[data-figure=start] .stage').dataset.k == 1000"
        )


def test_the_map_counts_as_the_library_does(browser):
    with browser.visit("book/beyond/divergence-maps") as visit:
        page = visit.page
        page.locator("[data-figure=map]").scroll_into_view_if_needed()
        page.wait_for_function(
            "document.querySelector('[data-figure=map] .stage').dataset.rows == 72", timeout=60_000
        )
        I = divergence_maps.over_starts(FILTERS["UKFz"], 72, steps=100)
        assert told(page, "map", "failing") == pytest.approx(np.mean(~(I <= 0.1)), abs=0.002)
        assert not visit.errors


def test_sigma_points_at_work(browser):
    with browser.visit("book/range-bearing/unscented-filter") as visit:
        page = visit.page
        page.wait_for_selector("[data-figure=sigma-points] .stage[data-ready]")
        errors = position_error(
            run(FILTERS["UKF"], SETUP.prior, SETUP.z, SETUP.model, 200).mean, SETUP.x_true
        )
        assert told(page, "sigma-points", "error") == pytest.approx(errors[1], rel=1e-9)
        page.locator("[data-figure=sigma-points]").get_by_label("angles wrapped").check()
        settled(page)
        assert not visit.errors


@pytest.mark.parametrize(
    "name",
    [
        DIVERGENCE,
        "book/beyond/divergence-maps",
        "book/range-bearing/unscented-filter",
        "book/orbit-manoeuvre/limits",
        "book/beyond/every-cure",
    ],
)
def test_every_control_has_a_name(browser, name):
    with browser.visit(name) as visit:
        visit.page.wait_for_selector(".stage[data-ready]")
        nameless = visit.page.evaluate(NAMELESS)
        assert nameless == 0


@pytest.mark.parametrize("by", ["click", "key"])
def test_a_figure_opens_in_its_own_size(browser, by):
    with browser.visit(DIVERGENCE, width=390) as visit:
        page = visit.page
        image = page.locator(".cell_output img[role=button]").first
        if by == "click":
            image.click()
        else:
            image.focus()
            page.keyboard.press("Enter")
        shown = page.locator("dialog.enlarged img")
        shown.wait_for()
        assert shown.bounding_box()["width"] >= 720 > image.bounding_box()["width"]
        page.keyboard.press("Escape")
        page.wait_for_selector("dialog.enlarged:not([open])", state="attached", timeout=5000)


def test_the_banana_has_the_nees_that_the_chapter_computes(browser):
    """9 + 3 kappa^2, with the rounded numbers that the page is given, and 600 runs about it."""
    ledger = claims.load(ROOT / "book" / "claims.toml")
    kappa2 = ledger["own-sar-nees-bend"].ours
    with browser.visit("book/sar-navigation/consistency") as visit:
        page = visit.page
        page.wait_for_selector("[data-figure=banana] .stage[data-ready]")
        expected = told(page, "banana", "expected")
        assert expected == pytest.approx(9 + 3 * kappa2, rel=0.05)
        assert told(page, "banana", "mean") == pytest.approx(expected, rel=0.25)
        page.locator("[data-figure=banana] input").first.fill("0")
        settled(page)
        assert told(page, "banana", "expected") == 9
        assert told(page, "banana", "mean") == pytest.approx(9, abs=0.7)
        assert not visit.errors
