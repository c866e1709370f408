"""The book in a browser, built again when a page or the library changes: ``make serve``."""

import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WATCHED = ("book", "lib", "_config.yml", "_toc.yml")
MADE = ("__pycache__", "thumbnails", ".ipynb_checkpoints")
PORT = 8000


def watched(root: Path) -> Iterator[Path]:
    """Every file whose change changes a page."""
    for name in WATCHED:
        place = root / name
        yield from (place,) if place.is_file() else place.rglob("*")


def stamps(root: Path) -> dict[Path, int]:
    """When each of these files was last written."""
    found = {}
    for path in watched(root):
        if path.is_file() and not set(MADE) & set(path.parts):
            found[path] = path.stat().st_mtime_ns
    return found


def watch(root: Path, build: Callable[[], object], pause: float, rounds: int | None = None) -> None:
    """Build whenever a file was changed, added or removed, until Ctrl-C.

    Parameters
    ----------
    root : path
    build : callable
    pause : float
        Seconds between two looks.
    rounds : int, optional
        How many looks; no end by default.
    """
    seen: dict[Path, int] = {}
    while rounds is None or rounds > 0:
        now = stamps(root)
        if now != seen:
            build()
            seen = now
        time.sleep(pause)
        rounds = None if rounds is None else rounds - 1


def build() -> None:
    """``make book``, which says what is wrong."""
    subprocess.run(["make", "--silent", "book", f"PYTHON={sys.executable}"], cwd=ROOT, check=False)


def main() -> None:
    """Serve this machine alone, and watch."""
    pages = ROOT / "_build" / "html"
    handler = partial(SimpleHTTPRequestHandler, directory=str(pages))
    with ThreadingHTTPServer(("127.0.0.1", PORT), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        sys.stdout.write(f"http://localhost:{PORT}/index.html, until Ctrl-C\n")
        try:
            watch(ROOT, build, pause=1.0)
        except KeyboardInterrupt:
            server.shutdown()


if __name__ == "__main__":
    main()
