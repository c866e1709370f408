"""The table of cures in its page: every pair is the stored table's, by mouse and key."""

import math

import pytest
from shown import at_work, settled, told

from navfilters.problems import CURES, histories, problems, read, reasons, rows, stored

CHAPTER = "book/beyond/every-cure"
STORED = read()
SHOWN = """pairs => {
    const { figure, dataset } = document.querySelector('[data-figure=cures] .stage');
    return pairs.map(([row, patient, value]) => {
        figure.set({ row, patient, value });
        figure.draw();
        return [dataset.ratio, dataset.honesty, dataset.honest, dataset.settled, dataset.error,
            dataset.claim];
    });
}"""
ROW = "document.querySelector('[data-figure=cures] .stage').figure.state.row"


@pytest.fixture(scope="module")
def page(browser):
    with browser.visit(CHAPTER) as visit:
        at_work(visit.page, "cures")
        yield visit.page
        assert not visit.errors


def same(text, number):
    """Whether the page has a number to four digits, and none where there is none."""
    if not math.isfinite(number):
        return text == "NaN"
    return float(text) == pytest.approx(number, rel=6e-4)


def test_every_pair_of_every_row_is_the_tables(page):
    pairs = [(row.label, cell) for row in rows(STORED) for cell in row.cells]
    shown = page.evaluate(SHOWN, [[label, cell.problem, ""] for label, cell in pairs])
    for (_, cell), (ratio, honesty, honest, settled_, *_) in zip(pairs, shown, strict=True):
        if cell.reason:
            assert (ratio, honest, settled_) == ("NaN", "", "")
        else:
            assert settled_ == str(cell.settled).lower()
            assert same(ratio, cell.ratio)
            assert same(honesty, cell.honesty)
            assert int(honest) == cell.honest


def test_every_value_that_was_tried_can_be_chosen(page):
    tried = [cell for cell in STORED if cell.value is not None]
    labels = {row.label for row in rows(STORED)}

    def asked(cell):
        label = cell.cure if cell.cure in labels else f"{cell.cure} *"
        whole = float(cell.value).is_integer()  # as scripts write it
        return [label, cell.problem, str(int(cell.value) if whole else cell.value)]

    shown = page.evaluate(SHOWN, [asked(cell) for cell in tried])
    for cell, (ratio, honesty, *_) in zip(tried, shown, strict=True):
        assert same(ratio, cell.ratio)
        assert same(honesty, cell.honesty)
    options = page.locator("[data-figure=cures] select").nth(2).locator("option")
    assert options.count() == len({c.value for c in tried if c.cure == tried[-1].cure})


def test_a_course_is_what_the_library_computes(page):
    patient = problems()["three images"]
    for cure in CURES[:3]:
        fresh = histories.histories(patient, cure)[0]
        ((*_, error, claim),) = page.evaluate(SHOWN, [[cure.name, patient.name, ""]])
        assert math.log10(float(error)) == pytest.approx(fresh.error[-1], abs=0.02)
        assert math.log10(float(claim)) == pytest.approx(fresh.claim[-1], abs=0.02)


def test_a_dash_says_why(page):
    why = next(iter(reasons(STORED)["AEKF"]))
    page.evaluate(SHOWN, [["AEKF", "pendulum", ""]])
    assert why in page.locator("[data-figure=cures] .says").inner_text()


def test_what_rounding_decides_is_lost_without_numbers(page):
    for row in rows(STORED):
        for cell in row.cells:
            if not cell.settled:
                page.evaluate(SHOWN, [[row.label, cell.problem, ""]])
                says = page.locator("[data-figure=cures] .says").inner_text()
                assert "decided by rounding" in says
                shown = page.locator("[data-figure=cures] td[aria-selected]")
                assert shown.inner_text() == "lost"
                return
    pytest.fail("no pair of the table is decided by rounding")


def test_a_pointer_looks_and_a_click_chooses(page):
    page.evaluate(SHOWN, [["EKF", "pendulum", ""]])
    chosen = told(page, "cures", "ratio")
    cell = page.locator("#cure-b-ekf-2 td").nth(1)
    cell.hover()
    settled(page)
    looked = told(page, "cures", "ratio")
    assert looked != chosen
    page.locator("[data-figure=cures] select").first.hover()
    settled(page)
    assert told(page, "cures", "ratio") == chosen
    cell.click()
    page.locator("[data-figure=cures] select").first.hover()
    settled(page)
    assert told(page, "cures", "ratio") == looked


def test_arrows_walk_and_the_address_remembers(browser):
    with browser.visit(CHAPTER, width=390) as visit:
        page = visit.page
        at_work(page, "cures")
        page.locator("[data-figure=cures] td[tabindex='0']").focus()
        for key in ("ArrowDown", "ArrowRight", "ArrowRight"):
            page.keyboard.press(key)
        page.wait_for_function("location.hash.includes('patient=')")
        assert page.evaluate(ROW) == "B-EKF 1"
        there = told(page, "cures", "ratio")
        page.reload()
        at_work(page, "cures")
        assert page.evaluate(ROW) == "B-EKF 1"
        assert told(page, "cures", "ratio") == there
        assert not visit.errors


@pytest.mark.parametrize(("target", "row"), [("cure-vb", "VB"), ("cure-timed-q-best", "timed Q *")])
def test_a_link_to_a_row_opens_it(browser, target, row):
    with browser.visit(CHAPTER) as visit:
        page = visit.page
        page.goto(f"{page.url}#{target}")
        page.reload()
        at_work(page, "cures")
        assert page.evaluate(ROW) == row
        page.wait_for_function(f"""() => {{
            const box = document.getElementById('{target}').getBoundingClientRect();
            return box.top > 0 && box.bottom < innerHeight;
        }}""")


def test_it_takes_the_place_of_its_pictures(page):
    names = ("fig-every-cure", "fig-every-cure-later")
    assert all(page.locator(f"#{name}").is_hidden() for name in names)
    page.emulate_media(media="print")
    assert all(page.locator(f"#{name}").is_visible() for name in names)
    page.emulate_media(media="screen")


def test_a_link_to_its_picture_leads_to_it(browser):
    with browser.visit(CHAPTER) as visit:
        page, address = visit.page, visit.page.url
        page.goto("about:blank")
        page.goto(f"{address}#fig-every-cure")
        at_work(page, "cures")
        page.wait_for_function("""() => {
            const box = document.querySelector('[data-figure=cures]').getBoundingClientRect();
            return box.top > -100 && box.top < innerHeight;
        }""")


def test_without_scripts_the_table_is_all_there(document):
    (table,) = document(CHAPTER).xpath("//table[contains(@class, 'cures')]")
    lines = {tr.get("id"): tr.findall("td") for tr in table.findall("tbody/tr")}
    assert len(lines) == len(rows(STORED))
    assert {len(cells) for cells in lines.values()} == {len(problems(full=True))}
    assert lines["cure-ukf"][2].text_content().strip().endswith("●")


def test_the_whole_table_can_be_downloaded(document, html):
    links = document(CHAPTER).xpath("//a[contains(@class, 'download')]/@href")
    (link,) = [link for link in links if link.endswith(stored.FILE)]
    table = (html / f"{CHAPTER}.html").parent / link
    assert [c.ratio for c in read(table)][:5] == [c.ratio for c in STORED][:5]
