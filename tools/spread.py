"""How far every claim's value moves from machine to machine, beside its tolerance.

Runs each chapter as it is, under every variant of ``machines``, and with inputs nudged by one unit
in the last place. A claim fails when its verdict changes, or when its tolerance is below three
times the spread; a cell fails when its printed text changes between variants.
"""

import argparse
import json
import math
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

from machines import Variant, variants

from navfilters.book import claims
from navfilters.book.claims.verdicts import numbers

ROOT = Path(__file__).resolve().parent.parent
STORED = ROOT / "book" / "spread.json"
MARGIN = 3.0


def allowed(claim: claims.Claim) -> list[float]:
    """How far each number of ``ours`` may move."""
    rule = claim.tolerance or {}
    return [rule.get("abs", 0.0) + rule.get("rel", 0.0) * abs(x) for x in numbers(claim.ours)]


def faults(claim: claims.Claim, spread: list[float], verdicts: list[str]) -> list[str]:
    """What is wrong with a claim, given how far its numbers moved and which verdicts they gave."""
    wrong = [f"verdict {v!r}" for v in verdicts if v != claim.verdict]
    limits = allowed(claim)
    if len(limits) != len(spread):
        return [*wrong, f"{len(spread)} numbers, the ledger has {len(limits)}"]
    for limit, moved in zip(limits, spread, strict=True):
        if not MARGIN * moved <= limit:
            wrong.append(f"tolerance {limit:.3g}, spread {moved:.3g}")
            break
    return wrong


def upwards(x: float) -> float:
    """Two digits, rounded up."""
    if not x or not math.isfinite(x):
        return x
    unit = 10.0 ** (math.floor(math.log10(abs(x))) - 1)
    return float(f"{math.ceil(x / unit * (1 - 1e-12)) * unit:.2g}")


def spread_of(base: list[float], others: list[list[float]]) -> list[float]:
    """Largest difference of each number from its value on the machine as it is."""
    columns = zip(base, *others, strict=True)
    return [upwards(max((abs(x - b) for x in rest), default=0.0)) for b, *rest in columns]


def run(path: Path, variant: Variant, seed: int | None, folder: Path) -> dict[str, Any]:
    """One chapter in a process of its own; an empty result says why in ``failed``."""
    out = folder / f"{path.stem}-{variant.name}-{seed}.json".replace(" ", "-")
    command = [
        sys.executable,
        str(Path(__file__).parent / "chapter_values.py"),
        str(path),
        str(out),
    ]
    command += [] if seed is None else ["--seed", str(seed)]
    started = perf_counter()
    done = subprocess.run(
        command, capture_output=True, text=True, env=os.environ | variant.environment
    )
    what = variant.name if seed is None else f"seed {seed}"
    sys.stderr.write(f"{perf_counter() - started:6.1f} s  {path.stem}, {what}\n")
    if done.returncode:
        return {"claims": {}, "printed": {}, "failed": f"{what}: {done.stderr[-1500:]}"}
    return json.loads(out.read_text(encoding="utf-8"))


def measure(path: Path, used: list[Variant], seeds: int, pool: ThreadPoolExecutor) -> dict:
    """Spread and verdicts of each claim of a chapter, and the cells whose text is not the same."""
    with TemporaryDirectory() as folder:
        jobs = [(v, None) for v in used] + [(used[0], seed) for seed in range(seeds)]
        base, *others = pool.map(lambda job: run(path, *job, Path(folder)), jobs)
    failed = [found["failed"] for found in (base, *others) if "failed" in found]
    if failed:
        return {"claims": {}, "printed": {}, "failed": failed}
    found = {}
    for name, note in base["claims"].items():
        again = [other["claims"][name] for other in others]
        found[name] = {
            "base": note["value"],
            "spread": spread_of(note["value"], [o["value"] for o in again]),
            "verdicts": sorted({note["verdict"], *(o["verdict"] for o in again)}),
        }
    moved = {}
    for variant, other in zip(used[1:], others, strict=False):
        for cell, text in other["printed"].items():
            if text != base["printed"][cell]:
                moved.setdefault(
                    cell, f"{variant.name}: {_difference(base['printed'][cell], text)}"
                )
    return {"claims": found, "printed": moved}


def _difference(old: str, new: str) -> str:
    lines = [(a, b) for a, b in zip(old.splitlines(), new.splitlines(), strict=False) if a != b]
    return " -> ".join(lines[0]) if lines else "another number of lines"


def report(chapter: str, found: dict, ledger: dict[str, claims.Claim]) -> int:
    """Print one line a claim; return how many things failed."""
    bad = 0
    for text in found.get("failed", ()):
        sys.stdout.write(f"STOPS   {chapter}, {text}\n")
        bad += 1
    for name, entry in found["claims"].items():
        wrong = faults(ledger[name], entry["spread"], entry["verdicts"])
        bad += bool(wrong)
        numbers_ = max(entry["spread"], default=0.0), min(allowed(ledger[name]), default=0.0)
        sys.stdout.write(
            f"{'FAILS' if wrong else 'holds'}   {name}: spread {numbers_[0]:.2g}, "
            f"tolerance {numbers_[1]:.2g}{'; ' if wrong else ''}{'; '.join(wrong)}\n"
        )
    for cell, text in found["printed"].items():
        sys.stdout.write(f"PRINTS  {chapter}, cell {cell}, {text}\n")
        bad += 1
    sys.stdout.flush()
    return bad


def main() -> None:
    """Measure the named chapters, or all; store the spreads that the tests hold tolerances to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("notebooks", nargs="*", type=Path, help="all where none is named")
    parser.add_argument("--seeds", type=int, default=20, help="how many changes of the last bits")
    parser.add_argument(
        "--store", action="store_true", help="write the spreads to book/spread.json"
    )
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    used = [v for v in variants() if not v.skipped]
    for variant in variants():
        if variant.skipped:
            sys.stdout.write(f"skipped {variant.name}: {variant.skipped}\n")
    chapters = sorted(
        {claim.chapter for claim in claims.load(ROOT / "book" / "claims.toml").values()}
    )
    paths = [p.resolve() for p in arguments.notebooks]
    paths = paths or [ROOT / "book" / f"{chapter}.ipynb" for chapter in chapters]
    os.chdir(ROOT)
    ledger, bad = claims.load(), 0
    stored = json.loads(STORED.read_text(encoding="utf-8")) if STORED.is_file() else {}
    with ThreadPoolExecutor(arguments.jobs) as pool:
        for path in paths:
            chapter = path.relative_to(ROOT / "book").with_suffix("").as_posix()
            found = measure(path, used, arguments.seeds, pool)
            bad += report(chapter, found, ledger)
            if not found.get("failed"):
                names = [variant.name for variant in used]
                how = {"seeds": arguments.seeds, "variants": names}
                stored[chapter] = how | {"claims": found["claims"]}
            if arguments.store:
                STORED.write_text(json.dumps(stored, indent=1, sort_keys=True) + "\n", "utf-8")
    sys.stdout.write(f"{len(paths)} chapters, {bad} faults\n")
    sys.exit(bool(bad))


if __name__ == "__main__":
    main()
