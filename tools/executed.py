"""Notebooks that nbval has executed, kept so that the build need not execute them again.

They are used only when nothing that they depend on has changed since: notebooks, ledger, library,
locks and the Python that ran them.
"""

import hashlib
import platform
import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
KEPT = ROOT / "_build" / "executed"
SOURCES = (
    "book/**/*.ipynb",
    "book/*.toml",
    "book/*.json",
    "lib/**/*.py",
    "requirements*.txt",
    "benchmarks/*.json",
)


def key() -> str:
    """A hash of everything that an executed notebook depends on."""
    found = hashlib.sha256(platform.python_version().encode())
    for path in sorted(p for pattern in SOURCES for p in ROOT.glob(pattern)):
        found.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    return found.hexdigest()


def place(notebook: Path) -> Path:
    """Where an executed notebook is kept."""
    return KEPT / notebook.relative_to(ROOT)


def begin() -> None:
    """Forget what was kept, and say what the next is made of."""
    shutil.rmtree(KEPT, ignore_errors=True)
    KEPT.mkdir(parents=True)
    (KEPT / "key").write_text(key(), encoding="utf-8")


def kept(notebook: Path) -> Path | None:
    """The executed notebook, or None where there is none of today's sources."""
    stamp = KEPT / "key"
    if stamp.is_file() and stamp.read_text(encoding="utf-8") == key() and place(notebook).is_file():
        return place(notebook)
    return None
