"""Many damaged files for every reader of files: each is read, or refused by its name.

Inputs are known by their number: ``damage.damaged`` draws from seed, reader and number alone. A
process reads the inputs of one reader; this one watches it. What ends it or stops it is a fault as
well as a wrong error or too much memory. Stopped, the command goes on where it was by the journal
``_build/fuzz.jsonl``: a thousand is read again if what reads or damages it has changed.
"""

import argparse
import faulthandler
import hashlib
import importlib
import json
import multiprocessing
import os
import platform
import random
import sys
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import date
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock
from types import CodeType, FrameType
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
STORED = ROOT / "benchmarks" / "fuzz.json"
sys.path[:0] = [str(ROOT / "tests" / "helpers")]

import damage  # noqa: E402
import damage_steps  # noqa: E402
import readers  # noqa: E402
import valid_files  # noqa: E402

BLOCK = 1000  # inputs that are written down together
INPUTS = dict.fromkeys(readers.READERS, 145_000)
INPUTS |= {"leader": 40_000, "image": 40_000}  # which take longer
INPUTS |= {"heights": 25_000, "reference": 25_000, "parquet": 10_000}
SAMPLE = 50  # of so many inputs one has the memory of Python's objects measured
LONGEST = 10.0  # s, that one input may take, or else again: the clock is another's too
TRACED = 1000  # inputs that tell which lines are reached
MIB = 2**20
MEMORY = "/dev/shm" if Path("/dev/shm").is_dir() else None  # files on a disk take ten times as long


def damaged(name: str, valid: list[bytes], layout: str, seed: int, number: int) -> bytes:
    return damage.damaged(valid, layout, random.Random(f"{seed} {name} {number}"))


def tried(reader: readers.Reader, path: Path, number: int, most: int) -> tuple[str, str, int]:
    """What became of an input, the fault if there is one, and Python's memory beyond twice it."""
    peak = 0
    try:
        if number % SAMPLE:
            what = readers.outcome(reader, path)
        else:
            what, peak = readers.measured(reader, path)
            peak -= 2 * path.stat().st_size
    except Exception as error:
        return "fault", f"{type(error).__name__}: {error}"[:300], 0
    if peak > readers.MEMORY * MIB:
        return what, f"{peak / MIB:.1f} MiB of Python's memory", peak
    if readers.resident() - most > readers.RESIDENT * MIB:
        return what, f"the process grew by {(readers.resident() - most) / MIB:.0f} MiB", peak
    return what, "", peak


def block(name: str, seed: int, start: int, stop: int, passed: set[int], each: Any) -> dict:
    """What became of the inputs from start to stop; of those in passed that they are faults."""
    reader, path, valid, number_now, most = each
    found: dict[str, Any] = {"start": start, "stop": stop, "faults": {}}
    counts: Counter[str] = Counter(fault=len(passed))
    memory, slowest, begin = 0, 0.0, time.process_time()
    for number in range(start, stop):
        if number in passed:
            continue
        number_now.value = number
        path.write_bytes(damaged(name, valid, reader.layout, seed, number))
        before = time.process_time()
        what, fault, peak = tried(reader, path, number, most)
        slowest, memory = max(slowest, time.process_time() - before), max(memory, peak)
        if fault:
            found["faults"][str(number)] = fault
            what = "fault"
        counts[what] += 1
    found |= {what: counts[what] for what in ("read", "refused", "fault")}
    grown = (readers.resident() - most) / MIB
    seconds = time.process_time() - begin
    return found | {
        "slowest": slowest, "seconds": seconds, "memory": memory / MIB, "grown": grown,
    }  # fmt: skip


def prepared(module: str, name: str, folder: Path) -> tuple[readers.Reader, Path, list[bytes]]:
    """A reader, where it reads, and valid files, which it has read."""
    reader = importlib.import_module(module).READERS[name]
    path = folder / reader.file
    valid = reader.valid(path)
    for data in valid:
        path.write_bytes(data)
        if readers.outcome(reader, path) != "read":
            raise ValueError(f"a valid file of {name} is refused")
    return reader, path, valid


def quiet(file: str | Path) -> None:
    """What libraries say of damage goes into a file; rasterio cannot decode all that GDAL says."""
    os.dup2(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND), 2)
    sys.unraisablehook = lambda _: None


def child(module: str, name: str, seed: int, blocks: list, folder: str, now: Any, to: Any) -> None:
    """Blocks of one reader, in a process of their own."""
    quiet(Path(folder) / "stderr")
    faulthandler.enable()
    reader, path, valid = prepared(module, name, Path(folder))
    most = readers.resident()
    for start, stop, passed in blocks:
        to.send(block(name, seed, start, stop, set(passed), (reader, path, valid, now, most)))
    to.close()


def blocks_of(name: str, seed: int, inputs: int, done: set[int], module: str) -> Iterator[dict]:
    """All blocks of a reader that are not done, in a new process after each that ended."""
    spawn = multiprocessing.get_context("spawn")
    ended: dict[int, str] = {}
    late: Counter[int] = Counter()
    while True:
        left = [
            (start, stop := min(start + BLOCK, inputs), [n for n in ended if start <= n < stop])
            for start in range(0, inputs, BLOCK)
            if start not in done
        ]
        if not left:
            return
        with TemporaryDirectory(dir=MEMORY) as folder:
            now, (here, there) = spawn.Value("q", -1), spawn.Pipe(duplex=False)
            one = spawn.Process(target=child, args=(module, name, seed, left, folder, now, there))
            one.start()
            there.close()
            why = ""
            try:
                for found in watched(one, now, here):
                    done.add(found["start"])
                    of_block = {
                        f"{n}": w for n, w in ended.items() if 0 <= n - found["start"] < BLOCK
                    }
                    yield found | {"faults": of_block | found["faults"]}
            except TimeoutError:
                late[now.value] += 1
                why = f"no end after {LONGEST:.0f} s, twice"
            one.join()
            said = (Path(folder) / "stderr").read_text(errors="replace")
            said = "".join(said.partition("Fatal Python error")[1:])[:600] or said[-600:]
            if one.exitcode and now.value < 0:
                raise RuntimeError(f"{name}: a valid file is not read: {said}")
            if one.exitcode and (not why or late[now.value] > 1):
                ended[now.value] = why or f"the interpreter ended with {one.exitcode}: {said}"


def watched(one: Any, now: Any, here: Any) -> Iterator[dict]:
    """What a process sends until it ends; TimeoutError, and its end, if an input has none."""
    number, since = now.value, time.monotonic()
    while True:
        if here.poll(0.2):
            try:
                yield here.recv()
            except EOFError:
                return
        if now.value != number or number < 0:
            number, since = now.value, time.monotonic()
        elif time.monotonic() - since > LONGEST:
            one.kill()
            raise TimeoutError


def reached(module: str, name: str, seed: int, inputs: int) -> dict[str, int]:
    """Lines of the functions that read: all, by valid files, and by a sample of damaged ones."""
    lines: set[tuple[CodeType, int]] = set()
    codes: set[CodeType] = set()

    def trace(frame: FrameType, event: str, argument: object) -> Any:
        code = frame.f_code
        if event == "call" and not frame.f_globals.get("__name__", "").startswith(parts):
            return None
        codes.add(code)
        if event == "line":
            lines.add((code, frame.f_lineno))
        return trace

    with TemporaryDirectory(dir=MEMORY) as folder:
        reader, path, valid = prepared(module, name, Path(folder))
        parts, by = reader.modules, []
        step = max(inputs // TRACED, 1)
        some = (damaged(name, valid, reader.layout, seed, n) for n in range(0, inputs, step))
        for files in (valid, some):
            for data in files:
                path.write_bytes(data)
                sys.settrace(trace)
                try:
                    tried(reader, path, 1, readers.resident())
                finally:
                    sys.settrace(None)
            by.append(len(lines))
    every = {(c, n) for c in codes for *_, n in c.co_lines() if n and n != c.co_firstlineno}
    for file in sorted({c.co_filename for c in codes}):
        missed = sorted(n for c, n in every - lines if c.co_filename == file)
        if missed:
            sys.stdout.write(f"{name} does not reach {Path(file).name}: {missed}\n")
    sys.stdout.flush()
    return {"lines": len(every | lines), "valid": by[0], "damaged": by[1]}


def state(reader: readers.Reader) -> str:
    """Of what reads, of the valid files and of the damage."""
    files = [Path(part.__file__) for part in (damage, damage_steps, readers, valid_files)]
    for module in reader.modules:
        place = ROOT / "lib" / module.replace(".", "/")
        files += sorted(place.glob("*.py")) if place.is_dir() else [place.with_suffix(".py")]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:12]


def study(
    inputs: dict[str, int], seed: int, processes: int, journal: Path, module: str = "readers"
) -> dict[str, list[dict]]:
    """All blocks of all readers; what is in the journal is not read again."""
    journal.parent.mkdir(parents=True, exist_ok=True)
    journal.touch()
    lines = [json.loads(line) for line in journal.read_text(encoding="utf-8").splitlines()]
    lock, table = Lock(), importlib.import_module(module).READERS
    rows: dict[str, list[dict]] = {}

    def one(name: str) -> None:
        known = {"state": state(table[name]), "seed": seed, "reader": name}
        rows[name] = [
            row for row in lines if known.items() <= row.items() and row["stop"] <= inputs[name]
        ]
        done = {row["start"] for row in rows[name]}
        for found in blocks_of(name, seed, inputs[name], done, module):
            row = known | found
            with lock, journal.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
            rows[name].append(row)
            for number, fault in row["faults"].items():
                sys.stdout.write(f"{name} {number}: {fault}\n")
        sys.stdout.write(f"{name}: {sum(row['fault'] for row in rows[name])} faults\n")
        sys.stdout.flush()

    with ThreadPoolExecutor(processes) as pool:
        list(pool.map(one, inputs))
    return rows


def told(rows: list[dict], lines: dict[str, int]) -> dict[str, Any]:
    """The blocks of one reader together."""
    sums = {what: sum(row[what] for row in rows) for what in ("read", "refused", "fault")}
    most = {k: round(max(row[k] for row in rows), 2) for k in ("slowest", "memory", "grown")}
    faults = {k: v for row in rows for k, v in row["faults"].items()}
    return {
        "inputs": sum(sums.values()), **sums,
        "seconds": round(sum(row["seconds"] for row in rows)), **most,
        "lines": lines, "faults": faults,
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--share", type=float, default=1.0, help="of the million")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--store", type=Path, default=STORED)
    options = parser.parse_args()
    seed, there = options.seed, [n for n, reader in readers.READERS.items() if not reader.missing]
    there.sort(key=INPUTS.__getitem__, reverse=True)
    inputs = {name: int(options.share * INPUTS[name]) for name in there}
    rows = study(inputs, seed, options.processes, ROOT / "_build" / "fuzz.jsonl")
    spawn = multiprocessing.get_context("spawn")
    with spawn.Pool(options.processes, quiet, (os.devnull,)) as pool:
        lines = pool.starmap(reached, [("readers", n, seed, inputs[n]) for n in there])
    report = {
        "date": f"{date.today()}",
        "seed": seed,
        "system": f"{platform.system()}, Python {platform.python_version()}",
        "limits": {"seconds": LONGEST, "memory": readers.MEMORY, "resident": readers.RESIDENT},
        "readers": {n: told(rows[n], of) for n, of in zip(there, lines, strict=True)},
    }
    options.store.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    if any(found["fault"] for found in report["readers"].values()):
        sys.exit("some inputs did not pass: benchmarks/fuzz.json tells which")


if __name__ == "__main__":
    main()
