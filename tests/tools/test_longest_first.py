"""The notebooks that start first."""

from pathlib import Path
from types import SimpleNamespace

from browser import ROOT
from longest_first import LONGEST, pytest_collection_modifyitems


def test_each_is_a_chapter():
    chapters = {path.stem for path in (ROOT / "book").rglob("*.ipynb")}
    assert set(LONGEST) <= chapters


def test_they_come_first_and_cells_keep_their_order():
    first, second, *_ = LONGEST
    names = ["architecture", second, first, first, "intro", second]
    items = [SimpleNamespace(path=Path(f"{n}.ipynb"), cell=i) for i, n in enumerate(names)]
    pytest_collection_modifyitems(items)
    assert [item.cell for item in items] == [2, 3, 1, 5, 0, 4]
