"""The commands' progress, with tqdm and without."""

import sys

import pytest

from navfilters.runs.progress import bar, progress


@pytest.fixture
def tqdm(monkeypatch):
    """Stands in for tqdm; keeps what it was told."""

    class Tqdm:
        told: list = []  # noqa: RUF012

        def __init__(self, total, **options):
            self.told.append(total)

        def __enter__(self):
            return self

        def __exit__(self, *error):
            self.told.append("closed")

        def update(self, units):
            self.told.append(units)

    class Module:
        tqdm = Tqdm

    monkeypatch.setitem(sys.modules, "tqdm", Module)
    return Tqdm.told


def test_tqdm_is_used_where_it_is_installed(tqdm):
    assert list(progress(range(3))) == [0, 1, 2]
    assert tqdm == [3, 1, 1, 1, "closed"]


def test_work_is_counted_without_it(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "tqdm", None)
    with bar(9) as done:
        done(4)
        done(5)
    assert list(progress(iter("ab"))) == ["a", "b"]
    assert capsys.readouterr().err == "\r4/9\r9/9\r\033[K\r1/2\r2/2\r\033[K"


def test_the_bar_is_closed_when_the_work_fails(tqdm):
    def work():
        for _ in progress(range(3)):
            raise KeyError

    with pytest.raises(KeyError):
        work()
    assert tqdm[0] == 3
    assert tqdm[-1] == "closed"
