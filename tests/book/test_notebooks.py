"""The stored notebooks: executed once from top to bottom, and free of what only one machine has."""

import ast
import importlib
import json
import re
from collections import defaultdict

import nbformat
import pytest
from browser import ROOT, toc

import navfilters

PATHS = sorted((ROOT / "book").rglob("*.ipynb"))
CHAPTERS = [p for p in PATHS if p.parent.name in ("foundations", "range-bearing")]
METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}
# A path of one machine, the address of an object, an instant.
LOCAL = re.compile(
    r"(?<!\w)/(home|Users|root|tmp|work|opt)/\w|\b[A-Z]:\\|\bat 0x[0-9a-f]+|\d{4}-\d\d-\d\dT\d\d:"
)


def label(path):
    return path.relative_to(ROOT / "book").with_suffix("").as_posix()


every_notebook = pytest.mark.parametrize("path", PATHS, ids=label)


def code_cells(path):
    return [c for c in nbformat.read(path, as_version=4).cells if c.cell_type == "code"]


def outputs(path):
    return [output for cell in code_cells(path) for output in cell.outputs]


def texts(path):
    """What a notebook stores besides pictures: metadata, sources, outputs."""
    notebook = nbformat.read(path, as_version=4)
    yield json.dumps(notebook.metadata)
    for cell in notebook.cells:
        yield from (json.dumps(cell.metadata), cell.source)
        for output in cell.get("outputs", ()):
            yield from (json.dumps(output.get("metadata", {})), output.get("text", ""))
            data = output.get("data", {})
            yield from (data[kind] for kind in data if kind.startswith("text/"))


def test_the_table_of_contents_lists_every_notebook_and_every_page_exists():
    listed = {name for name in toc() if (ROOT / f"{name}.ipynb").is_file()}
    assert listed == {f"book/{label(path)}" for path in PATHS}
    assert len(toc()) == len(set(toc()))
    assert [n for n in toc() if n not in listed and not (ROOT / f"{n}.md").is_file()] == []


@every_notebook
def test_it_is_valid_with_cells_of_unique_ids(path):
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    ids = [cell.id for cell in notebook.cells]
    assert len(ids) == len(set(ids))


@every_notebook
def test_it_was_executed_once_from_top_to_bottom(path):
    counts = [cell.execution_count for cell in code_cells(path) if cell.source.strip()]
    assert counts == list(range(1, len(counts) + 1))


@every_notebook
def test_it_stores_neither_errors_nor_warnings(path):
    bad = [o for o in outputs(path) if o.output_type == "error" or o.get("name") == "stderr"]
    assert bad == []


@every_notebook
def test_it_stores_nothing_of_the_machine_that_ran_it(path):
    notebook = nbformat.read(path, as_version=4)
    assert notebook.metadata == METADATA
    assert [c.id for c in notebook.cells if {"execution", "ExecuteTime"} & set(c.metadata)] == []
    assert [m.group() for text in texts(path) for m in LOCAL.finditer(text)] == []


@every_notebook
def test_it_is_small(path):
    assert path.stat().st_size < 1.5 * 2**20
    assert [c.id for c in code_cells(path) if len(c.source.splitlines()) > 40] == []


@pytest.mark.parametrize("path", CHAPTERS, ids=label)
def test_it_ends_with_exercises_and_their_hidden_solutions(path):
    section, solutions = "", 0
    for cell in nbformat.read(path, as_version=4).cells:
        headings = (
            re.findall(r"^## (.+)$", cell.source, re.M) if cell.cell_type == "markdown" else []
        )
        if headings:
            section, solutions = headings[-1], 0
        solutions += cell.cell_type == "code" and "hide-cell" in cell.metadata.get("tags", ())
    assert section.startswith("Exercises")
    assert solutions >= 2


# --- as programs --------------------------------------------------------------------------------


def syntax(path):
    """A chapter's code, one tree a cell."""
    return [ast.parse(cell.source) for cell in code_cells(path)]


def bound(path):
    """Every name that a chapter binds by itself, also as an argument or inside of a function."""
    for node in (node for tree in syntax(path) for node in ast.walk(tree)):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.arg):
            yield node.arg


def imported(path):
    """Modules of the library from which a chapter imports names, and the names."""
    for node in (node for tree in syntax(path) for node in ast.walk(tree)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("navfilters"):
            yield node.module, [alias.name for alias in node.names]
        elif isinstance(node, ast.Import):
            yield from ((alias.name, []) for alias in node.names if "navfilters" in alias.name)


@every_notebook
def test_it_has_few_cells_that_show_something(path):
    shown = [cell for cell in code_cells(path) if cell.outputs]
    assert len(shown) <= 24


def test_no_function_is_defined_in_two_chapters():
    where = defaultdict(set)
    for path in PATHS:
        for node in (node for tree in syntax(path) for node in tree.body):
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                where[node.name].add(label(path))
    assert {name for name, pages in where.items() if len(pages) > 1} == set()


@every_notebook
def test_it_binds_no_name_of_the_library(path):
    """Neither of the package itself, nor of those from which the chapter imports names."""
    taken = set(navfilters.__all__)
    for module, _ in imported(path):
        if module != "navfilters.book":  # plotting and claims, which keep their names to themselves
            taken |= set(getattr(importlib.import_module(module), "__all__", ()))
    assert {(label(path), name) for name in bound(path) if name in taken} == set()


@every_notebook
def test_it_imports_from_packages_only(path):
    """A page shows the public names and not where they are kept."""
    for module, names in imported(path):
        package = hasattr(importlib.import_module(module), "__path__")
        assert package, (module, names)


@every_notebook
def test_a_cell_with_a_caption_shows_its_figure_alone(path):
    """A caption names each output of its cell, and a name is given once."""
    captioned = [c for c in code_cells(path) if "figure" in c.metadata.get("mystnb", {})]
    shown = [[o for o in c.outputs if o.output_type != "stream"] for c in captioned]
    assert [c.id for c, found in zip(captioned, shown, strict=True) if len(found) != 1] == []


@every_notebook
def test_solutions_are_folded_in_code_and_in_words(path):
    """From the exercises on a reader sees questions only."""
    cells = nbformat.read(path, as_version=4).cells
    begins = [i for i, c in enumerate(cells) if "## Exercises" in c.source]
    for cell in cells[begins[0] + 1 :] if begins else ():
        if cell.cell_type == "code":
            assert "hide-cell" in cell.metadata.get("tags", [])
            continue
        seen = re.sub(r":::\{dropdown\} The answer\n.*?\n:::", "", cell.source, flags=re.DOTALL)
        assert all(re.match(r"\d+\. ", part) for part in seen.strip().split("\n\n") if part)


@every_notebook
def test_a_page_does_not_open_with_its_imports(path):
    first = code_cells(path)[0]
    if first.source.startswith(("import ", "from ")):
        assert {"hide-input", "remove-input"} & set(first.metadata.get("tags", []))
