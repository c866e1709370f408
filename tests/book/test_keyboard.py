"""Every page by its keys alone: Tab reaches all that a mouse can use, shows where it is, and leaves."""

import pytest
from browser import toc

CONTROLS = """() => {
    const list = [...document.querySelectorAll(
        'a[href], button, input, select, textarea, summary, [tabindex], [role=slider]')]
    const used = list.filter(e => {
        if (e.disabled || !e.checkVisibility({visibilityProperty: true, opacityProperty: true}))
            return false
        if (e.type === 'radio' && !e.checked) return false  // arrows move within a group
        const to = e.getAttribute('tabindex')
        return to !== '-1' || e.matches('.skip-link')
    })
    window.reached = new Set()
    window.bare = []
    document.addEventListener('focusin', event => {
        const e = event.target
        window.reached.add(e)
        const shows = part => {
            const s = getComputedStyle(part)
            return s.outlineStyle !== 'none' && parseFloat(s.outlineWidth) > 0 || s.boxShadow !== 'none'
        }
        if (![e, e.parentElement, ...e.children].some(shows)) window.bare.push(e.outerHTML.slice(0, 120))
    })
    window.wanted = used
    return used.length
}"""
MISSED = """() => window.wanted.filter(e => !window.reached.has(e) && e.checkVisibility())
    .map(e => e.outerHTML.slice(0, 120))"""
HERE = "() => document.activeElement.outerHTML.slice(0, 120)"
AT_THE_END = "() => document.activeElement === document.body"


@pytest.mark.parametrize("name", toc())
def test_tab_reaches_every_control_and_shows_it(browser, name):
    with browser.visit(name) as visit:
        page = visit.page
        wanted = page.evaluate(CONTROLS)
        assert wanted > 20  # a page has its table of contents at least
        for _ in range(2 * wanted + 20):
            page.keyboard.press("Tab")
            if page.evaluate(AT_THE_END):
                break
        else:
            pytest.fail(f"focus never leaves the page; it is at {page.evaluate(HERE)}")
        assert page.evaluate(MISSED) == []
        assert page.evaluate("() => [...new Set(window.bare)]") == []
