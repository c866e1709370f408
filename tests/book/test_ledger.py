"""The ledger is complete both ways: each claim is checked once, where it says, and shown there."""

import ast
import json
import re
import tomllib
from collections import Counter

import nbformat
import pytest
import spread
from browser import ROOT
from IPython.core.inputtransformer2 import TransformerManager

from navfilters.book import claims
from navfilters.book.claims.verdicts import numbers

PATH = ROOT / "book" / "claims.toml"
ENTRIES = tomllib.loads(PATH.read_text(encoding="utf-8"))["claim"]
LEDGER = claims.load(PATH)
SPREADS = json.loads(spread.STORED.read_text(encoding="utf-8"))
PLACE = re.compile(r"\b(sections?|Eqs?\.|Figs?\.|Tables?|appendix|Lemma)\s*\(?[IVXLC\dA-Z]", re.I)


def chapters():
    """Every notebook's code cells, by its name in the ledger."""
    for path in sorted((ROOT / "book").rglob("*.ipynb")):
        cells = nbformat.read(path, as_version=4).cells
        name = path.relative_to(ROOT / "book").with_suffix("").as_posix()
        yield name, [cell for cell in cells if cell.cell_type == "code"]


def parsed(cell):
    """Plain Python, or Python beside IPython's magics."""
    return ast.parse(TransformerManager().transform_cell(cell.source))


def check_calls(tree):
    """Calls of anything named check."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and ast.unparse(node.func).rpartition(".")[2] == "check":
            yield node


CELLS = dict(chapters())
TREES = {name: [parsed(cell) for cell in cells] for name, cells in CELLS.items()}
CALLS = [(name, call) for name, trees in TREES.items() for t in trees for call in check_calls(t)]
SHOWN = {
    name: "".join(o.get("data", {}).get("text/html", "") for c in cells for o in c.outputs)
    for name, cells in CELLS.items()
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
    texts += [entry[key] for key in ("reason", "route", "left_open", "own_rule") if key in entry]
    texts += [old[key] for old in entry.get("revised", ()) for key in ("was", "why")]
    assert [text for text in texts if not text.strip()] == []


@every_claim
def test_its_source_is_in_the_bibliography_and_names_a_place(claim):
    work, _, place = claim.source.partition(",")
    if work != "this book":
        assert f"{{{work}," in (ROOT / "book" / "references.bib").read_text(encoding="utf-8")
        assert PLACE.search(place)


# --- rules that cannot be bent ------------------------------------------------------------------


def bindings(tree):
    """What each name of a notebook was made from: every expression that it was given."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            yield node.name, node
        targets = getattr(node, "targets", [getattr(node, "target", None)])
        if isinstance(node, ast.Assign | ast.AugAssign | ast.AnnAssign | ast.For):
            value = node.iter if isinstance(node, ast.For) else node.value
            for name in {n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name)}:
                yield name, value or node


def built_by(kind):
    """Claims whose check hands over a ``Readings``, ``Parts`` or ``Some``, by whatever name."""
    found = set()
    for trees in TREES.values():
        given = [(name, mentioned(node)) for tree in trees for name, node in bindings(tree)]
        making, before = {kind}, set()
        while making != before:
            before = set(making)
            making |= {name for name, parts in given if parts & making}
        for call in (call for tree in trees for call in check_calls(tree)):
            if any(mentioned(argument) & making for argument in call.args[1:]):
                found.add(call.args[0].value)
    return found


def mentioned(node):
    """Every name and attribute in an expression."""
    names = {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
    return names | {n.attr for n in ast.walk(node) if isinstance(n, ast.Attribute)}


def test_nothing_is_left_to_be_said():
    assert "TODO" not in PATH.read_text(encoding="utf-8")


@pytest.mark.parametrize(("kind", "field"), [("Readings", "left_open"), ("Some", "quantifier")])
def test_only_what_the_text_leaves_open_has_readings_and_only_what_can_be_has_some(kind, field):
    said = {name for name, claim in LEDGER.items() if getattr(claim, field)}
    assert said <= built_by(kind)


def test_a_printed_number_is_in_shape_within_one_factor_everywhere():
    rules = {
        tuple(claim.shape_rule.items())
        for claim in LEDGER.values()
        if claim.kind == "value" and claim.threshold == "printed" and not claim.own_rule
        if claim.shape_rule
    }
    assert rules <= {(("factor", 2),)}


def test_every_word_of_degree_has_users_and_one_rule():
    words = claims.load_words(PATH)
    used = Counter(claim.word for claim in LEDGER.values() if claim.word)
    assert set(used) == set(words)
    for name, word in words.items():
        same = [c for c in LEDGER.values() if c.word == name and not c.own_rule]
        rules = {repr(c.reproduced_within if c.kind == "value" else c.paper_value) for c in same}
        assert rules - {"True"} <= {repr(word.rule)}


# --- as fine as its arithmetic ------------------------------------------------------------------


@every_claim
def test_its_tolerance_is_three_times_what_last_bits_move(claim):
    measured = SPREADS.get(claim.chapter, {"claims": {}})["claims"].get(claim.id)
    assert measured, f"no spread of {claim.id}: run `make spread`"
    assert spread.faults(claim, measured["spread"], measured["verdicts"]) == []


@every_claim
def test_its_spread_was_measured_around_todays_value(claim):
    base = SPREADS[claim.chapter]["claims"][claim.id]["base"]
    recorded = numbers(claim.ours)
    assert len(base) == len(recorded)
    for found, ours, limit in zip(base, recorded, spread.allowed(claim), strict=True):
        assert abs(found - ours) <= limit
