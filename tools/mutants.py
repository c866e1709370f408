"""How many small faults the unit tests see: a seeded sample of mutants of the library.

Each is one edit of one file, made in a copy of the project. The tests that mirror the file run
first, those that name what it defines before the rest of their folder; if all pass, the tests of
the packages that import it. Oracles are left out: they are tests of the rest.
"""

import argparse
import ast
import json
import os
import random
import re
import shutil
import subprocess
import sys
from collections import Counter
from dataclasses import asdict, dataclass, replace
from functools import cache
from importlib.util import cache_from_source
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

ROOT = Path(__file__).resolve().parent.parent
STORED = ROOT / "benchmarks" / "mutants.json"
LIBRARY = Path("lib/navfilters")
COPIED = ("lib", "tests", "tools", "benchmarks", "book", "data")
PYTEST = ("-x", "-q", "-m", "not slow", "-p", "no:cacheprovider", "--ignore", "tests/book")

COMPARISONS = {
    "Lt": ("<", "<="), "LtE": ("<=", "<"), "Gt": (">", ">="), "GtE": (">=", ">"),
    "Eq": ("==", "!="), "NotEq": ("!=", "=="), "Is": ("is", "is not"), "IsNot": ("is not", "is"),
    "In": ("in", "not in"), "NotIn": ("not in", "in"),
}  # fmt: skip
ARITHMETIC = {
    "Add": ("+", "-"), "Sub": ("-", "+"), "Mult": ("*", "/"), "Div": ("/", "*"),
    "FloorDiv": ("//", "*"), "Mod": ("%", "*"), "Pow": ("**", "*"),
}  # fmt: skip
BOOLEAN = {"And": ("and", "or"), "Or": ("or", "and")}


@dataclass(frozen=True)
class Mutant:
    """Bytes ``start`` to ``end`` of a file become ``new``."""

    file: str
    line: int
    kind: str
    start: int
    end: int
    old: str
    new: str

    def of(self, source: bytes) -> bytes:
        return source[: self.start] + self.new.encode() + source[self.end :]


class Sites(ast.NodeVisitor):
    """Every place of a source where one of the edits is possible."""

    def __init__(self, source: bytes, file: str) -> None:
        self.source, self.file, self.found = source, file, list[Mutant]()
        self.lines = [0]
        for line in source.splitlines(keepends=True):
            self.lines.append(self.lines[-1] + len(line))
        self.visit(ast.parse(source))

    def at(self, node: ast.AST) -> tuple[int, int]:
        """First byte and the one after the last."""
        start = self.lines[node.lineno - 1] + node.col_offset
        return start, self.lines[node.end_lineno - 1] + node.end_col_offset

    def text(self, node: ast.AST) -> str:
        return self.source[slice(*self.at(node))].decode()

    def add(self, kind: str, start: int, end: int, new: str) -> None:
        line = self.source.count(b"\n", 0, start) + 1
        old = self.source[start:end].decode()
        self.found.append(Mutant(self.file, line, kind, start, end, old, new))

    def between(self, kind: str, left: ast.AST, right: ast.AST, op: ast.AST, table: dict) -> None:
        """Another operator between two operands."""
        if type(op).__name__ in table:
            old, new = table[type(op).__name__]
            first, last = self.at(left)[1], self.at(right)[0]
            pattern = re.escape(old).replace(r"\ ", r"\s+")
            if found := re.search(pattern.encode(), self.source[first:last]):
                self.add(kind, first + found.start(), first + found.end(), new)

    def visit_Compare(self, node: ast.Compare) -> None:
        operands = [node.left, *node.comparators]
        for left, right, op in zip(operands, operands[1:], node.ops, strict=False):
            self.between("comparison", left, right, op, COMPARISONS)
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        self.between("arithmetic", node.left, node.right, node.op, ARITHMETIC)
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        self.between("boolean", *node.values[:2], node.op, BOOLEAN)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        kinds = {ast.USub: "sign", ast.Not: "boolean"}
        if kind := kinds.get(type(node.op)):
            self.add(kind, *self.at(node), f"({self.text(node.operand)})")
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        if isinstance(node.value, bool):
            self.add("boolean", *self.at(node), str(not node.value))
        elif isinstance(node.value, int):
            self.add("constant", *self.at(node), str(node.value + 1))
        elif isinstance(node.value, float):
            self.add("constant", *self.at(node), repr(1.1 * node.value or 1.0))

    def visit_Call(self, node: ast.Call) -> None:
        starred = any(isinstance(arg, ast.Starred) for arg in node.args[:2])
        if len(node.args) > 1 and not starred:
            one, two = node.args[:2]
            start, end = self.at(one)[0], self.at(two)[1]
            middle = self.source[self.at(one)[1] : self.at(two)[0]].decode()
            if self.text(one) != self.text(two):
                self.add("swapped arguments", start, end, self.text(two) + middle + self.text(one))
        self.generic_visit(node)

    def visit_Raise(self, node: ast.Raise) -> None:
        """Its message is text for people."""
        self.add("removed statement", *self.at(node), "pass")

    def generic_visit(self, node: ast.AST) -> None:
        """Of assignments only those of a part: a name never bound would be seen by any test."""
        parts = ast.Subscript, ast.Attribute
        part = isinstance(node, ast.Assign) and isinstance(node.targets[0], parts)
        call = isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)
        if part or call or isinstance(node, ast.AugAssign):
            self.add("removed statement", *self.at(node), "pass")
        super().generic_visit(node)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Text for people, and without positions before Python 3.12."""


def mutants(root: Path) -> list[Mutant]:
    """All of the library, in the order of the tree."""
    found = []
    for path in sorted((root / LIBRARY).rglob("*.py")):
        if "oracles" not in path.relative_to(root / LIBRARY).parts:
            found += Sites(path.read_bytes(), path.relative_to(root).as_posix()).found
    return found


def changes(root: Path, mutant: Mutant) -> bool:
    """Whether an edit gives another program that can be parsed."""
    source = (root / mutant.file).read_bytes()
    try:
        return ast.dump(ast.parse(mutant.of(source))) != ast.dump(ast.parse(source))
    except SyntaxError:
        return False


def sample(root: Path, seed: int, count: int, only: str = "") -> list[Mutant]:
    """A larger sample of the same seed begins with the smaller one."""
    every = [m for m in mutants(root) if only in m.file]
    random.Random(seed).shuffle(every)
    return list(islice((m for m in every if changes(root, m)), count))


def definitions(source: str) -> set[str]:
    """Public names that a module defines."""
    names = set()
    for node in ast.parse(source).body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            names.add(node.name)
        elif isinstance(node, ast.Assign):
            names |= {target.id for target in node.targets if isinstance(target, ast.Name)}
    return {name for name in names if not name.startswith("_") and len(name) > 1}


def mirror(root: Path, file: str) -> Path:
    """The folder of tests that stands for a file's package."""
    parts = Path(file).relative_to(LIBRARY).parts[:-1]
    for length in range(len(parts), 0, -1):
        for first in range(len(parts) - length + 1):
            folder = root / "tests" / Path(*parts[first : first + length])
            if folder.is_dir() and folder.name != "book":
                return folder
    return root / "tests"


@cache
def imports(root: Path) -> dict[str, set[str]]:
    """What each of the library's files imports from, by file."""
    found = {}
    for path in sorted((root / LIBRARY).rglob("*.py")):
        nodes = [n for n in ast.walk(ast.parse(path.read_bytes())) if isinstance(n, ast.ImportFrom)]
        names = {f"{node.module}.{alias.name}" for node in nodes for alias in node.names}
        found[path.relative_to(root).as_posix()] = names | {node.module for node in nodes}
    return found


def importers(root: Path, file: str) -> list[str]:
    """The library's files that import a file, or names of its package."""
    module = ".".join(Path(file).relative_to("lib").with_suffix("").parts)
    wanted = {module, module.rpartition(".")[0]} - {"navfilters"}
    return [other for other, names in imports(root).items() if wanted & names]


def tiers(root: Path, file: str) -> list[list[str]]:
    """The files of tests that run first, and those that run if the first see nothing."""
    source = root / file
    words = definitions(source.read_text(encoding="utf-8")) | {source.stem}
    naming = {}
    for path in sorted((root / "tests").rglob("test_*.py")):
        if "book" not in path.relative_to(root).parts:
            said = re.findall(r"\w+", path.read_text(encoding="utf-8") + " " + path.stem)
            naming[path] = len(words.intersection(said)) + 9 * (source.stem in path.stem)
    folder = mirror(root, file)
    near = [p for p in naming if p.is_relative_to(folder) and (naming[p] or p.parent == folder)]
    if folder == root / "tests":
        near = [p for p in naming if naming[p]]
    folders = {mirror(root, other) for other in importers(root, file)} - {root / "tests"}
    far = [p for p in naming if naming[p] or any(p.is_relative_to(f) for f in folders)]
    order = [sorted(near, key=lambda p: -naming[p])]
    order.append(sorted(set(far) - set(near), key=lambda p: (-naming[p], p)))
    return [[p.relative_to(root).as_posix() for p in tier] for tier in order]


def first_failure(root: Path, tests: list[str], seconds: float) -> str:
    """What pytest names first: ``""`` if all pass, "import" before tests, "stopped" if late."""
    environment = {**os.environ, "PYTHONPATH": str(root / "lib"), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "pytest", *PYTEST, *tests]
    try:
        ended = subprocess.run(
            command, cwd=root, env=environment, capture_output=True, text=True, timeout=seconds
        )
    except subprocess.TimeoutExpired:
        return "stopped"
    if ended.returncode in (0, 5):
        return ""
    named = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - |$)", ended.stdout, re.M)
    return named.group(1) if named else "import"


def seen(root: Path, mutant: Mutant, seconds: float) -> tuple[str, float]:
    """Which test sees a mutant in a copy of the project, and after how many seconds."""
    path = root / mutant.file
    source, start, by = path.read_bytes(), perf_counter(), ""
    order = tiers(root, mutant.file)
    try:
        path.write_bytes(mutant.of(source))
        for tests in order:
            Path(cache_from_source(str(path))).unlink(missing_ok=True)
            by = by or (first_failure(root, tests, seconds) if tests else "")
    finally:
        path.write_bytes(source)
        Path(cache_from_source(str(path))).unlink(missing_ok=True)
    return by, round(perf_counter() - start, 1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--limit", type=float, default=300.0, help="seconds for each run of pytest")
    parser.add_argument("--only", default="", help="a part of the paths to mutate")
    parser.add_argument("--store", type=Path, default=STORED)
    options = parser.parse_args()
    chosen, rows = sample(ROOT, options.seed, options.count, options.only), []
    with TemporaryDirectory() as folder:
        root = Path(folder)
        for part in COPIED:
            if (ROOT / part).is_dir():
                shutil.copytree(ROOT / part, root / part, ignore=shutil.ignore_patterns(".*"))
        for path in ROOT.glob("[!.]*.*"):
            if path.is_file():
                shutil.copy(path, root)
        collected = not first_failure(root, ["--collect-only", "tests"], options.limit)
        clean = {"": True, "stopped": True, "import": collected}
        for i, mutant in enumerate(chosen, 1):
            by, took = seen(root, mutant, options.limit)
            if by not in clean:  # a test that fails on the library as it is sees no mutant
                clean[by] = not first_failure(root, [by], options.limit)
            by = by if clean[by] else "fails without a mutant"
            rows.append({**asdict(replace(mutant, old=mutant.old[:100])), "seen_by": by, "s": took})
            where = f"{i}  {mutant.file}:{mutant.line}  {mutant.kind}"
            sys.stdout.write(f"{where}  {by or 'SURVIVED'}  {took} s\n")
            sys.stdout.flush()
            apart = {"": "survived", "stopped": "stopped"}
            kinds = Counter(apart.get(r["seen_by"], "seen") for r in rows)
            report = {"seed": options.seed, "count": len(rows), **kinds, "mutants": rows}
            options.store.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
