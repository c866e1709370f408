"""How many small faults the unit tests see: a seeded sample of mutants of the library.

Each is one edit of one file, made in a copy of the project. Started again with the same seed, it
goes on where it was, also if other lines of the library have changed.
"""

import argparse
import json
import re
import shutil
import subprocess
import sys
from collections import Counter
from dataclasses import asdict, fields
from importlib.util import cache_from_source
from itertools import accumulate
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

from mutant_order import Suite, measure, pytest
from mutant_sites import LIBRARY, Mutant, sample

ROOT = Path(__file__).resolve().parent.parent
STORED = ROOT / "benchmarks" / "mutants.json"
EXPLAINED = ROOT / "benchmarks" / "mutants.md"
MEASURED = ROOT / "_build" / "mutants"
COPIED = ("lib", "tests", "tools", "benchmarks", "book", "data")
FIRST = 40  # tests of one run of pytest; the rest are a second run
OTHERS = {
    "": "survived",
    "stopped": "stopped",
    "explained": "explained",
    "fails without a mutant": "doubtful",
}


def first_failure(root: Path, tests: list[str], seconds: float) -> str:
    """What pytest names first: ``""`` if all pass, "import" before tests, "stopped" if late."""
    (root / "chosen.txt").write_text("\n".join(tests), encoding="utf-8")
    try:
        ended = pytest(root, "-x", "-q", "@chosen.txt", seconds=seconds)
    except subprocess.TimeoutExpired:
        return "stopped"
    if ended.returncode in (0, 5):
        return ""
    files = sorted({test.partition("::")[0] for test in tests})
    if ended.returncode == 4 and files != tests:  # the mutant gives its tests other names
        return first_failure(root, files, 10 * seconds)
    named = re.search(r"^(?:FAILED|ERROR) (.+)$", ended.stdout, re.M)
    if not named:
        return "import"
    known = [test for test in tests if f"{named.group(1)} ".startswith(f"{test} ")]
    return max(known, key=len, default=named.group(1).partition(" - ")[0])


def within(suite: Suite, tests: list[str], limit: float) -> list[str]:
    """As many of the first as take no longer than a limit in seconds."""
    ends = accumulate(suite.seconds[test] for test in tests)
    return [test for test, end in zip(tests, ends, strict=True) if end <= limit]


def seen(root: Path, mutant: Mutant, suite: Suite, limit: float) -> tuple[str, float]:
    """Which test sees a mutant in a copy of the project, and after how many seconds."""
    path = root / mutant.file
    source, start, by = path.read_bytes(), perf_counter(), ""
    tests = within(suite, suite.order(root, mutant), limit)
    try:
        path.write_bytes(mutant.of(source))
        for part in (tests[:FIRST], tests[FIRST:]):
            Path(cache_from_source(str(path))).unlink(missing_ok=True)
            patience = 60 + 5 * sum(suite.seconds[test] for test in part)
            by = by or (first_failure(root, part, patience) if part else "")
    finally:
        path.write_bytes(source)
        Path(cache_from_source(str(path))).unlink(missing_ok=True)
    if by == "import" and first_failure(root, tests[:1], 60) == by:
        raise SystemExit("pytest cannot begin, with or without a mutant")
    return by, round(perf_counter() - start, 1)


def failing(root: Path, tests: set[str]) -> set[str]:
    """Those that fail in the library as it is: they see no mutant."""
    (root / "chosen.txt").write_text("\n".join(sorted(tests)), encoding="utf-8")
    said = pytest(root, "-q", "@chosen.txt").stdout
    return {test for test in tests if f"\nFAILED {test}" in said}


def explained(root: Path, mutant: Mutant, said: str) -> bool:
    """Whether the table of those that no test is meant to see has a row for a mutant."""
    source = (root / mutant.file).read_bytes()
    lines = [text.decode().splitlines()[mutant.line - 1] for text in (source, mutant.of(source))]
    row = [mutant.file.removeprefix(f"{LIBRARY}/"), *(line.strip() for line in lines)]
    return "".join(f"| `{cell}` " for cell in row) in said.replace("\\|", "|")


def summary(seed: int, rows: list[dict]) -> dict:
    """What the tests see, in per cent of all but those that none is meant to see."""
    done = [row for row in rows if "seen_by" in row]
    kinds = Counter(OTHERS.get(row["seen_by"], "seen") for row in done)
    first = sum(row["seen_by"] not in OTHERS and row["tries"] == 1 for row in done)
    score = 100 * kinds["seen"] / max(1, len(done) - kinds["explained"])
    counts = {"seed": seed, "count": len(done), "seen_at_first": first}
    counts |= {kind: kinds[kind] for kind in ("seen", *OTHERS.values())}
    return {**counts, "per_cent_seen": round(score, 1), "mutants": done}


def drawn_before(path: Path, seed: int) -> dict[tuple[str, ...], dict]:
    """Rows of the report of a seed, by their mutants' names."""
    report = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {"seed": None}
    rows = report["mutants"] if report["seed"] == seed else []
    return {Mutant(*(row[f.name] for f in fields(Mutant))).name: row for row in rows}


def store(path: Path, report: dict) -> None:
    path.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


def copied(root: Path) -> None:
    for part in COPIED:
        if (ROOT / part).is_dir():
            shutil.copytree(ROOT / part, root / part, ignore=shutil.ignore_patterns(".*"))
    for path in ROOT.glob("[!.]*.*"):
        if path.is_file():
            shutil.copy(path, root)


def measured(root: Path) -> Suite:
    """The suite as it is now: measured anew if the library or the tests have changed since."""
    kept = MEASURED / "durations.txt"
    changed = [p for part in ("lib", "tests") for p in (ROOT / part).rglob("*.py")]
    if not kept.exists() or kept.stat().st_mtime < max(p.stat().st_mtime for p in changed):
        sys.stdout.write("Measuring what each test runs: ten minutes\n")
        sys.stdout.flush()
        measure(root, MEASURED)
    return Suite(MEASURED)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--limit", type=float, default=300.0, help="seconds of tests for a mutant")
    parser.add_argument("--only", default="", help="a part of the paths to mutate")
    parser.add_argument("--again", action="store_true", help="try again what survived")
    parser.add_argument("--store", type=Path, default=STORED)
    options = parser.parse_args()
    known = drawn_before(options.store, options.seed)
    chosen = sample(ROOT, options.seed, options.count, options.only, known)
    rows = [known.get(mutant.name, {}) | asdict(mutant) for mutant in chosen]
    said = EXPLAINED.read_text(encoding="utf-8")
    with TemporaryDirectory() as folder:
        root = Path(folder)
        copied(root)
        suite = None  # measured once a mutant is tried
        for i, (mutant, row) in enumerate(zip(chosen, rows, strict=True), 1):
            by = row.get("seen_by", "explained")
            if explained(ROOT, mutant, said):
                row["seen_by"] = "explained"
            elif by == "explained" or (options.again and by in OTHERS):
                suite = suite or measured(root)
                row["tries"] = row.get("tries", 0) + 1
                row["seen_by"], row["s"] = seen(root, mutant, suite, options.limit)
                where = f"{i}  {mutant.file}:{mutant.line}  {mutant.kind}"
                sys.stdout.write(f"{where}  {row['seen_by'] or 'SURVIVED'}  {row['s']} s\n")
                sys.stdout.flush()
                store(options.store, summary(options.seed, rows))
        names = {row["seen_by"] for row in rows}
        doubtful = failing(root, {name for name in names if name.startswith("tests/")})
    for row in rows:
        if row["seen_by"] in doubtful:
            row["seen_by"] = "fails without a mutant"
    store(options.store, summary(options.seed, rows))


if __name__ == "__main__":
    main()
