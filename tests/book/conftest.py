"""The built pages, parsed, and the same pages in a browser."""

import os
from pathlib import Path

import browser as chromium
import pytest
from bs4 import BeautifulSoup


@pytest.fixture(scope="session")
def html():
    """The folder of the built pages."""
    folder = chromium.ROOT / "_build" / "html"
    if not (folder / "index.html").is_file():
        pytest.fail("no _build/html: run `make book` first")
    return folder


@pytest.fixture(scope="session")
def documents(html) -> dict[Path, BeautifulSoup]:
    """Every built page, parsed, by its path."""
    paths = [p for p in html.rglob("*.html") if "_static" not in p.relative_to(html).parts]
    return {p: BeautifulSoup(p.read_text(encoding="utf-8"), "html.parser") for p in paths}


@pytest.fixture(scope="session")
def browser(html):
    """A browser, and a server of the built pages."""
    if chromium.find() is None:
        missing = pytest.fail if os.environ.get("REQUIRE_BROWSER") else pytest.skip
        missing("page checks skipped: no Chromium found")
    with chromium.site(html) as site:
        yield site


@pytest.fixture(scope="module", params=chromium.toc())
def visit(browser, request):
    """A page of the table of contents, loaded as on a first visit."""
    with browser.visit(request.param) as visit:
        yield visit
