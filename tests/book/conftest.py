"""The built pages, parsed, and the same pages in a browser."""

import os
from functools import cache
from pathlib import Path

import browser as chromium
import lxml.html
import pytest
from xdist.scheduler import LoadScopeScheduling

PAGES = set(chromium.toc())
DRAWN = "() => new Promise(drawn => requestAnimationFrame(() => requestAnimationFrame(drawn)))"
FOLLOWS = "theme => document.documentElement.dataset.theme == theme"
OPEN = """document.querySelectorAll('.bd-article details').forEach(fold => { fold.open = true; })"""


@pytest.fixture(scope="session")
def html():
    """The folder of the built pages."""
    folder = chromium.ROOT / "_build" / "html"
    if not (folder / "index.html").is_file():
        pytest.fail("no _build/html: run `make book` first")
    return folder


@cache
def _parsed(path: Path) -> lxml.html.HtmlElement:
    return lxml.html.document_fromstring(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def document(html):
    """A built page by its name, parsed."""
    return lambda name: _parsed(html / f"{name}.html")


@pytest.fixture(scope="session")
def documents(html) -> dict[Path, lxml.html.HtmlElement]:
    """Every built page, parsed, by its path."""
    paths = [p for p in html.rglob("*.html") if "_static" not in p.relative_to(html).parts]
    return {path: _parsed(path) for path in paths}


@pytest.fixture(scope="session")
def browser(html):
    """A browser, and a server of the built pages."""
    if chromium.find() is None:
        missing = pytest.fail if os.environ.get("REQUIRE_BROWSER") else pytest.skip
        missing("page checks skipped: no Chromium found")
    with chromium.site(html) as site:
        yield site


@pytest.fixture(scope="session", params=chromium.toc())
def loaded(browser, request):
    """A page of the table of contents, loaded as on a first visit, with its folds open."""
    with browser.visit(request.param) as visit:
        visit.page.evaluate(OPEN)
        yield visit


def _as_wide_as(visit, width):
    if visit.page.viewport_size["width"] != width:
        visit.page.set_viewport_size({"width": width, "height": 900})
        visit.page.evaluate(DRAWN)
    return visit


def _in(visit, theme):
    if visit.theme != theme:
        visit.page.emulate_media(color_scheme=theme)
        visit.page.wait_for_function(FOLLOWS, arg=theme)
        visit.theme = theme
    return visit


@pytest.fixture
def wide(loaded):
    """A page on a wide screen."""
    return _in(_as_wide_as(loaded, 1280), "light")


@pytest.fixture
def dark(loaded):
    """The same page in the dark."""
    return _in(_as_wide_as(loaded, 1280), "dark")


@pytest.fixture
def narrow(loaded):
    """The same page on a telephone's screen, in whatever theme: no script looks at the width."""
    return _as_wide_as(loaded, 390)


@pytest.hookimpl(tryfirst=True)  # before pytest puts the tests of a page together
def pytest_collection_modifyitems(items):
    """Of each page first what is seen wide and light, then dark, then narrow: two changes."""
    items.sort(key=lambda item: [name in item.fixturenames for name in ("narrow", "dark")])


class ByPage(LoadScopeScheduling):
    """A worker takes all tests of a page, which is loaded once, or of a module.

    Groups of xdist 3.8 are lost in silence with pytest 9.2, whose items keep their names.
    """

    def _split_scope(self, nodeid: str) -> str:
        module, _, test = nodeid.partition("::")
        named = [page for page in PAGES if f"[{page}]" in test or f"[{page}-" in test]
        return max(named, key=len, default=module)


def pytest_xdist_make_scheduler(config, log):
    """For ``--dist loadscope``."""
    return ByPage(config, log)
