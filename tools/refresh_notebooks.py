"""Execute every notebook in place, and store nothing that a second run would change."""

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from time import perf_counter

import nbformat
from nbclient import NotebookClient

BOOK = Path(__file__).resolve().parent.parent / "book"


def refresh(path: Path) -> str:
    """Execute one notebook and store it; return a line that says how long it took."""
    notebook = nbformat.read(path, as_version=4)
    started = perf_counter()
    client = NotebookClient(
        notebook,
        timeout=300,
        kernel_name="python3",
        record_timing=False,
        coalesce_streams=True,  # where a stream breaks is a matter of timing
        resources={"metadata": {"path": str(path.parent)}},
    )
    client.execute()
    notebook.metadata = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    nbformat.write(notebook, path)
    return f"{perf_counter() - started:6.1f} s  {path.relative_to(BOOK)}"


def main(names: list[str]) -> None:
    """Refresh the named notebooks, or all of them."""
    paths = [Path(name).resolve() for name in names] or sorted(BOOK.rglob("*.ipynb"))
    with ThreadPoolExecutor(max_workers=2) as pool:
        for line in pool.map(refresh, paths):
            sys.stdout.write(line + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
