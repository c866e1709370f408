"""The whole book as one PDF, printed by Chromium page by page, with an outline of its pages."""

import argparse
import sys
from io import BytesIO
from pathlib import Path

from browser import Site, find, site, toc
from pypdf import PdfReader, PdfWriter

# What a reader would unfold stands open, and nothing floats.
OPEN = """() => {
    document.querySelectorAll('details').forEach(details => { details.open = true; });
    document.querySelectorAll('dialog').forEach(dialog => dialog.remove());
}"""
PRINTED = """
.bd-sidebar-primary, .bd-sidebar-secondary, .bd-header-article, .prev-next-area, .headerlink,
#jb-print-toc { display: none !important; }
.bd-container, .bd-container__inner, .bd-main, .bd-content, .bd-article-container, .bd-article {
    display: block !important; max-width: none !important; width: auto !important;
    margin: 0 !important; padding: 0 !important; overflow: visible !important;
}
pre { white-space: pre-wrap; overflow-wrap: anywhere; }
div.cell, div.cell_input, div.cell_output, div.highlight, pre { overflow: visible !important; }
div.cell, div.cell_input, pre { break-inside: auto; }
figure, .claim, tr { break-inside: avoid; }
img, table { max-width: 100%; }
"""


def printed(pages: Site, name: str) -> tuple[str, bytes]:
    """Title and PDF of a page."""
    with pages.visit(name, 900, "light") as visit:
        page = visit.page
        page.emulate_media(media="print")
        page.add_style_tag(content=PRINTED)
        page.evaluate(OPEN)
        title = page.locator("h1").first.inner_text().rstrip("#").strip()
        margin = {"top": "16mm", "bottom": "16mm", "left": "14mm", "right": "14mm"}
        return title, page.pdf(format="A4", scale=0.8, margin=margin, print_background=True)


def main() -> None:
    """Read the folder of the pages and the PDF's name from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("html", type=Path, help="the built pages")
    parser.add_argument("out", type=Path, help="the PDF")
    parser.add_argument("--pages", nargs="*", help="only these; all by default")
    arguments = parser.parse_args()
    if find() is None:
        parser.error("no Chromium found")
    book = PdfWriter()
    with site(arguments.html) as pages:
        for name in arguments.pages or toc():
            title, content = printed(pages, name)
            first = len(book.pages)
            book.append(PdfReader(BytesIO(content)), import_outline=False)
            book.add_outline_item(title=title, page_number=first)
            sys.stdout.write(f"{title}: {len(book.pages) - first} pages\n")
    book.add_metadata({"/Title": "When Kalman Filters Diverge"})
    book.write(arguments.out)


if __name__ == "__main__":
    main()
