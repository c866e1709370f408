"""What a page loads: little, and MathJax where there is a formula."""

from browser import toc

LIMIT = 1.5 * 2**20
LOADED = """() => ['navigation', 'resource'].flatMap(kind => performance.getEntriesByType(kind))
    .map(entry => [new URL(entry.name).pathname, entry.decodedBodySize])"""


def test_a_page_is_light_and_has_mathjax_where_it_has_formulas(wide):
    wide.page.evaluate("() => window.scrollTo(0, document.body.scrollHeight)")
    wide.page.wait_for_load_state("networkidle")
    loaded = wide.page.evaluate(LOADED)
    formulas = wide.page.locator(".math").count()
    own = {path: size for path, size in loaded if "/mathjax/" not in path}
    assert sum(own.values()) < LIMIT, sorted(own.items(), key=lambda item: -item[1])[:5]
    assert any("/mathjax/" in path for path, _ in loaded) == (formulas > 0)
    assert not [path for path in own if path.endswith("searchindex.js")]


def test_icons_are_drawn_and_few(browser, html):
    with browser.visit(toc()[1]) as visit:
        assert visit.page.locator("i[class*='fa-']").count() == 0
        sizes = visit.page.evaluate(
            "[...document.querySelectorAll('.article-header-buttons svg')]"
            ".filter(s => s.checkVisibility()).map(s => s.getBoundingClientRect().width)"
        )
    assert sizes
    assert all(size > 8 for size in sizes)
    assert (html / "_static" / "scripts" / "fontawesome.js").stat().st_size < 32 * 1024
