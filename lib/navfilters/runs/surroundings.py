"""What code reads beside its arguments: global names, defaults, attributes of its class.

A function without a closure is not yet one that does the same later on: ``gain * x`` is another
one where ``gain`` is another number.
"""

import dis
import hashlib
import sys
import sysconfig
from collections.abc import Iterable
from functools import cached_property, lru_cache
from numbers import Real
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

from navfilters.runs.trees import Tree, flatten

STEADY = {"builtins", "navfilters", *sys.builtin_module_names}
"""Packages whose own names are not bound anew between two sweeps, as those that are installed."""

INSTALLED = {"site-packages", "dist-packages"}
STANDARD = Path(sysconfig.get_path("stdlib"))

CALLED = ("__call__", "__getattr__")
"""What of a class may be called beside what has a plain name: constructors are not."""

OF_TUPLES = ("_asdict", "_field_defaults", "_fields", "_make", "_replace")

Simple = bool | Real | complex | str | bytes | np.generic | None


class Surroundings:
    """What was found around the code in a tree.

    Attributes
    ----------
    read : list of tuple
        What is read and is a number, a text or an array: its name and its value or a hash of it.
        Of a value with parts, its tree.
    held : list of tuple
        The same of what dictionaries and lists hold, which the code may fill itself.
    whole : bool
        Whether that is all: nothing can change unseen.
    """

    _last: tuple[Any, Any] = None, None

    def __init__(self) -> None:
        self.read: list[tuple[Any, ...]] = []
        self.held: list[tuple[Any, ...]] = []
        self.whole = True
        self._seen: set[Any] = set()

    @classmethod
    def of(cls, tree: Tree) -> "Surroundings":
        """Those of all functions and classes in a tree, once for the tree of a sweep."""
        known, found = cls._last
        if known is not tree:
            found = cls()
            found._of_tree(tree)
            cls._last = tree, found
        return found

    @property
    def key(self) -> tuple[Any, ...] | None:
        """Equal where the same tree does the same; None if that cannot be known."""
        return (*self.read, *self.held) if self.whole else None

    def _of_tree(self, tree: Tree) -> None:
        if tree.fixed is not None:
            self._of_value(tree.fixed.value)
        else:
            self._of_class(tree.kind)
        for part in tree.parts:
            self._of_tree(part)

    def _of_value(self, value: Any) -> None:
        if isinstance(value, FunctionType):
            self._of_function(value)
        elif isinstance(value, type):
            self._of_class(value)
        elif isinstance(value, dict | list):
            self._of_container(value)
        elif isinstance(value, ModuleType):
            self.whole = self.whole and _steady(value.__name__)
        elif not isinstance(value, Simple | BuiltinFunctionType | np.ufunc):
            self.whole = False
            self._of_class(type(value))

    def _of_container(self, value: dict[Any, Any] | list[Any]) -> None:
        if id(value) not in self._seen:
            self._seen.add(id(value))
            items = list(value.items() if isinstance(value, dict) else enumerate(value))
            self.whole = self.whole and all(isinstance(key, Simple) for key, _ in items)
            outside, self.read = self.read, self.held
            self._of_names((repr(key), part) for key, part in items)
            self.read = outside

    def _of_function(self, function: FunctionType) -> None:
        if function in self._seen or _steady(function.__module__):
            return
        self._seen.add(function)
        names = function.__code__.co_freevars
        for name, cell in zip(names, function.__closure__ or (), strict=True):
            if name == "__class__":  # of super()
                self._of_value(cell.cell_contents)
            else:
                self.whole = False
        self.whole = self.whole and not function.__dict__
        defaults = (*(function.__defaults__ or ()), *(function.__kwdefaults__ or {}).values())
        self._of_names((f"{function.__qualname__} default {i}", v) for i, v in enumerate(defaults))
        around, (names, attributes) = function.__globals__, _names(function.__code__)
        library = vars(sys.modules["navfilters"])
        for name in (n for n in names if n in around):
            value = around[name]
            if name in library and value is library[name]:
                continue
            if isinstance(value, ModuleType) and not _steady(value.__name__):
                some = (a for a in attributes if hasattr(value, a))
                self._of_names((f"{name}.{a}", getattr(value, a)) for a in some)
            else:
                self._of_names([(name, value)])

    def _of_class(self, kind: type) -> None:
        for base in kind.__mro__:
            if base in self._seen or _steady(base.__module__):
                continue
            self._seen.add(base)
            for name, value in vars(base).items():
                own = not name.startswith("__") or name in CALLED
                if own and not name.startswith("_abc_") and name not in OF_TUPLES:
                    self._of_attribute(f"{base.__qualname__}.{name}", value)

    def _of_attribute(self, name: str, value: Any) -> None:
        if isinstance(value, property):
            parts = [value.fget]
        elif isinstance(value, staticmethod | classmethod):
            parts = [value.__func__]
        elif isinstance(value, cached_property):
            parts = [value.func]
        elif hasattr(value, "__get__") and not isinstance(value, FunctionType):
            # A slot, or a field of a named tuple, is in the tree.
            self.whole = self.whole and _steady(type(value).__module__)
            return
        else:
            parts = [value]
        self._of_names((name, part) for part in parts)

    def _of_names(self, named: Iterable[tuple[str, Any]]) -> None:
        for name, value in named:
            try:
                tree, leaves = flatten(name, value, None)
            except ValueError:  # an array whose meaning is more than its numbers
                self.whole = False
                continue
            for leaf in leaves:
                self._of_array(leaf.name, leaf.array)
            if tree.fixed is not None and isinstance(value, Simple):
                self.read.append((name, type(value).__name__, repr(value)))
            elif tree.kind is not np.ndarray:
                self.read.append((name, tree))
                self._of_tree(tree)

    def _of_array(self, name: str, array: np.ndarray) -> None:
        if array.dtype.hasobject:
            self.whole = False
        else:
            content = hashlib.sha256(array.tobytes()).hexdigest()
            self.read.append((name, array.shape, array.dtype.str, content))

    def numbers(self) -> list[tuple[Any, ...]]:
        """Of what is read, what another process can compare."""
        return [entry for entry in self.read if not isinstance(entry[-1], Tree)]


@lru_cache(maxsize=1024)
def _steady(module: str | None) -> bool:
    top = (module or "").partition(".")[0]
    file = Path(getattr(sys.modules.get(top), "__file__", None) or "")
    installed = not INSTALLED.isdisjoint(file.parts) or STANDARD in file.parents
    return top in STEADY or installed


@lru_cache(maxsize=1024)
def _names(code: CodeType) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Global names that code and functions within it read; and all their names, of attributes."""
    read = [
        i.argval for i in dis.get_instructions(code) if i.opname in ("LOAD_GLOBAL", "LOAD_NAME")
    ]
    every = list(code.co_names)
    for inner in (_names(c) for c in code.co_consts if isinstance(c, CodeType)):
        read += inner[0]
        every += inner[1]
    return tuple(dict.fromkeys(read)), tuple(dict.fromkeys(every))
