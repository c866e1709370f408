"""The book is built again when a file changed, and only then."""

import serve


def site(tmp_path):
    (tmp_path / "book").mkdir()
    (tmp_path / "lib").mkdir()
    for name in ("_config.yml", "_toc.yml", "book/page.md"):
        (tmp_path / name).write_text("one")
    return tmp_path


def rounds(root, changes, monkeypatch):
    """How often it was built, with one change after each look."""
    built, left = [], iter(changes)
    monkeypatch.setattr(serve.time, "sleep", lambda _: next(left)())
    serve.watch(root, lambda: built.append(1), pause=0, rounds=len(changes))
    return len(built)


def nothing():
    pass


def test_it_builds_at_first_and_after_each_change(tmp_path, monkeypatch):
    root = site(tmp_path)
    new = root / "lib/module.py"
    changes = [
        nothing,
        lambda: (root / "book/page.md").write_text("longer"),
        nothing,
        lambda: new.write_text("x"),
        new.unlink,
        nothing,
    ]
    old = {path: stamp - 1 for path, stamp in serve.stamps(root).items()}  # clocks are coarse
    assert serve.stamps(root) != old
    assert rounds(root, changes, monkeypatch) == 4


def test_what_a_build_makes_does_not_start_one(tmp_path, monkeypatch):
    root = site(tmp_path)
    made = root / "lib/__pycache__/module.pyc"
    made.parent.mkdir()
    changes = [lambda: made.write_text("x"), nothing, lambda: made.write_text("longer"), nothing]
    assert rounds(root, changes, monkeypatch) == 1
