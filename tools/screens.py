"""Every page as pictures: 1280 and 390 px wide, light and dark, in pieces that can be looked at."""

import argparse
import sys
from pathlib import Path

from browser import Site, find, site, toc
from playwright.sync_api import Page

WIDTHS = {"wide": 1280, "narrow": 390}
THEMES = ("light", "dark")
TALLEST = 4000


def shoot(page: Page, width: int, out: Path, stem: str) -> None:
    """The full page, cut where it is too tall; each cut may change its height a little."""
    top, number = 0, 0
    while (height := page.evaluate("document.documentElement.scrollHeight") - top) > 0:
        number += 1
        page.screenshot(
            path=out / f"{stem}-{number}.png",
            full_page=True,
            clip={"x": 0, "y": top, "width": width, "height": min(TALLEST, height)},
        )
        top += TALLEST


def shoot_all(pages: Site, out: Path) -> None:
    """Every page of the table of contents, at each width and in each theme."""
    for name in toc():
        for size, width in WIDTHS.items():
            for theme in THEMES:
                with pages.visit(name, width, theme) as visit:
                    stem = f"{name.replace('/', '-')}--{size}-{theme}"
                    shoot(visit.page, width, out, stem)
        sys.stdout.write(f"{name}\n")


def main() -> None:
    """Read the two folders from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("html", type=Path, help="the built pages")
    parser.add_argument("out", type=Path, help="where the pictures go")
    arguments = parser.parse_args()
    if find() is None:
        parser.error("no Chromium found")
    arguments.out.mkdir(parents=True, exist_ok=True)
    with site(arguments.html) as pages:
        shoot_all(pages, arguments.out)


if __name__ == "__main__":
    main()
