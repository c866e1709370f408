"""Execute every notebook once, several at a time, for the build: it finds them in its cache."""

import sys
from pathlib import Path

from jupyter_cache import get_cache
from jupyter_cache.executors import load_executor

ROOT = Path(__file__).resolve().parent.parent
CACHE = ROOT / "_build" / ".jupyter_cache"  # where the build looks


def main() -> None:
    """Fill the cache; say which notebooks failed, and why."""
    cache = get_cache(CACHE)
    for path in sorted((ROOT / "book").rglob("*.ipynb")):
        cache.add_nb_to_project(str(path))
    done = load_executor("local-parallel", cache).run_and_cache(timeout=300)
    failed = done.excepted + done.errored
    sys.stdout.write(f"{len(done.succeeded)} notebooks executed, {len(failed)} failed\n")
    for record in cache.list_project_records():
        if record.uri in failed:
            sys.stderr.write(f"{record.uri}\n{record.traceback}\n")
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
