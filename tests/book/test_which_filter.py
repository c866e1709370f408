"""The page for the engineer with ten minutes: each of its lines leads to what it rests on."""

import re

import nbformat
import pytest
from browser import ROOT

from navfilters.book import claims

PAGE = (ROOT / "book/beyond/which-filter.md").read_text(encoding="utf-8")
TABLE = "every-cure"
LINES = [line for line in PAGE.splitlines() if line.startswith(("- ", "<a "))]
LINK = re.compile(r'<a href="([\w-]+)\.html#([\w-]+)">[^<]+</a>')


def targets():
    """What the chapter of the table shows: rows, claims and figures."""
    notebook = nbformat.read(ROOT / f"book/beyond/{TABLE}.ipynb", as_version=4)
    shown = [
        "".join(output.data.get("text/html", ""))
        for cell in notebook.cells
        for output in cell.get("outputs", ())
        if "data" in output
    ]
    figures = [
        c.metadata["mystnb"]["figure"]["name"]
        for c in notebook.cells
        if "mystnb" in c.metadata and "figure" in c.metadata["mystnb"]
    ]
    return {*re.findall(r'id="([\w-]+)"', "".join(shown)), *figures}


def test_it_is_short():
    assert len(PAGE.split()) < 600
    assert len(LINES) > 15


@pytest.mark.parametrize("line", LINES)
def test_every_line_leads_somewhere(line):
    assert LINK.search(line)


def test_nothing_is_said_between_the_lines():
    rest = [x for x in PAGE.splitlines() if x and x not in LINES]
    assert all(x.startswith(("# ", "**")) and x.endswith(("**", "when")) for x in rest)


def test_every_link_resolves():
    there = targets()
    for page, target in LINK.findall(PAGE):
        assert page == TABLE
        assert target in there, target


def test_findings_are_in_the_ledger_under_the_table():
    for _, target in LINK.findall(PAGE):
        if target.startswith("claim-"):
            assert claims.load()[target.removeprefix("claim-")].chapter == f"beyond/{TABLE}"
