"""The figure of the bound: the page's matrices give what the library's recursion gives."""

from dataclasses import replace

import pytest
from browser import ROOT
from shown import at_work, settled, told

from navfilters.book import claims
from navfilters.papers.xiong2009 import VARIANTS, cramer_rao_bound, root_mean_square

CHAPTER = "book/orbit-manoeuvre/limits"
MODELS = {"known": "known", "strength": "strength", "vectors": "unknown"}
SET = """state => {
    const { figure } = document.querySelector('[data-figure=bound] .stage');
    figure.set(state);
    figure.draw();
}"""
LEDGER = claims.load(ROOT / "book" / "claims.toml")


@pytest.fixture(scope="module")
def page(browser):
    with browser.visit(CHAPTER) as visit:
        at_work(visit.page, "bound")
        yield visit.page
        assert not visit.errors


def library(model, setup):
    bound = cramer_rao_bound(setup, thrust=MODELS[model], process_noise=False)
    return root_mean_square(bound[18000:])[3]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(("earth", "star"), [(0.02, 5.0), (0.003, 1.0)])
def test_it_is_the_librarys_bound(page, model, earth, star):
    page.evaluate(SET, {"earth": earth, "star": star, "shared": 0})
    setup = replace(VARIANTS["A"], earth_noise=earth, star_noise=star)
    assert told(page, "bound", model) == pytest.approx(library(model, setup), rel=1e-4)


def test_buttons_are_the_two_readings(page):
    page.get_by_role("button", name="For three deviations (D)").click()
    settled(page)
    assert told(page, "bound", "known") == pytest.approx(library("known", VARIANTS["D"]), rel=1e-3)
    page.get_by_role("button", name="As stated (A)").click()
    settled(page)
    assert told(page, "bound", "known") == pytest.approx(library("known", VARIANTS["A"]), rel=1e-3)


def test_the_noise_that_is_needed_is_the_ledgers(page):
    page.evaluate(SET, {"earth": 0.02, "star": 5, "shared": 0})
    found = [told(page, "bound", f"{model}Needs") for model in MODELS]
    assert found == pytest.approx(LEDGER["own-xiong-sensor-needed"].ours, rel=5e-3)
    page.evaluate(SET, {"earth": found[0]})
    assert told(page, "bound", "known") == pytest.approx(203.105, rel=1e-3)


def test_an_error_in_common_is_the_ledgers(page):
    page.evaluate(SET, {"earth": 0.02, "star": 5, "shared": 0.9})
    found = [told(page, "bound", model) for model in MODELS]
    assert found == pytest.approx(LEDGER["own-xiong-common-error"].ours, rel=5e-3)


def test_a_coarse_star_sensor_cannot_be_made_up_for(page):
    page.evaluate(SET, {"earth": 0.02, "star": 20, "shared": 0})
    assert told(page, "bound", "knownNeeds") > 0
    assert told(page, "bound", "vectorsNeeds") != told(page, "bound", "vectorsNeeds")
    assert "no Earth sensor" in page.locator("[data-figure=bound] .says").inner_text()


def test_keys_and_pointer_move_the_noise_and_the_address_remembers(browser):
    with browser.visit(CHAPTER, width=390) as visit:
        page = visit.page
        at_work(page, "bound")
        knob = page.locator("[data-figure=bound] .handle")
        before = told(page, "bound", "known")
        knob.focus()
        page.keyboard.press("ArrowLeft")
        page.wait_for_function("location.hash.includes('earth=')")
        fewer = told(page, "bound", "known")
        assert fewer < 0.9 * before
        page.reload()
        at_work(page, "bound")
        assert told(page, "bound", "known") == fewer
        knob.scroll_into_view_if_needed()
        box = knob.bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x - 60, y, steps=3)
        page.mouse.up()
        settled(page)
        assert told(page, "bound", "known") < 0.7 * fewer
        assert not visit.errors


def test_it_takes_the_place_of_its_picture(page):
    assert page.locator("#fig-xiong-sensor").is_hidden()
    page.emulate_media(media="print")
    assert page.locator("#fig-xiong-sensor").is_visible()
    assert page.locator("[data-figure=bound]").is_hidden()
    page.emulate_media(media="screen")


@pytest.mark.alone
def test_it_is_drawn_at_thirty_frames_a_second(page):
    took = page.evaluate("""() => {
        const { figure } = document.querySelector('[data-figure=bound] .stage');
        const begin = performance.now();
        for (let i = 0; i < 30; i++) { figure.state.earth = 0.01 + 1e-4 * i; figure.draw(); }
        return performance.now() - begin;
    }""")
    assert took < 1000
