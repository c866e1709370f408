"""Every page by its keys alone: Tab reaches all that a mouse can use, shows where, and leaves."""

import pytest

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
            const outlined = s.outlineStyle !== 'none' && parseFloat(s.outlineWidth) > 0
            return outlined || s.boxShadow !== 'none'
        }
        if (![e, e.parentElement, ...e.children].some(shows)) {
            window.bare.push(e.outerHTML.slice(0, 120))
        }
    })
    document.addEventListener('focusout', event => {
        // Not of an entry of the contents that folds while it has the focus: the next Tab goes on.
        if (!event.relatedTarget && event.target.checkVisibility()) window.over = true
    })
    window.wanted = used
    return used.length
}"""
MISSED = """() => window.wanted.filter(e => !window.reached.has(e) && e.checkVisibility())
    .map(e => e.outerHTML.slice(0, 120))"""
HERE = "() => document.activeElement.outerHTML.slice(0, 120)"
OVER = "() => Boolean(window.over)"
# A page of which nothing is painted takes the focus all the same, in half of the time.
UNSEEN = "() => { document.documentElement.style = 'opacity: 0; clip-path: inset(50%)' }"
SEEN = "() => document.documentElement.removeAttribute('style')"


def test_tab_reaches_every_control_and_shows_it(wide):
    page = wide.page
    wanted = page.evaluate(CONTROLS)
    assert wanted > 20  # a page has its table of contents at least
    page.evaluate(UNSEEN)
    for pressed in range(2 * wanted + 40):
        page.keyboard.press("Tab")
        if pressed % 20 == 19 and page.evaluate(OVER):
            break
    else:
        pytest.fail(f"focus never leaves the page; it is at {page.evaluate(HERE)}")
    page.evaluate(SEEN)
    assert page.evaluate(MISSED) == []
    assert page.evaluate("() => [...new Set(window.bare)]") == []
