"""Pages of the library: every public name once, where its package says, with examples that run."""

import ast
import doctest
import importlib
import inspect
import pkgutil
import re
from collections import Counter

import nbformat
import pytest
from browser import ROOT, toc

import navfilters

PAGES = [ROOT / "book" / "api.md", *sorted((ROOT / "book" / "api").glob("*.md"))]
EXAMPLE = re.compile(r"```pycon\n(.*?)```", re.DOTALL)
PACKAGE = re.compile(r"\.\. currentmodule:: navfilters\.(\S+)")
NAME = re.compile(r"\.\. (?:autofunction|autoclass|py:data|py:function):: (\w+)")
MODULE = re.compile(r"\.\. automodule:: navfilters\.(\S+)")


def packages():
    """Every package that shows names."""
    for found in pkgutil.walk_packages(navfilters.__path__, "navfilters."):
        if found.ispkg and hasattr(importlib.import_module(found.name), "__all__"):
            yield found.name


def shown():
    """Full names on the pages, name by name."""
    for page in PAGES:
        package = ""
        for line in page.read_text(encoding="utf-8").splitlines():
            if found := PACKAGE.match(line):
                package = found[1]
            elif found := NAME.match(line):
                yield f"navfilters.{package}.{found[1]}"


def imported_modules():
    """Modules that chapters import as such, without ``navfilters.``."""
    for path in (ROOT / "book").rglob("*.ipynb"):
        for cell in nbformat.read(path, as_version=4).cells:
            tree = ast.parse(cell.source if cell.cell_type == "code" else "")
            for node in (n for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)):
                yield from (f"{node.module}.{a.name}".partition(".")[2] for a in node.names)


def test_every_public_name_is_on_one_page_and_no_other_is():
    public = {
        f"{package}.{name}"
        for package in packages()
        for name in importlib.import_module(package).__all__
        if not inspect.ismodule(getattr(importlib.import_module(package), name))
    }
    assert Counter(shown()) == Counter(public)


def test_whole_modules_are_those_that_chapters_import_as_such():
    whole = {name for page in PAGES for name in MODULE.findall(page.read_text(encoding="utf-8"))}
    assert whole - {"types"} <= set(imported_modules())


def test_every_page_is_in_the_table_of_contents():
    assert {f"book/api/{p.stem}" for p in PAGES[1:]} == {n for n in toc() if "book/api/" in n}


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_its_example_runs(page):
    text = "\n".join(EXAMPLE.findall(page.read_text(encoding="utf-8")))
    example = doctest.DocTestParser().get_doctest(text, {}, page.stem, None, 0)
    assert example.examples
    outcome = doctest.DocTestRunner(verbose=False).run(example)
    assert outcome.failed == 0


def test_no_page_describes_a_field_by_its_number(documents):
    assert [
        path.name
        for path, page in documents.items()
        if "Alias for field number" in page.text_content()
    ] == []
