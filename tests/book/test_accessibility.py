"""Every page by axe-core's rules: what keeps a reader out fails; in the dark, its colours."""

from itertools import pairwise

import pytest
from axe_playwright_python.sync_playwright import Axe
from browser import toc

RULES = {
    "light": {"runOnly": ["wcag2a", "wcag2aa", "best-practice"]},
    "dark": {"runOnly": ["color-contrast"]},
}
HOW = {"resultTypes": ["violations"], "preload": False}  # loads no style sheet a second time
FORMULAS = {"exclude": [["mjx-container"]]}  # MathJax's own, thousands of marks a page
# Of the thousand words of listings, each colour on each ground is looked at once: others lose it.
THIN = """() => {
    const seen = new Set();
    const grounds = new Map();
    const ground = e => {
        if (!e) return '';
        if (!grounds.has(e)) {
            const { backgroundColor, opacity } = getComputedStyle(e);
            grounds.set(e, `${backgroundColor} ${opacity} ${ground(e.parentElement)}`);
        }
        return grounds.get(e);
    };
    const words = [...document.querySelectorAll('pre span')].filter(e => e.checkVisibility());
    const like = words.filter(word => {
        const { color, fontSize, fontWeight } = getComputedStyle(word);
        const look = [color, fontSize, fontWeight, ground(word)].join();
        const known = seen.has(look);
        seen.add(look);
        return known;
    });
    like.forEach(word => word.replaceWith(...word.childNodes));
}"""
GRAVE = ("serious", "critical")
ORDER = """() => [...document.querySelectorAll('.bd-article :is(h1, h2, h3, h4, h5, h6)')]
    .filter(h => h.checkVisibility()).map(h => +h.tagName[1])"""


def broken(visit, theme):
    """Elements of a page with which a rule finds grave fault."""
    visit.page.set_default_timeout(180_000)
    visit.page.evaluate(THIN)
    found = Axe().run(visit.page, context=FORMULAS, options=RULES[theme] | HOW).response
    return [
        (rule["id"], node["html"][:120], node["target"])
        for rule in found["violations"]
        if rule["impact"] in GRAVE
        for node in rule["nodes"]
    ]


def test_no_rule_of_accessibility_is_gravely_broken(wide):
    assert broken(wide, "light") == []


@pytest.mark.parametrize("name", toc())
def test_colours_keep_their_contrast_in_the_dark(browser, name):
    with browser.visit(name, theme="dark") as visit:
        assert broken(visit, "dark") == []


def test_a_pale_word_of_a_listing_is_found(browser):
    with browser.visit("book/range-bearing/noise") as visit:
        visit.page.locator("pre .n:visible").last.evaluate("e => { e.style.color = '#ddd' }")
        assert [rule for rule, *_ in broken(visit, "light")] == ["color-contrast"]


def test_headings_begin_with_the_title_and_skip_no_level(wide):
    levels = wide.page.evaluate(ORDER)
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert [pair for pair in pairwise(levels) if pair[1] > pair[0] + 1] == []
