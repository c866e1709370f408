"""Every page by axe-core's rules: what keeps a reader out fails; in the dark, its colours."""

from itertools import pairwise

import pytest
from axe_playwright_python.sync_playwright import Axe

AXE = Axe().axe_script
COLOURS = {"runOnly": ["color-contrast", "link-in-text-block"]}
ALL = {
    "runOnly": ["wcag2a", "wcag2aa", "best-practice"],  # colours among them
    "rules": {"region": {"enabled": False}},  # looks at every element, and is never grave
}
MARKED = """() => axe.configure({rules: [
    {id: 'color-contrast', selector: '[data-look]'},
    {id: 'link-in-text-block', selector: 'a[data-look]'},
]})"""
# No style sheet is loaded a second time.
RUN = """rules => axe.run({...rules, resultTypes: ['violations'], preload: false})
    .then(found => found.violations)"""
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
# Code is thousands of coloured words, a formula hundreds of MathJax's own marks. While the rules
# look at the page, words whose look is marked elsewhere are plain, and formulas are text in a box.
PLAIN = """() => {
    const code = ':is(pre, code, dt.sig)';
    const formulas = [...document.querySelectorAll('mjx-container')].map(own => {
        const { width, height } = own.getBoundingClientRect();
        const plain = document.createElement('span');
        plain.style = 'display: inline-block; overflow: hidden';
        Object.assign(plain.style, { width: `${width}px`, height: `${height}px` });
        plain.textContent = own.textContent;
        return [own, plain];
    });
    const listings = [...document.querySelectorAll(`${code}:not(${code} *)`)].map(own => {
        const plain = own.cloneNode(true);
        for (const word of [...plain.querySelectorAll('span')].reverse()) {  // inner ones first
            if (!word.children.length && word.getAttributeNames().join() == 'class')
                word.replaceWith(word.textContent);
        }
        return [own, plain];
    });
    window.replaced = [...formulas, ...listings];
    for (const [own, plain] of window.replaced) own.replaceWith(plain);
}"""
AGAIN = "() => window.replaced.forEach(([own, plain]) => plain.replaceWith(own))"
# Of axe-core's own rule nothing comes but that it cannot see what lies behind a paragraph.
NOT_UNDERLINED = """() => [...document.querySelectorAll('.bd-article :is(p, li, dd) a[href]')]
    .filter(a => a.checkVisibility() && !a.matches('.headerlink')
        && [...a.parentElement.childNodes].some(n => n.nodeType == Node.TEXT_NODE && n.data.trim())
        && !getComputedStyle(a).textDecorationLine.includes('underline'))
    .map(a => a.innerText)"""
GRAVE = ("serious", "critical")
ORDER = """() => [...document.querySelectorAll('.bd-article :is(h1, h2, h3, h4, h5, h6)')]
    .filter(h => h.checkVisibility()).map(h => +h.tagName[1])"""


def broken(visit, rules):
    """Elements of a page with which a rule finds grave fault; for colours, each look once."""
    page = visit.page
    assert page.evaluate(LOOKS) > 10
    page.evaluate(PLAIN)
    try:
        if not page.evaluate("() => 'axe' in window"):
            page.evaluate(AXE)
            page.evaluate(MARKED)
        violations = page.evaluate(RUN, rules)
    finally:
        page.evaluate(AGAIN)
    return [
        (rule["id"], node["html"][:120], node["target"])
        for rule in violations
        if rule["impact"] in GRAVE
        for node in rule["nodes"]
    ]


def test_no_rule_of_accessibility_is_gravely_broken(wide):
    assert broken(wide, ALL) == []


def test_words_keep_their_contrast_in_the_dark(dark):
    assert broken(dark, COLOURS) == []


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
    """On pages where the first test of this module finds none."""
    with browser.visit(page) as visit:
        visit.page.locator(f"{word}:visible").last.evaluate("e => { e.style.color = '#ddd' }")
        assert {rule for rule, *_ in broken(visit, COLOURS)} == {"color-contrast"}


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
