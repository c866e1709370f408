"""A kept notebook is used only while nothing that it depends on has changed."""

import executed
import pytest


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A project of two notebooks and a library."""
    monkeypatch.setattr(executed, "ROOT", tmp_path)
    monkeypatch.setattr(executed, "KEPT", tmp_path / "_build" / "executed")
    for name in ("book/a.ipynb", "book/part/b.ipynb", "lib/one.py", "book/claims.toml"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(name)
    return tmp_path


def keep(notebook):
    executed.place(notebook).parent.mkdir(parents=True, exist_ok=True)
    executed.place(notebook).write_text("executed")


def test_what_was_kept_is_found_and_the_rest_is_not(project):
    executed.begin()
    keep(project / "book/part/b.ipynb")
    assert executed.kept(project / "book/part/b.ipynb").read_text() == "executed"
    assert executed.kept(project / "book/a.ipynb") is None


@pytest.mark.parametrize("name", ["book/a.ipynb", "lib/one.py", "book/claims.toml", "lib/two.py"])
def test_a_change_of_anything_makes_it_worthless(project, name):
    executed.begin()
    keep(project / "book/a.ipynb")
    (project / name).write_text("changed")
    assert executed.kept(project / "book/a.ipynb") is None


def test_beginning_anew_forgets(project):
    executed.begin()
    keep(project / "book/a.ipynb")
    executed.begin()
    assert executed.kept(project / "book/a.ipynb") is None
