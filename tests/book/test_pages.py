"""The built pages, as files and in a browser that can reach nothing else."""

import re
from collections import Counter
from urllib.parse import parse_qs, unquote, urlsplit

import nbformat
import pytest
from browser import ROOT, toc

PEREA_FIGURES = [
    "1",
    "2a",
    "2b",
    *"34567",
    "8a",
    "8b",
    "8c",
    "8d",
    "9",
    *(f"10{p}" for p in "abcde"),
]
NOTEBOOKS = [name for name in toc() if (ROOT / f"{name}.ipynb").is_file()]
CSS_ADDRESS = re.compile(r"""(?:url\(|@import)\s*["']?([^"')\s;]+)""")

# Every text in a ledger's output or a caption with little contrast or weight. The colours are
# painted onto one pixel, so that any CSS colour is understood and transparency is blended.
PALE = """() => {
    const context = new OffscreenCanvas(1, 1).getContext('2d', {willReadFrequently: true});
    const painted = new Map();
    const paint = layers => {
        const key = layers.join();
        if (!painted.has(key)) {
            for (const [color, opacity] of [['white', 1], ...layers]) {
                context.fillStyle = color;
                context.globalAlpha = opacity;
                context.fillRect(0, 0, 1, 1);
            }
            painted.set(key, [...context.getImageData(0, 0, 1, 1).data].slice(0, 3));
        }
        return painted.get(key);
    };
    const luminance = rgb => rgb
        .map(v => v / 255).map(v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
        .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
    const contrast = element => {
        const behind = [];
        let opacity = 1;
        for (let e = element; e; e = e.parentElement) {
            behind.unshift([getComputedStyle(e).backgroundColor, 1]);
            opacity *= getComputedStyle(e).opacity;
        }
        const text = [getComputedStyle(element).color, opacity];
        const [low, high] = [paint(behind), paint([...behind, text])]
            .map(luminance).sort((a, b) => a - b);
        return (high + 0.05) / (low + 0.05);
    };
    const own = e => [...e.childNodes].some(n => n.nodeType == Node.TEXT_NODE && n.data.trim());
    const boxes = '.claim, .claims-summary, .claims-table, .claims-listing, figcaption';
    return [...document.querySelectorAll(boxes)]
        .flatMap(box => [box, ...box.querySelectorAll('*')])
        .filter(e => own(e) && !e.matches('.headerlink'))
        .map(e => [contrast(e), +getComputedStyle(e).fontWeight, e.textContent.slice(0, 50)])
        .filter(([ratio, weight]) => ratio < 4.5 || weight < 400);
}"""

# Display formulas wider than the page, and inline ones that are cut and cannot be scrolled.
WIDE = """[...document.querySelectorAll('div.math mjx-container')]
    .filter(box => box.scrollWidth > box.clientWidth + 1).map(box => box.textContent)"""
CUT = """[...document.querySelectorAll('span.math')].filter(box =>
    box.querySelector('mjx-math')?.getBoundingClientRect().width > box.clientWidth + 1
    && getComputedStyle(box).overflowX == 'hidden').map(box => box.textContent)"""


# --- as files -----------------------------------------------------------------------------------


def addresses(page):
    """Every address of a page, with whether following it is left to the reader."""
    for tag in page.iter("a", "link", "img", "script", "source", "iframe", "video", "object"):
        for attribute in ("href", "src", "data", "poster"):
            if attribute in tag.attrib:
                yield tag.get(attribute), tag.tag == "a"


def anchors(page):
    return set(page.xpath("//@id | //@name"))


def filters(target, fragment):
    """Whether a fragment chooses rows of the scorecard; test_scorecard follows each."""
    return target.name == "scorecard.html" and set(parse_qs(fragment)) <= {
        "paper",
        "limit",
        "verdict",
    }


def test_every_link_has_its_target_and_nothing_is_loaded_from_elsewhere(documents):
    ids = {path: anchors(page) for path, page in documents.items()}
    broken = []
    for path, page in documents.items():
        for address, is_link in addresses(page):
            parts = urlsplit(address)
            if parts.scheme or parts.netloc:
                good = is_link and parts.scheme in ("http", "https", "mailto")
            else:
                target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
                fragment = unquote(parts.fragment)
                known = fragment in ids.get(target, ()) or filters(target, parts.fragment)
                good = target.is_file() and (not fragment or known)
            if not good:
                broken.append(f"{path.name}: {address}")
    assert not broken, "\n".join(broken)


def test_style_sheets_load_nothing_from_elsewhere(html):
    broken = []
    for path in html.rglob("*.css"):
        for address in CSS_ADDRESS.findall(path.read_text(encoding="utf-8")):
            parts = urlsplit(address)
            local = not parts.scheme and (path.parent / unquote(parts.path)).is_file()
            if not local and parts.scheme != "data" and not address.startswith("#"):
                broken.append(f"{path.relative_to(html)}: {address}")
    assert not broken, "\n".join(broken)


@pytest.mark.parametrize("name", ["index.html", "genindex.html", "search.html", "searchindex.js"])
def test_index_and_search_exist(html, name):
    assert (html / name).is_file()


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_every_figure_has_its_label_and_caption(document, name):
    figures = {f.get("id"): f for f in document(name).iter("figure")}
    for cell in nbformat.read(ROOT / f"{name}.ipynb", as_version=4).cells:
        label = cell.metadata.get("mystnb", {}).get("figure", {}).get("name")
        if label:
            assert label in figures
            assert figures[label].find_class("caption-text")[0].text_content().strip()


@pytest.mark.parametrize("number", PEREA_FIGURES)
def test_every_figure_of_the_paper_is_in_the_book_once(documents, number):
    labels = Counter(f.get("id") for page in documents.values() for f in page.iter("figure"))
    assert labels[f"fig-perea-{number}"] == 1


# --- in a browser -------------------------------------------------------------------------------


def test_the_page_loads_without_error_and_without_network(wide):
    assert wide.outside == []
    assert wide.errors == []


def test_every_formula_is_rendered_and_fits(wide):
    written, rendered, failed = (
        wide.page.locator(selector).count()
        for selector in (".math", "mjx-container", "mjx-merror, [data-mjx-error]")
    )
    assert rendered >= written
    assert failed == 0
    assert wide.page.evaluate(WIDE) == []


def test_every_image_is_shown_and_described(wide):
    images = wide.page.evaluate("[...document.images].map(i => [i.src, i.naturalWidth, i.alt])")
    for source, width, alt in images:
        assert width > 0, source
        assert alt.strip(), source


def test_verdicts_and_captions_are_legible(wide):
    assert wide.page.evaluate(PALE) == []


def test_verdicts_and_captions_are_legible_in_the_dark(dark):
    assert dark.page.evaluate(PALE) == []


def test_a_narrow_screen_cuts_no_formula(narrow):
    assert narrow.page.evaluate(CUT) == []
