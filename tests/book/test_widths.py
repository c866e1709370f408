"""Nothing is cut: a wide screen shows all, on a narrow one what is too wide scrolls visibly."""

import pytest

# Every piece that is wider than a box around it, and whether that scrolls.
WIDE = """() => {
    const article = document.querySelector('.bd-article').getBoundingClientRect();
    const found = new Map();
    const pieces = 'pre, table, .results, .math, img, svg, canvas, .claim, .sd-card';
    for (const piece of document.querySelectorAll(`.bd-article :is(${pieces})`)) {
        if (!piece.checkVisibility() || piece.closest('mjx-container')) continue;
        let box = piece;
        const holds = box => box.scrollWidth <= box.clientWidth + 1
            || getComputedStyle(box).overflowX == 'visible';  // that cuts nothing itself
        while (!box.matches('.bd-article') && holds(box)) box = box.parentElement;
        const name = `${piece.localName}: ${piece.textContent.trim().slice(0, 60)}`;
        if (box.matches('.bd-article')) {
            const { left, right } = piece.getBoundingClientRect();
            const outside = Math.max(right, left + piece.scrollWidth) > article.right + 1;
            if (outside) found.set(piece, ['cut', name]);
            continue;
        }
        const style = getComputedStyle(box);
        if (box.clientWidth == 0) continue;
        const borders = parseFloat(style.borderTopWidth) + parseFloat(style.borderBottomWidth);
        const bar = box.offsetHeight - box.clientHeight - borders;
        const scrolls = ['auto', 'scroll'].includes(style.overflowX);
        found.set(box, [scrolls && bar >= 4 ? 'scrolls' : 'cut', name]);
    }
    return [...found.values()];
}"""
INSERT = """style => {
    const box = document.createElement('div');
    box.innerHTML = `<pre style="${style}">${'wide '.repeat(100)}</pre>`;
    document.querySelector('.bd-article section').append(box);
}"""


def test_on_a_wide_screen_everything_fits(wide):
    assert wide.page.evaluate(WIDE) == []


def test_on_a_narrow_screen_what_is_wide_scrolls_and_shows_it(narrow):
    assert [text for how, text in narrow.page.evaluate(WIDE) if how != "scrolls"] == []
    assert narrow.page.evaluate("document.documentElement.scrollWidth") <= 390


@pytest.mark.parametrize(
    ("style", "how"),
    [
        ("", "scrolls"),
        ("overflow: hidden", "cut"),
        ("overflow: visible", "cut"),
        ("scrollbar-width: none", "cut"),
    ],
)
def test_what_is_wide_is_found(browser, style, how):
    with browser.visit("book/references", width=1280) as visit:
        assert visit.page.evaluate(WIDE) == []
        visit.page.evaluate(INSERT, style)
        assert [found for found, _ in visit.page.evaluate(WIDE)] == [how]
