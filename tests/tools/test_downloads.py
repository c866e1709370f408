"""What a reader downloads: the notebook with one cell in front, which says what to install."""

import downloads
import nbformat
import pytest

URL = "https://example.org/us/book"


def notebook():
    cells = [nbformat.v4.new_markdown_cell("# A"), nbformat.v4.new_code_cell("1 + 1")]
    return nbformat.v4.new_notebook(cells=cells, metadata={"language_info": {"name": "python"}})


@pytest.mark.parametrize("url", ["", URL])
def test_one_cell_comes_first_and_the_rest_stays(url):
    given = notebook()
    got = downloads.by_itself(given, url)
    nbformat.validate(got)
    assert got.cells[1:] == given.cells
    assert got.metadata == given.metadata
    (line,) = [line for line in got.cells[0].source.splitlines() if "%pip install" in line]
    assert "[notebooks]" in line
    assert line.startswith("%pip") == bool(url)
    if url:
        assert f"git+{URL}@v{downloads.version()}" in line


def test_twice_is_once():
    given = notebook()
    again = downloads.by_itself(downloads.by_itself(given, ""), URL)
    assert again == downloads.by_itself(given, URL)


def test_every_notebook_of_a_site(tmp_path, capsys):
    place = tmp_path / "_sources/book/part/one.ipynb"
    place.parent.mkdir(parents=True)
    nbformat.write(notebook(), place)
    downloads.main(tmp_path)
    assert "install" in nbformat.read(place, as_version=4).cells[0].source
    assert capsys.readouterr().out == "1 notebooks to download say what to install\n"


def test_the_extra_that_it_names_exists_and_has_what_chapters_import():
    import tomllib

    text = (downloads.ROOT / "pyproject.toml").read_text(encoding="utf-8")
    extras = tomllib.loads(text)["project"]["optional-dependencies"]
    wanted = " ".join(extras[downloads.EXTRA.strip("[]")])
    own = {name for name in extras if name in wanted}
    assert {"book", "sar", "sweep", "flight"} <= own
    assert "filterpy" in wanted
