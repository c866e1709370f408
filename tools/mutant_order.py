"""Which unit tests may see an edit of the library, the likely ones first.

First those that run the edited statement, the quickest before the rest; then those that run
anything of its file; last those of the files that name what it defines or mirror what imports it,
and those of no package, which are about all: what is computed at import or kept in a cache no test
seems to run.
"""

import ast
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from coverage import CoverageData
from mutant_sites import LIBRARY, Mutant

PYTEST = ("-m", "not slow", "-p", "no:cacheprovider", "--ignore", "tests/book")
TRACED = "[run]\nrelative_files = true\nomit = */navfilters/oracles/*\n"


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


def pytest(root: Path, *options: str, seconds: float | None = None) -> subprocess.CompletedProcess:
    environment = {**os.environ, "PYTHONPATH": str(root / "lib"), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "pytest", *PYTEST, *options]
    return subprocess.run(
        command, cwd=root, env=environment, capture_output=True, text=True, timeout=seconds
    )


def measure(root: Path, folder: Path) -> None:
    """Run every test once; keep in a folder which lines each runs, and how long each takes."""
    (root / ".coveragerc").write_text(TRACED)
    traced = ("--cov=navfilters", "--cov-context=test", "--cov-report=", "--durations=0", "-vv")
    said = pytest(root, *traced, "tests").stdout
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(root / ".coverage", folder / "coverage")
    (folder / "durations.txt").write_text(said, encoding="utf-8")


class Suite:
    """The tests that pass on the library as it is, as they were measured in a folder."""

    def __init__(self, folder: Path) -> None:
        said = (folder / "durations.txt").read_text(encoding="utf-8")
        self.seconds = dict.fromkeys(re.findall(r"^(tests/.+::.+) PASSED", said, re.M), 0.0)
        for took, test in re.findall(r"^([\d.]+)s (?:setup|call|teardown) +(.+)$", said, re.M):
            if test in self.seconds:
                self.seconds[test] += float(took)
        self.data = CoverageData(str(folder / "coverage"))
        self.data.read()

    def quickest(self, tests: Iterable[str]) -> list[str]:
        return sorted(tests, key=lambda test: (self.seconds[test], test))

    def of_files(self, files: Iterable[str]) -> list[str]:
        wanted = set(files)
        return self.quickest(t for t in self.seconds if t.partition("::")[0] in wanted)

    def running(self, file: str, lines: Iterable[int]) -> list[str]:
        """The tests that run one of the lines, and all of a file whose fixture does."""
        contexts, found, files = self.data.contexts_by_lineno(file), set[str](), set[str]()
        for context in {context for line in lines for context in contexts.get(line, [])}:
            test, _, phase = context.rpartition("|")
            found.add(test)
            if phase == "setup":
                files.add(test.partition("::")[0])
        return self.quickest((found & self.seconds.keys()) | set(self.of_files(files)))

    def order(self, root: Path, mutant: Mutant) -> list[str]:
        """Those that may see a mutant, the likely ones first."""
        source = (root / mutant.file).read_bytes()
        tests = self.running(mutant.file, statement(source, mutant.line))
        tests += self.running(mutant.file, range(1, source.count(b"\n") + 1))
        for files in tiers(root, mutant.file):
            tests += self.of_files(files)
        tests += self.quickest(t for t in self.seconds if t.count("/") == 1)
        return list(dict.fromkeys(tests))


def statement(source: bytes, line: int) -> range:
    """The lines of the innermost statement at a line, of a compound one its head."""
    around = [n for n in ast.walk(ast.parse(source)) if isinstance(n, ast.stmt)]
    around = [n for n in around if n.lineno <= line <= n.end_lineno]
    if not around:  # a decorator
        return range(line, line + 1)
    inner = max(around, key=lambda n: n.lineno)
    body = getattr(inner, "body", None)
    return range(inner.lineno, max(line + 1, body[0].lineno if body else inner.end_lineno + 1))
