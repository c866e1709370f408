"""Every page by axe-core's rules: what keeps a reader out fails; in the dark, its colours."""

from itertools import pairwise

import pytest
from axe_playwright_python.sync_playwright import Axe

COLOURED = ["color-contrast", "link-in-text-block"]
ALL = {
    "runOnly": ["wcag2a", "wcag2aa", "best-practice"],
    "rules": {rule: {"enabled": False} for rule in COLOURED},
}
COLOURS = {"runOnly": COLOURED}
HOW = {"resultTypes": ["violations"], "preload": False}  # loads no style sheet a second time
FORMULAS = {"exclude": [["mjx-container"]]}  # MathJax's own, thousands of marks a page
# Of thousands of words, each look is marked once: colour, size, weight, and all that is behind it;
# for links, their underlines and the words around them too.
LOOKS = """() => {
    const seen = new Set();
    const grounds = new Map();
    const ground = e => {
        if (!e) return '';
        if (!grounds.has(e)) {
            const { backgroundColor, backgroundImage, opacity, position } = getComputedStyle(e);
            const own = [backgroundColor, backgroundImage, opacity, position].join(' ');
            grounds.set(e, `${own} ${ground(e.parentElement)}`);
        }
        return grounds.get(e);
    };
    const text = e => [...e.childNodes].some(n => n.nodeType == Node.TEXT_NODE && n.data.trim());
    for (const e of document.body.querySelectorAll('*')) {
        e.removeAttribute('data-look');
        const isLink = e.matches('a');
        if (!(isLink || text(e)) || !e.checkVisibility() || e.closest('mjx-container')) continue;
        const { color, fontSize, fontWeight, textShadow, textDecoration } = getComputedStyle(e);
        const about = isLink ? [textDecoration, getComputedStyle(e.parentElement).color] : [];
        const look = [color, fontSize, fontWeight, textShadow, ground(e), ...about].join();
        if (!seen.has(look)) e.setAttribute('data-look', '');
        seen.add(look);
    }
    return seen.size;
}"""
# Code is thousands of coloured words. Those whose look is marked elsewhere are plain text while the
# rules look at the page, which takes half the time.
PLAIN = """() => {
    window.coloured = [...document.querySelectorAll('pre')].map(own => [own, own.cloneNode(true)]);
    for (const [own, plain] of window.coloured) {
        for (const word of plain.querySelectorAll('span:not([data-look], [id], :has(*))'))
            word.replaceWith(word.textContent);
        own.replaceWith(plain);
    }
}"""
AGAIN = "() => window.coloured.forEach(([own, plain]) => plain.replaceWith(own))"
FOLLOWS = "theme => document.documentElement.dataset.theme == theme"
# Of axe-core's own rule nothing comes but that it cannot see what lies behind a paragraph.
NOT_UNDERLINED = """() => [...document.querySelectorAll('.bd-article :is(p, li, dd) a[href]')]
    .filter(a => a.checkVisibility() && !a.matches('.headerlink')
        && [...a.parentElement.childNodes].some(n => n.nodeType == Node.TEXT_NODE && n.data.trim())
        && !getComputedStyle(a).textDecorationLine.includes('underline'))
    .map(a => a.innerText)"""
GRAVE = ("serious", "critical")
ORDER = """() => [...document.querySelectorAll('.bd-article :is(h1, h2, h3, h4, h5, h6)')]
    .filter(h => h.checkVisibility()).map(h => +h.tagName[1])"""


def broken(visit, rules, context):
    """Elements of a page with which a rule finds grave fault."""
    visit.page.set_default_timeout(180_000)
    assert visit.page.evaluate(LOOKS) > 10
    visit.page.evaluate(PLAIN)
    try:
        found = Axe().run(visit.page, context=context, options=rules | HOW).response
    finally:
        visit.page.evaluate(AGAIN)
    return [
        (rule["id"], node["html"][:120], node["target"])
        for rule in found["violations"]
        if rule["impact"] in GRAVE
        for node in rule["nodes"]
    ]


def pale(visit):
    """Words, each look once, that their ground does not set off."""
    return broken(visit, COLOURS, {"include": [["[data-look]"]], **FORMULAS})


def test_no_rule_of_accessibility_is_gravely_broken(wide):
    assert broken(wide, ALL, FORMULAS) == []


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_words_keep_their_contrast(wide, theme):
    wide.page.emulate_media(color_scheme=theme)
    wide.page.wait_for_function(FOLLOWS, arg=theme)
    found = pale(wide)
    wide.page.emulate_media(color_scheme="light")
    wide.page.wait_for_function(FOLLOWS, arg="light")
    assert found == []


@pytest.mark.parametrize(
    ("page", "word"),
    [
        ("book/range-bearing/noise", "pre .n"),
        ("book/range-bearing/noise", ".bd-article p"),
        ("book/api/sar", "dt .sig-name"),
        ("book/scorecard", ".bd-article summary"),
    ],
)
def test_a_pale_word_is_found(browser, page, word):
    with browser.visit(page) as visit:
        assert pale(visit) == []
        visit.page.locator(f"{word}:visible").last.evaluate("e => { e.style.color = '#ddd' }")
        assert {rule for rule, *_ in pale(visit)} == {"color-contrast"}


def test_links_among_words_are_underlined(wide):
    assert wide.page.evaluate(NOT_UNDERLINED) == []


def test_a_link_without_its_line_is_found(browser):
    with browser.visit("book/range-bearing/noise") as visit:
        link = visit.page.locator(".bd-article section > p > a:visible").first
        link.evaluate("e => { e.style.setProperty('text-decoration', 'none', 'important') }")
        assert visit.page.evaluate(NOT_UNDERLINED) == [link.inner_text()]


def test_headings_begin_with_the_title_and_skip_no_level(wide):
    levels = wide.page.evaluate(ORDER)
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert [pair for pair in pairwise(levels) if pair[1] > pair[0] + 1] == []
