"""Fill the build's cache: notebooks that nbval has just executed, and all others executed now."""

import sys
from pathlib import Path

import executed
import nbformat
from jupyter_cache import get_cache
from jupyter_cache.cache.main import CacheBundleIn, JupyterCacheBase
from jupyter_cache.executors import load_executor

ROOT = Path(__file__).resolve().parent.parent
CACHE = ROOT / "_build" / ".jupyter_cache"  # where the build looks


def take(path: Path, cache: JupyterCacheBase) -> bool:
    """Whether the notebook was kept executed; if so it is in the cache now."""
    kept = executed.kept(path)
    if kept is None:
        return False
    notebook = nbformat.read(kept, as_version=4)
    data = {"execution_seconds": notebook.metadata.pop("seconds")}
    cache.cache_notebook_bundle(CacheBundleIn(notebook, str(path), data=data), overwrite=True)
    return True


def main() -> None:
    """Fill the cache; say which notebooks failed, and why."""
    cache = get_cache(CACHE)
    paths = sorted((ROOT / "book").rglob("*.ipynb"))
    waiting = [path for path in paths if not take(path, cache)]
    sys.stdout.write(f"{len(paths) - len(waiting)} notebooks were executed by nbval\n")
    for path in waiting:
        cache.add_nb_to_project(str(path))
    executor = load_executor("local-parallel", cache)
    done = executor.run_and_cache(timeout=300)
    ran, failed = done.succeeded, done.excepted
    if done.errored:  # before the first cell: the kernel did not start (see ``kernels``)
        done = executor.run_and_cache(filter_uris=done.errored, timeout=300)
        ran, failed = ran + done.succeeded, failed + done.excepted + done.errored
    sys.stdout.write(f"{len(ran)} notebooks executed, {len(failed)} failed\n")
    for record in cache.list_project_records():
        if record.uri in failed:
            sys.stderr.write(f"{record.uri}\n{record.traceback}\n")
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
