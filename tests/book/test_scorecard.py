"""The scorecard as a reader uses it: filters, search, order, links to keep, exports, no scripts."""

import csv
import json
from urllib.parse import parse_qs, urlsplit

import pytest
from browser import ROOT

from navfilters.book import claims

PAGE = "book/scorecard"
LEDGER = claims.load(ROOT / "book" / "claims.toml")


@pytest.fixture
def page(browser):
    with browser.visit(PAGE) as visit:
        visit.page.wait_for_selector(".claims-browser[data-ready]")
        yield visit.page
        assert not visit.errors


def shown(page):
    """Names of the rows that a reader sees, in order."""
    rows = "[...document.querySelectorAll('.claims-table tr[id]')]"
    return page.evaluate(f"{rows}.filter(r => r.checkVisibility()).map(r => r.id.slice(4))")


def test_the_page_opens_short_and_every_claim_has_its_row(page):
    assert shown(page) == []
    assert page.evaluate("document.documentElement.scrollHeight") < 6000
    counts = page.locator(".claims-work > summary").all_inner_texts()
    assert sum(int(text.split()[0]) for text in counts) == len(LEDGER)
    page.get_by_role("button", name="Show all").click()
    assert sorted(shown(page)) == sorted(LEDGER)


def test_a_source_unfolds_by_its_line(page):
    page.locator(".claims-work > summary").nth(1).press("Enter")
    wanted = [n for n, c in LEDGER.items() if c.source.startswith("lecture16")]
    assert shown(page) == wanted


def test_filters_combine(page):
    page.locator(".claims-controls [name=paper]").select_option("xiong2009")
    page.locator(".claims-controls [name=verdict]").select_option("not reproduced")
    wanted = [
        name
        for name, c in LEDGER.items()
        if c.source.startswith("xiong2009") and c.verdict == "not reproduced"
    ]
    assert sorted(shown(page)) == sorted(wanted)
    assert page.locator("h2:visible").count() < 7  # sources without a row hide their headings
    page.get_by_role("button", name="Show all").click()
    assert len(shown(page)) == len(LEDGER)


def test_search_finds_every_word_anywhere(page):
    page.locator(".claims-controls [name=search]").fill("AREKF Gamma")
    found = shown(page)
    assert 0 < len(found) < len(LEDGER)
    for name in found:
        text = page.evaluate(
            "id => JSON.stringify(JSON.parse(document.getElementById('ledger').textContent)"
            ".find(c => c.id == id)).toLowerCase()",
            name,
        )
        assert "arekf" in text
        assert "gamma" in text


def test_order(page):
    page.locator(".claims-controls [name=paper]").select_option("perea2007")
    page.locator(".claims-controls [name=order]").select_option("by name")
    names = shown(page)
    assert names == sorted(names)
    page.locator(".claims-controls [name=order]").select_option("as in the sources")
    assert shown(page) == [n for n in LEDGER if LEDGER[n].source.startswith("perea2007")]


@pytest.mark.parametrize("name", [next(iter(LEDGER)), list(LEDGER)[-1]])
def test_an_address_names_one_claim(browser, name):
    with browser.visit(PAGE) as visit:
        page = visit.page
        page.goto(page.url + f"#row-{name}")
        page.reload()
        page.wait_for_selector(".claims-browser[data-ready]")
        assert page.locator(f"#row-{name} details").get_attribute("open") is not None
        assert page.locator(f"#row-{name}").is_visible()
        outline = page.evaluate(
            "id => getComputedStyle(document.getElementById(id)).outlineStyle", f"row-{name}"
        )
        assert outline == "solid"


def test_a_badge_leads_to_its_row_and_back(browser):
    with browser.visit("book/range-bearing/ekf-divergence") as visit:
        page = visit.page
        page.locator("#claim-perea-ekf-first-update a").click()
        page.wait_for_selector(".claims-browser[data-ready]")
        page.locator("#row-perea-ekf-first-update td a").first.click()
        page.wait_for_url("**/ekf-divergence.html#claim-perea-ekf-first-update")


@pytest.mark.parametrize("kind", ["csv", "json"])
def test_what_is_shown_is_saved(page, kind):
    page.locator(".claims-controls [name=verdict]").select_option("underdetermined")
    with page.expect_download() as saved:
        page.get_by_role("button", name=f"Save as {kind.upper()}").click()
    text = saved.value.path().read_bytes().decode()
    rows = json.loads(text) if kind == "json" else list(csv.DictReader(text.splitlines()))
    wanted = [name for name, c in LEDGER.items() if c.verdict == "underdetermined"]
    assert [row["id"] for row in rows] == wanted
    assert all(row["reason"] == LEDGER[row["id"]].reason for row in rows)


def test_segments_of_the_front_page_open_what_they_count(browser):
    with browser.visit("book/intro") as visit:
        parts = visit.page.evaluate(
            "[...document.querySelectorAll('.bar-part')].map(a => [a.textContent, a.href])"
        )
    assert sum(int(count) for count, _ in parts) == sum(not c.own for c in LEDGER.values())
    for count, address in parts:
        chosen = {k: v[0] for k, v in parse_qs(urlsplit(address).fragment).items()}
        found = [
            c
            for c in LEDGER.values()
            if c.source.split(",")[0] == chosen["paper"]
            and c.threshold == chosen["limit"]
            and c.verdict == chosen["verdict"]
        ]
        assert len(found) == int(count)
    with browser.visit(PAGE) as visit:
        visit.page.goto(parts[0][1].replace("\n", ""))
        visit.page.reload()
        visit.page.wait_for_selector(".claims-browser[data-ready]")
        assert len(shown(visit.page)) == int(parts[0][0])


def test_without_scripts_the_tables_are_there(document):
    tables = (
        "//details[contains(@class, 'claims-work')][@open]//table[contains(@class, 'claims-table')]"
    )
    assert len(document(PAGE).xpath(f"{tables}//tr[@id]")) == len(LEDGER)
