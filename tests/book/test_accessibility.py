"""Every page by axe-core's rules: what keeps a reader out fails; in the dark, its colours."""

from itertools import pairwise

import pytest
from axe_playwright_python.sync_playwright import Axe
from browser import toc

RULES = {
    "light": {"runOnly": ["wcag2a", "wcag2aa", "best-practice"], "resultTypes": ["violations"]},
    "dark": {"runOnly": ["color-contrast"], "resultTypes": ["violations"]},
}
FORMULAS = {"exclude": [["mjx-container"]]}  # MathJax's own, thousands of marks a page
GRAVE = ("serious", "critical")
ORDER = """() => [...document.querySelectorAll('.bd-article :is(h1, h2, h3, h4, h5, h6)')]
    .filter(h => h.checkVisibility()).map(h => +h.tagName[1])"""


@pytest.mark.parametrize("theme", RULES)
@pytest.mark.parametrize("name", toc())
def test_no_rule_of_accessibility_is_gravely_broken(browser, name, theme):
    with browser.visit(name, theme=theme) as visit:
        visit.page.set_default_timeout(180_000)
        found = Axe().run(visit.page, context=FORMULAS, options=RULES[theme]).response
    grave = [
        (rule["id"], node["html"][:120], node["target"])
        for rule in found["violations"]
        if rule["impact"] in GRAVE
        for node in rule["nodes"]
    ]
    assert grave == []


@pytest.mark.parametrize("name", toc())
def test_headings_begin_with_the_title_and_skip_no_level(browser, name):
    with browser.visit(name) as visit:
        levels = visit.page.evaluate(ORDER)
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert [pair for pair in pairwise(levels) if pair[1] > pair[0] + 1] == []
