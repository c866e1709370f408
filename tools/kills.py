"""Sweeps and campaigns killed at random instants and resumed: do they end with the same bytes?

An instant is a seeded share of the time that an undisturbed run takes. There the process is killed
(SIGKILL); what it left is counted, and the same call goes on to the end. Then every file in the
folder is compared with that of the undisturbed run. The campaign's images are small ones.
"""

import argparse
import json
import os
import platform
import random
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import contextmanager
from datetime import date
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
STORED = ROOT / "benchmarks" / "kills.json"
CHUNKS = 300
sys.path.insert(0, str(ROOT / "tests" / "helpers"))

from small_images import SMALL  # noqa: E402

from navfilters import FILTERS, Gaussian, sweep  # noqa: E402
from navfilters.papers.perea2007 import Setup  # noqa: E402
from navfilters.papers.pogorelsky2020 import run_campaign  # noqa: E402
from navfilters.runs import stored_arrays  # noqa: E402
from navfilters.runs.locked_folder import LOCK  # noqa: E402


@contextmanager
def quiet(total):
    yield lambda done: None


def swept(folder: Path, workers: int = 1) -> None:
    """A sweep of as many chunks, each in a file, and its result in one more."""
    setup = Setup()
    start = np.random.default_rng(0).normal(setup.x0, 10.0, (CHUNKS, 2))
    options = {"chunk": 1, "progress": False, "workers": workers, "checkpoint": folder}
    priors = Gaussian(start, setup.prior.cov)
    final = sweep(FILTERS["EKF"], priors, setup.z, setup.model, 5, **options).final
    stored_arrays.write(folder / "result", final.mean.tobytes() + final.cov.tobytes())


WORK: dict[str, Callable[[Path], None]] = {
    "sweep": swept,
    "sweep with two workers": lambda folder: swept(folder, 2),
    "campaign": lambda folder: run_campaign(folder, 2, 1, imaging=SMALL, progress=quiet),
}


def contents(folder: Path) -> dict[str, bytes]:
    """All that counts; the lock is an empty file that stays."""
    return {p.name: p.read_bytes() for p in sorted(folder.iterdir()) if p.name != LOCK}


def begun(work: str, folder: Path) -> subprocess.Popen:
    """A process that has imported everything and starts to work now."""
    command = [sys.executable, __file__, "--work", work, str(folder)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE)
    process.stdout.readline()
    return process


def undisturbed(work: str, folder: Path) -> float:
    """Seconds that it takes."""
    start = time.perf_counter()
    with begun(work, folder) as process:
        start = time.perf_counter()
    if process.returncode:
        raise RuntimeError(f"{work} ended with {process.returncode} undisturbed")
    return time.perf_counter() - start


def killed(work: str, folder: Path, seconds: float) -> bool:
    """Whether the signal came before the end."""
    with begun(work, folder) as process:
        time.sleep(seconds)
        process.kill()
    return process.returncode != 0


def trial(work: str, whole: Path, folder: Path, seconds: float) -> dict:
    """One kill, and the same call again in this process."""
    before_the_end = killed(work, folder, seconds)
    left = contents(folder) if folder.exists() else {}
    WORK[work](folder)
    return {
        "killed": before_the_end,
        "files": sum(not name.endswith(".part") for name in left),
        "unfinished": sum(name.endswith(".part") for name in left),
        "same": contents(folder) == contents(whole),
    }


def study(work: str, kills: int, seed: int) -> dict:
    """So many kills at random instants. A run that ends before its instant is not counted."""
    draw = random.Random(f"{work} {seed}")
    with TemporaryDirectory() as place:
        whole = Path(place) / "whole"
        took = undisturbed(work, whole)
        rows: list[dict] = []
        while sum(row["killed"] for row in rows) < kills:
            share, folder = round(draw.random(), 3), Path(place) / str(len(rows))
            rows.append({"share": share, **trial(work, whole, folder, share * took)})
            if not rows[-1]["killed"]:
                took *= share  # the clock was another's too when it was measured
            sys.stdout.write(f"{work}, {rows[-1]}\n")
            sys.stdout.flush()
        return {"files": len(contents(whole)), "seconds": round(took, 1), "runs": rows}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kills", type=int, default=20, help="of each work")
    parser.add_argument("--store", type=Path, default=STORED)
    parser.add_argument("--work", choices=WORK, help="do this work in FOLDER, and no more")
    parser.add_argument("folder", type=Path, nargs="?", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.work:
        os.write(1, b"ready\n")
        WORK[options.work](options.folder)
        return
    report = {
        "date": f"{date.today()}",
        "seed": options.seed,
        "system": f"{platform.system()}, Python {platform.python_version()}",
        "work": {work: study(work, options.kills, options.seed) for work in WORK},
    }
    options.store.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
