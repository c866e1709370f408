"""Notebooks that the build executes itself."""

import execute_notebooks
import jupyter_cache.executors.basic as basic
import nbformat
import pytest
from jupyter_cache.executors.utils import single_nb_execution

CELL = "print(6 * 7)"
FAULT = "raise ValueError('of the notebook')"


@pytest.fixture
def book(tmp_path, monkeypatch):
    """A book of two notebooks, nothing kept of them, and one process that executes."""
    (tmp_path / "book").mkdir()
    monkeypatch.setattr(execute_notebooks, "ROOT", tmp_path)
    monkeypatch.setattr(execute_notebooks, "CACHE", tmp_path / "cache")
    monkeypatch.setattr(execute_notebooks.executed, "kept", lambda path: None)
    load = execute_notebooks.load_executor
    monkeypatch.setattr(
        execute_notebooks, "load_executor", lambda name, cache: load("local-serial", cache)
    )

    def write(**cells):
        for name, cell in cells.items():
            notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell)])
            nbformat.write(notebook, tmp_path / "book" / f"{name}.ipynb")

    return write


def run(capsys):
    with pytest.raises(SystemExit) as end:
        execute_notebooks.main()
    told = capsys.readouterr()
    return end.value.code, told.out, told.err


@pytest.mark.slow
def test_a_kernel_that_did_not_start_has_a_second_try(book, monkeypatch, capsys):
    book(one=CELL, other=CELL + " ")
    failing = ["other.ipynb"]

    def execute(nb, **options):
        if failing and nb.cells[0].source.endswith(" "):
            failing.pop()
            raise RuntimeError("Kernel didn't respond in 60 seconds")
        return single_nb_execution(nb, **options)

    monkeypatch.setattr(basic, "single_nb_execution", execute)
    code, out, _ = run(capsys)
    assert (code, failing) == (0, [])
    assert "2 notebooks executed, 0 failed" in out


@pytest.mark.slow
def test_a_cell_that_fails_has_none(book, monkeypatch, capsys):
    book(one=CELL, other=FAULT)
    tried = []

    def execute(nb, **options):
        tried.append(nb.cells[0].source)
        return single_nb_execution(nb, **options)

    monkeypatch.setattr(basic, "single_nb_execution", execute)
    code, out, err = run(capsys)
    assert code == 1
    assert sorted(tried) == sorted([CELL, FAULT])
    assert "1 notebooks executed, 1 failed" in out
    assert "of the notebook" in err
