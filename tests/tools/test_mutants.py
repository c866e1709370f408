"""The mutation tool on planted code: which edits it makes, and which of them tests see."""

import ast

import mutants
import pytest
from mutants import Mutant, Sites, sample, seen, tiers

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


@pytest.fixture
def tree(tmp_path):
    library, tests = tmp_path / "lib/navfilters", tmp_path / "tests/small"
    for folder in (library / "small", library / "oracles", tests):
        folder.mkdir(parents=True)
    for package in (library, library / "small", library / "oracles"):
        (package / "__init__.py").write_text("")
    (library / "small/planted.py").write_text(PLANTED)
    (library / "oracles/second.py").write_text(PLANTED)
    (library / "small/user.py").write_text(f"import navfilters.small.planted\n\n\n{UNSEEN}")
    (tests / "test_planted.py").write_text(TESTS)
    mutants.imports.cache_clear()
    return tmp_path


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


def test_tests_that_mirror_a_file_come_first(tree):
    (tree / "tests/small/test_also.py").write_text("from planted import larger, planted\n")
    (tree / "tests/test_far.py").write_text("from navfilters.small.planted import larger\n")
    (tree / "tests/test_of_else.py").write_text("")
    near, far = tiers(tree, "lib/navfilters/small/planted.py")
    assert near == ["tests/small/test_planted.py", "tests/small/test_also.py"]
    assert far == ["tests/test_far.py"]


@pytest.mark.parametrize(
    ("old", "new", "by"),
    [("+", "-", "tests/small/test_planted.py::test_it"), (">", ">=", "")],
)
def test_what_tests_see_and_what_survives(tree, old, new, by):
    (tree / "pyproject.toml").write_text('[tool.pytest.ini_options]\nmarkers = ["slow: "]\n')
    start = PLANTED.index(old, PLANTED.index("if"))
    mutant = Mutant("lib/navfilters/small/planted.py", 0, "", start, start + 1, old, new)
    assert seen(tree, mutant, 60)[0] == by
    assert (tree / mutant.file).read_text() == PLANTED
