"""The notebooks that a reader downloads from the built pages: each says first what to install.

The pages offer the sources of the book; here these get one cell in front. With the address of a
repository in ``_config.yml`` it installs the library from there; without one it says how to.
"""

import sys
from pathlib import Path

import nbformat
import yaml
from nbformat import NotebookNode

ROOT = Path(__file__).resolve().parent.parent
IDENTITY = "install"
EXTRA = "[notebooks]"
FROM_ADDRESS = """\
# What this page needs, once:
%pip install --quiet "navfilters{extra} @ git+{url}@v{version}"\
"""
FROM_FOLDER = """\
# What this page needs, once; for BOOK put the book's folder, or the wheel that `make dist` builds.
# %pip install --quiet "BOOK{extra}"
import navfilters\
"""


def address() -> str:
    """The repository's, or nothing where there is none yet."""
    settings = yaml.safe_load((ROOT / "_config.yml").read_text(encoding="utf-8"))
    return settings.get("repository", {}).get("url", "")


def version() -> str:
    """The library's, as its own file says it."""
    known: dict[str, str] = {}
    exec((ROOT / "lib/navfilters/version.py").read_text(encoding="utf-8"), known)
    return known["__version__"]


def by_itself(notebook: NotebookNode, url: str) -> NotebookNode:
    """The same notebook whose first cell installs the library, or says how; once."""
    text = FROM_ADDRESS if url else FROM_FOLDER
    cell = nbformat.v4.new_code_cell(text.format(extra=EXTRA, url=url, version=version()))
    cell.id = IDENTITY
    rest = [c for c in notebook.cells if c.id != IDENTITY]
    return NotebookNode(notebook, cells=[cell, *rest])


def main(html: Path) -> None:
    """Rewrite every notebook under ``_sources``."""
    paths = sorted((html / "_sources").rglob("*.ipynb"))
    for path in paths:
        notebook = by_itself(nbformat.read(path, as_version=4), address())
        nbformat.write(notebook, path)
    sys.stdout.write(f"{len(paths)} notebooks to download say what to install\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
