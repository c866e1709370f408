"""The mutation tool on planted code: which edits it makes, and which of them tests see."""

import ast
from copy import copy
from dataclasses import asdict

import mutant_order
import pytest
from mutant_order import Suite, measure, statement, tiers
from mutant_sites import Mutant, Sites, sample
from mutants import drawn_before, explained, failing, first_failure, seen, store, summary

PLANTED = '''"""Text 1 + 1."""


def larger(a, b):
    """The sum of what is positive."""
    if a > 0 and not b < 0:
        return a + 2 * b
    return max(a, b)
'''
UNSEEN = "def unseen(a):\n    return a - 1.5\n"
TESTS = """from navfilters.small.planted import larger


def test_it():
    assert larger(1, 2) == 5
"""
ELSE = """import time

import pytest
from navfilters.small.planted import larger


def test_bad():
    assert larger(1, 2) == 0


def test_other():
    pass


@pytest.mark.parametrize("b", [2], ids=["of - two"])
def test_larger(b):
    time.sleep(0.1)
    assert larger(-1, b) == 2
"""
FIXTURE = """import pytest
from navfilters.small.planted import larger


@pytest.fixture(scope="module")
def found():
    return larger(1, 2)


def test_one(found):
    pass


def test_two(found):
    pass
"""


def plant(root):
    library, tests = root / "lib/navfilters", root / "tests/small"
    for folder in (library / "small", library / "oracles", tests):
        folder.mkdir(parents=True)
    for package in (library, library / "small", library / "oracles"):
        (package / "__init__.py").write_text("")
    (library / "small/planted.py").write_text(PLANTED)
    (library / "oracles/second.py").write_text(PLANTED)
    (library / "small/user.py").write_text(f"import navfilters.small.planted\n\n\n{UNSEEN}")
    (tests / "test_planted.py").write_text(TESTS)
    (root / "pyproject.toml").write_text('[tool.pytest.ini_options]\nmarkers = ["slow: "]\n')
    return root


@pytest.fixture
def tree(tmp_path):
    mutant_order.imports.cache_clear()
    return plant(tmp_path)


def measured(root, file, tests):
    (root / "tests/small" / file).write_text(tests)
    measure(root, root / "measured")
    return Suite(root / "measured")


@pytest.fixture(scope="module")
def suite(tmp_path_factory):
    """Four tests of the planted code, of which one fails."""
    return measured(plant(tmp_path_factory.mktemp("suite")), "test_else.py", ELSE)


def edits(source):
    return {(m.line, m.kind, m.old, m.new) for m in Sites(source.encode(), "x.py").found}


def test_every_edit_of_the_planted_code():
    assert edits(PLANTED) == {
        (6, "boolean", "and", "or"),
        (6, "comparison", ">", ">="),
        (6, "constant", "0", "1"),
        (6, "boolean", "not b < 0", "(b < 0)"),
        (6, "comparison", "<", "<="),
        (7, "arithmetic", "+", "-"),
        (7, "arithmetic", "*", "/"),
        (7, "constant", "2", "3"),
        (8, "swapped arguments", "a, b", "b, a"),
    }


@pytest.mark.parametrize(
    ("source", "edit"),
    [
        ("a = -b", ("sign", "-b", "(b)")),
        ("a = 2.0", ("constant", "2.0", "2.2")),
        ("a = 0.0", ("constant", "0.0", "1.0")),
        ("a = True", ("boolean", "True", "False")),
        ("a = b is not None", ("comparison", "is not", "is")),
        ("a = b not in c", ("comparison", "not in", "in")),
        ("a = b ** c", ("arithmetic", "**", "*")),
        ("a = 'σ' if b else c % d", ("arithmetic", "%", "*")),
    ],
)
def test_each_kind(source, edit):
    assert edits(source) == {(1, *edit)}


@pytest.mark.parametrize("statement", ["a.sort()", "a[b] = c", "a += b", "raise E('1 + 1')"])
def test_a_statement_is_removed(statement):
    assert edits(statement) == {(1, "removed statement", statement, "pass")}


def test_a_mutant_is_one_edit():
    source = "σ = 1\nλ = a - b\n".encode()
    (mutant,) = (m for m in Sites(source, "x.py").found if m.kind == "arithmetic")
    assert mutant.of(source) == "σ = 1\nλ = a + b\n".encode()


def test_a_sample_is_its_seeds_and_grows_at_its_end(tree):
    every = sample(tree, 1, 99)
    assert len(every) == 10 + 2  # of the nine edits above, one has two places
    assert not [m for m in every if "oracles" in m.file]
    assert sample(tree, 1, 4) == every[:4]
    assert sample(tree, 2, 99) != every
    assert {m.file for m in sample(tree, 1, 99, "user")} == {"lib/navfilters/small/user.py"}
    for mutant in every:
        ast.parse(mutant.of((tree / mutant.file).read_bytes()))


def test_a_sample_stays_when_other_lines_change(tree):
    path = tree / "lib/navfilters/small/planted.py"
    first = sample(tree, 1, 6)
    names = [mutant.name for mutant in first]
    assert len({mutant.name for mutant in sample(tree, 1, 99)}) == 12  # two places of one edit
    path.write_text("NEW = 1 + 2\n" + PLANTED)
    assert [mutant.name for mutant in sample(tree, 1, 6)] != names
    again = sample(tree, 1, 8, drawn=names)
    assert [mutant.name for mutant in again[:6]] == names
    assert [m.line for m in again[:6]] == [m.line + (m.file.endswith("planted.py")) for m in first]
    path.write_text(PLANTED.replace("max(a, b)", "a"))
    assert all("max" not in mutant.text for mutant in sample(tree, 1, 99, drawn=names))


def test_a_report_is_known_to_its_seed(tmp_path):
    path = tmp_path / "mutants.json"
    row = {**asdict(planted("+", "-")), "seen_by": "t::a", "tries": 1}
    assert drawn_before(path, 1) == {}
    store(path, summary(1, [row]))
    assert drawn_before(path, 1) == {planted("+", "-").name: row}
    assert drawn_before(path, 2) == {}


def test_tests_that_mirror_a_file_come_first(tree):
    (tree / "tests/small/test_also.py").write_text("from planted import larger, planted\n")
    (tree / "tests/test_far.py").write_text("from navfilters.small.planted import larger\n")
    (tree / "tests/test_of_else.py").write_text("")
    near, far = tiers(tree, "lib/navfilters/small/planted.py")
    assert near == ["tests/small/test_planted.py", "tests/small/test_also.py"]
    assert far == ["tests/test_far.py"]


def planted(old, new):
    start = PLANTED.index(old, PLANTED.index("if") if old != "1 + 1" else 0)
    line = PLANTED.count("\n", 0, start) + 1
    text = PLANTED.splitlines()[line - 1].strip()
    file, end = "lib/navfilters/small/planted.py", start + len(old)
    return Mutant(file, line, "", start, end, old, new, text, 0)


def test_the_tests_that_run_a_line_are_known_and_their_time(tree, suite):
    file, it = "lib/navfilters/small/planted.py", "tests/small/test_planted.py::test_it"
    slower = "tests/small/test_else.py::test_larger[of - two]"
    other = "tests/small/test_else.py::test_other"
    assert list(suite.seconds) == [other, slower, it]
    assert suite.seconds[slower] >= 0.1 > suite.seconds[it]
    assert suite.running(file, [7]) == [it]
    assert suite.running(file, [8]) == [slower]
    assert suite.running(file, [6]) == [it, slower]
    assert suite.running(file, [4]) == []
    (tree / "tests/small/test_else.py").write_text(ELSE)
    assert suite.order(tree, planted("max", "min")) == [slower, it, other]
    more = copy(suite)
    more.seconds = {"tests/test_of_all.py::test_it": 0.0, **suite.seconds}
    assert more.order(tree, planted("max", "min"))[3:] == ["tests/test_of_all.py::test_it"]


def test_all_tests_of_a_file_use_what_its_fixture_runs(tree):
    suite = measured(tree, "test_planted.py", FIXTURE)
    tests = suite.running("lib/navfilters/small/planted.py", [7])
    assert set(tests) == {f"tests/small/test_planted.py::test_{name}" for name in ("one", "two")}


@pytest.mark.parametrize(
    ("source", "line", "lines"),
    [
        ("a = 1\nb = (\n    2,\n    3,\n)\n", 3, range(2, 6)),
        ("if a:\n    b = 1\n", 1, range(1, 2)),
        ("if a:\n    b = 1\n", 2, range(2, 3)),
        ("def f(\n    a=1,\n):\n    b = 1\n", 2, range(1, 4)),
        ("for a in b: c()\n", 1, range(1, 2)),
        ("@f(\n    1,\n)\ndef g():\n    pass\n", 2, range(2, 3)),
    ],
)
def test_the_statement_of_a_line(source, line, lines):
    assert statement(source.encode(), line) == lines


@pytest.mark.parametrize(
    ("old", "new", "limit", "by"),
    [
        ("+", "-", 60, "tests/small/test_planted.py::test_it"),
        ("max", "min", 60, "tests/small/test_else.py::test_larger[of - two]"),
        ("max", "min", 0.05, ""),
        (">", ">=", 60, ""),
    ],
)
def test_what_tests_see_and_what_survives(tree, suite, old, new, limit, by):
    mutant = planted(old, new)
    (tree / "tests/small/test_else.py").write_text(ELSE)
    assert seen(tree, mutant, suite, limit)[0] == by
    assert (tree / mutant.file).read_text() == PLANTED


def test_a_pytest_that_cannot_begin_sees_nothing(tree, suite):
    (tree / "conftest.py").write_text("import nothing\n")
    with pytest.raises(SystemExit, match="cannot begin"):
        seen(tree, planted("+", "-"), suite, 60)
    assert (tree / "lib/navfilters/small/planted.py").read_text() == PLANTED


def test_files_run_where_a_test_has_lost_its_name(tree):
    file = tree / "tests/small/test_planted.py"
    names = [f"tests/small/test_planted.py::test_{name}" for name in ("it", "gone")]
    file.write_text(TESTS.replace("5", "6"))
    assert first_failure(tree, names, 60) == names[0]
    file.write_text(TESTS.replace("import larger", "import smaller"))
    assert first_failure(tree, names, 60) == "tests/small/test_planted.py"


def test_a_test_that_fails_without_a_mutant_sees_none(tree):
    (tree / "tests/small/test_else.py").write_text(ELSE)
    bad, good = "tests/small/test_else.py::test_bad", "tests/small/test_planted.py::test_it"
    assert failing(tree, {bad, good}) == {bad}


def test_what_no_test_is_meant_to_see_has_a_row(tree):
    said = "| `small/planted.py` | `return a + 2 * b` | `return a - 2 * b` | Text. |"
    assert explained(tree, planted("+", "-"), said)
    assert not explained(tree, planted("*", "/"), said)
    assert not explained(tree, planted("+", "-"), said.replace("planted", "user"))


def test_the_report_counts_apart():
    names = [("t::a", 1), ("t::b", 2), ("", 1), ("stopped", 1), ("explained", 1)]
    rows = [{"seen_by": by, "tries": tries} for by, tries in names]
    report = summary(1, [*rows, {"line": 1}])
    counts = {"seen": 2, "survived": 1, "stopped": 1, "explained": 1, "doubtful": 0}
    expected = {"seed": 1, "count": 5, "seen_at_first": 1, **counts, "per_cent_seen": 50.0}
    assert report == {**expected, "mutants": rows}
