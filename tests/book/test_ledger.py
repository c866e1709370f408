"""The ledger is complete both ways: each claim is checked once, where it says, and shown there."""

import ast
import re
import tomllib
from collections import Counter

import nbformat
import pytest
from browser import ROOT
from IPython.core.inputtransformer2 import TransformerManager

from navfilters import claims

PATH = ROOT / "book" / "claims.toml"
ENTRIES = tomllib.loads(PATH.read_text(encoding="utf-8"))["claim"]
LEDGER = claims.load(PATH)
PLACE = re.compile(r"\b(sections?|Eqs?\.|Figs?\.|Tables?|appendix)\s*\(?[IVXLC\dA-Z]", re.I)


def chapters():
    """Every notebook's code cells, by its name in the ledger."""
    for path in sorted((ROOT / "book").rglob("*.ipynb")):
        cells = nbformat.read(path, as_version=4).cells
        name = path.relative_to(ROOT / "book").with_suffix("").as_posix()
        yield name, [cell for cell in cells if cell.cell_type == "code"]


def check_calls(source):
    """Calls of anything named check, in plain Python or beside IPython's magics."""
    for node in ast.walk(ast.parse(TransformerManager().transform_cell(source))):
        if isinstance(node, ast.Call) and ast.unparse(node.func).rpartition(".")[2] == "check":
            yield node


CALLS = [
    (name, call) for name, cells in chapters() for c in cells for call in check_calls(c.source)
]
SHOWN = {
    name: "".join(o.get("data", {}).get("text/html", "") for c in cells for o in c.outputs)
    for name, cells in chapters()
}
every_claim = pytest.mark.parametrize("claim", LEDGER.values(), ids=lambda claim: claim.id)


def test_every_check_names_its_claim_literally():
    odd = [
        f"{name}: {ast.unparse(call)}"
        for name, call in CALLS
        if ast.unparse(call.func) != "claims.check"
        or not call.args
        or not isinstance(call.args[0], ast.Constant)
    ]
    assert odd == []


def test_every_claim_is_checked_once_in_its_chapter_and_no_other_is():
    checked = Counter((name, ast.unparse(call.args[0]).strip("'")) for name, call in CALLS)
    assert checked == Counter((claim.chapter, claim.id) for claim in LEDGER.values())


@every_claim
def test_its_badge_stands_in_the_stored_outputs(claim):
    assert SHOWN.get(claim.chapter, "").count(claims.Badge(claim)._repr_html_()) == 1


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry["id"])
def test_it_is_written_out(entry):
    texts = [entry[key] for key in ("id", "chapter", "source", "statement", "verdict")]
    if "reason" in entry or entry["verdict"] != claims.REPRODUCED:
        texts.append(entry["reason"])
    assert [text for text in texts if not text.strip()] == []


@every_claim
def test_its_source_is_in_the_bibliography_and_names_a_place(claim):
    work, _, place = claim.source.partition(",")
    if work != "this book":
        assert f"{{{work}," in (ROOT / "book" / "references.bib").read_text(encoding="utf-8")
        assert PLACE.search(place)
