"""Every page as pictures: 1280 and 390 px wide, light and dark, in pieces that can be looked at."""

import argparse
import sys
from pathlib import Path

from browser import Site, find, site, toc
from playwright.sync_api import Page

WIDTHS = {"wide": 1280, "narrow": 390}
THEMES = ("light", "dark")
TALLEST = 4000


def pieces(height: int) -> list[tuple[int, int]]:
    """Top and height of each piece."""
    return [(top, min(TALLEST, height - top)) for top in range(0, height, TALLEST)]


def shoot(page: Page, width: int, out: Path, stem: str) -> None:
    """The full page, cut where it is too tall."""
    parts = pieces(page.evaluate("document.documentElement.scrollHeight"))
    for number, (top, height) in enumerate(parts, 1):
        page.screenshot(
            path=out / f"{stem}{f'-{number}' if len(parts) > 1 else ''}.png",
            full_page=True,
            clip={"x": 0, "y": top, "width": width, "height": height},
        )


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
