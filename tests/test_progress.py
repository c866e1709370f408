"""The commands' progress, with tqdm; without it the commands' own tests have the counter."""

import sys

from navfilters._progress import progress


def test_tqdm_is_used_where_it_is_installed(monkeypatch):
    class Tqdm:
        @staticmethod
        def tqdm(updates, leave):
            return list(updates)

    monkeypatch.setitem(sys.modules, "tqdm", Tqdm)
    assert progress(range(3)) == [0, 1, 2]
