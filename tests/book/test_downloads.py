"""The notebooks that the pages offer run by themselves once their first cell has."""

import nbformat
from browser import ROOT, toc
from downloads import IDENTITY


def test_every_chapter_is_offered_with_its_first_cell(documents, html):
    for name in (n for n in toc() if (ROOT / f"{n}.ipynb").is_file()):
        offered = html / "_sources" / f"{name}.ipynb"
        links = documents[html / f"{name}.html"].xpath("//a/@href")
        assert any(link.endswith(f"_sources/{name}.ipynb") for link in links), name
        first, *rest = nbformat.read(offered, as_version=4).cells
        assert first.id == IDENTITY
        assert rest == nbformat.read(ROOT / f"{name}.ipynb", as_version=4).cells
