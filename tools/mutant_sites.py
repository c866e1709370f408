"""The small edits that are possible in the library, and a seeded sample of them.

Oracles are left out: they are tests of the rest.
"""

import ast
import random
import re
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

LIBRARY = Path("lib/navfilters")
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
    text: str  # of the line
    nth: int  # of the same edits of such a line in the file, from 0

    @property
    def name(self) -> tuple[str, ...]:
        """What stays when other lines of the library change."""
        return self.file, self.kind, self.old, self.new, self.text, str(self.nth)

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
        text = self.source[slice(*self.lines[line - 1 : line + 1])].decode().strip()
        edit = (kind, old, new, text)
        nth = sum((m.kind, m.old, m.new, m.text) == edit for m in self.found)
        self.found.append(Mutant(self.file, line, kind, start, end, old, new, text, nth))

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


def sample(
    root: Path, seed: int, count: int, only: str = "", drawn: Iterable[tuple[str, ...]] = ()
) -> list[Mutant]:
    """Those drawn before, by name, that are still possible, and as many more as are wanted.

    A larger sample of the same seed begins with the smaller one.
    """
    every = [m for m in mutants(root) if only in m.file]
    random.Random(seed).shuffle(every)
    possible = {m.name: m for m in every}
    before = [possible.pop(name) for name in drawn if name in possible]
    chosen = (m for m in [*before, *possible.values()] if changes(root, m))
    return list(islice(chosen, count))
