"""The built pages in a headless Chromium that can reach nothing but them."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import yaml
from playwright.sync_api import Browser, BrowserContext, Error, Page, Request, sync_playwright

ROOT = Path(__file__).resolve().parent.parent
NAMES = ("chromium", "chromium-browser", "google-chrome")
ARGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",  # nothing else is reached
]
BARS = ["--hide-scrollbars"]  # what Playwright asks for, and tests of what scrolls must not
# The theme's own storage keys. Without them it follows the system, as on a first visit.
REMEMBER = "localStorage.setItem('mode', '{0}'); localStorage.setItem('theme', '{0}')"
FORGET = "() => { localStorage.clear(); sessionStorage.clear() }"
STILL = "*, ::before, ::after { transition: none !important; animation: none !important }"
SETTLED = "async () => { await window.MathJax?.startup?.promise; await document.fonts.ready }"


def toc() -> list[str]:
    """Every page of _toc.yml, in reading order, without ending."""
    return list(_files(yaml.safe_load((ROOT / "_toc.yml").read_text(encoding="utf-8"))))


def _files(node: Any) -> Iterator[str]:
    if isinstance(node, dict):
        for key, value in node.items():
            if key in ("root", "file"):
                yield value
            else:
                yield from _files(value)
    elif isinstance(node, list):
        for item in node:
            yield from _files(item)


def find() -> str | None:
    """A Chromium of this machine."""
    return next(filter(None, map(shutil.which, NAMES)), None)


class _Handler(SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: object) -> None:
        """Say nothing."""


class _Server(ThreadingHTTPServer):
    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser may hang up; what it then lacks, it reports itself."""


@contextmanager
def _serve(folder: Path) -> Iterator[str]:
    server = _Server(("127.0.0.1", 0), partial(_Handler, directory=str(folder)))
    thread = Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


@dataclass
class Visit:
    """A loaded page, and what went wrong while it loaded."""

    page: Page
    theme: str
    outside: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Site:
    """A browser, and the address of the built pages."""

    browser: Browser
    context: BrowserContext
    address: str
    free: list[Page] = field(default_factory=list)

    @contextmanager
    def visit(self, name: str, width: int = 1280, theme: str = "") -> Iterator[Visit]:
        """Load a page and wait for MathJax; requests to any other host, which fail, are kept."""
        home = self.address + "/"
        with self._remembering(theme) if theme else self._tab() as page:
            visit = Visit(page, theme or "light")

            def note(request: Request) -> None:
                if not request.url.startswith((home, "blob:")):
                    visit.outside.append(request.url)

            def listen(message: Any) -> None:
                if message.type == "error" and message.location["url"] not in visit.outside:
                    visit.errors.append(f"console: {message.text} ({message.location['url']})")

            def fail(error: Error) -> None:
                visit.errors.append(f"script: {error}")

            heard = {"request": note, "pageerror": fail, "console": listen}
            for event, hear in heard.items():
                page.on(event, hear)
            page.set_viewport_size({"width": width, "height": 900})
            response = page.goto(f"{home}{name}.html")
            if response is None or not response.ok:
                raise FileNotFoundError(f"{name}.html is not built: run `make book`")
            page.add_style_tag(content=STILL)
            page.evaluate(SETTLED)
            yield visit
            for event, hear in heard.items():
                page.remove_listener(event, hear)

    @contextmanager
    def _remembering(self, theme: str) -> Iterator[Page]:
        """A tab of somebody who chose a theme on an earlier visit."""
        with self.browser.new_context(color_scheme=theme) as context:
            context.add_init_script(REMEMBER.format(theme))
            yield context.new_page()

    @contextmanager
    def _tab(self) -> Iterator[Page]:
        """A tab as on a first visit; one that was used has at hand what all pages load."""
        page = self.free.pop() if self.free else self.context.new_page()
        try:
            page.emulate_media(media="null", color_scheme="light")
            yield page
            page.mouse.move(0, 0)
            page.evaluate(FORGET)
            page.goto("about:blank")
        except BaseException:
            page.close()
            raise
        self.free.append(page)


@contextmanager
def site(folder: Path) -> Iterator[Site]:
    """Serve a folder of pages on this machine alone, with a browser to look at them."""
    with _serve(folder) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=find(), args=ARGS, ignore_default_args=BARS
        )
        try:
            yield Site(browser, browser.new_context(), address)
        finally:
            browser.close()
