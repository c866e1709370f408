"""The search finds pages before names of the library."""

import pytest

FINISHED = "document.querySelector('.search-summary')?.innerText.includes('finished')"


@pytest.mark.parametrize(
    ("words", "title"),
    [
        ("NEES", "Notation and glossary"),
        ("notation", "Notation and glossary"),
        ("sigma points", "Notation and glossary"),
        ("scorecard", "The scorecard"),
        ("unscented filter", "An unscented filter"),
    ],
)
def test_the_page_that_a_reader_means_comes_first(browser, words, title):
    with browser.visit("search") as visit:
        visit.page.goto(f"{browser.address}/search.html?q={words.replace(' ', '+')}")
        visit.page.wait_for_selector("#search-results li a")
        visit.page.wait_for_function(FINISHED)
        found = visit.page.locator("#search-results li > a").all_inner_texts()
    assert title in found[0]


def test_names_of_the_library_are_found_after_pages(browser):
    with browser.visit("search") as visit:
        visit.page.goto(f"{browser.address}/search.html?q=nees")
        visit.page.wait_for_selector("#search-results li a")
        visit.page.wait_for_function(FINISHED)
        links = visit.page.evaluate(
            "[...document.querySelectorAll('#search-results li > a')].map(a => a.pathname)"
        )
    api = [("/api" in link) for link in links]
    assert any(api)
    assert not any(api[: api.index(True)])
    assert all(api[api.index(True) :])
