"""A problem as arrays and what holds them together: to pick members, to compile, to compare.

A filter with its options, a model, a prior: each is a tree of dataclasses, tuples and partials with
arrays as leaves. Everything else in it is *fixed*: part of the tree itself, a constant when JAX
compiles.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, is_dataclass
from functools import cached_property, partial
from numbers import Real
from types import FunctionType, SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from navfilters.numerics import validation


class Fixed:
    """A value that is no array, hashable even if it is not: then equal to itself alone.

    Parameters
    ----------
    value : object
    """

    def __init__(self, value: Any) -> None:
        self.value = value

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Fixed) or type(self.value) is not type(other.value):
            return False
        return self.value is other.value or (_hashable(self.value) and self.value == other.value)

    def __hash__(self) -> int:
        return hash(self.value) if _hashable(self.value) else id(self.value)


def _hashable(value: Any) -> bool:
    try:
        hash(value)
    except TypeError:
        return False
    return True


@dataclass(frozen=True)
class Tree:
    """What is left of a value when its arrays are taken out; hashable.

    Parameters
    ----------
    kind : type
        Of the value; ``numpy.ndarray`` for an array, ``Fixed`` for what has no parts.
    names : tuple of str
        Of the parts; "" for a positional argument of a partial.
    parts : tuple of Tree
    fixed : Fixed, optional
        The value itself where it has no parts.
    """

    kind: type
    names: tuple[str, ...] = ()
    parts: tuple["Tree", ...] = ()
    fixed: Fixed | None = None

    @property
    def size(self) -> int:
        """Number of arrays that were in the value."""
        return int(self.kind is np.ndarray) + sum(part.size for part in self.parts)

    @property
    def only_arrays(self) -> bool:
        """Whether nothing but arrays, and None where there is none, was in the value."""
        if self.fixed is not None:
            return self.fixed.value is None
        return all(part.only_arrays for part in self.parts)


class Leaf(NamedTuple):
    """An array of a tree.

    Parameters
    ----------
    name : str
        Where it was found, such as "model.R".
    array : ndarray
        (*lead axes, *batch axes, *core axes)
    core : int or None
        Number of axes of one member's value; None for an array that all members share.
    lead : int
        Number of axes in front of the batch axes: 1 for a series over the steps.
    """

    name: str
    array: np.ndarray
    core: int | None
    lead: int = 0

    @property
    def batch(self) -> tuple[int, ...]:
        """The batch axes."""
        if self.core is None:
            return ()
        return self.array.shape[self.lead : max(self.lead, self.array.ndim - self.core)]

    @property
    def axis(self) -> int | None:
        """Where the members are, once they are picked; None where all share the array."""
        return self.lead if self.batch else None

    def pick(self, index: tuple[np.ndarray, ...], batch: tuple[int, ...]) -> np.ndarray:
        """The values of some members.

        Parameters
        ----------
        index : tuple of int array (k,)
            Their index in each batch axis.
        batch : tuple of int
            All batch axes, with which this leaf's broadcast.

        Returns
        -------
        ndarray (*lead axes, k, *core axes)
            The array itself where all members share it.
        """
        if self.axis is None:
            return self.array
        shape, last = self.array.shape, self.lead + len(self.batch)
        missing = (1,) * (len(batch) - len(self.batch))  # behind the series, not in front of it
        whole = self.array.reshape(*shape[: self.lead], *missing, *shape[self.lead :])
        every = np.broadcast_to(whole, (*shape[: self.lead], *batch, *shape[last:]))
        lead: tuple[Any, ...] = (slice(None),) * self.lead
        return np.ascontiguousarray(every[lead + index])


def flatten(
    name: str, value: Any, core: int | None, lead: int = 0, *, opened: bool = False
) -> tuple[Tree, list[Leaf]]:
    """Take a value apart.

    Parameters
    ----------
    name : str
        The argument, as the caller knows it.
    value : object
        Arrays are found in dataclasses, tuples and partials. A list or tuple of numbers is one.
    core : int or None
        Number of trailing axes of each array that are not batch axes; a dataclass field may say
        otherwise in its metadata, ``field(metadata={"axes": 2})``. None: no array has batch axes.
    lead : int
        Number of axes in front of the batch axes.
    opened : bool
        Whether arrays are looked for among the attributes of other objects too.

    Returns
    -------
    Tree
    list of Leaf
        From left to right.

    Raises
    ------
    ValueError
        An array that :func:`~navfilters.numerics.plain_arrays.plain` refuses.
    """
    if core == 0 and _numbers(value):
        value = validation.real_array(name, value, "")
    if hasattr(value, "__array_namespace__") and np.ndim(value):
        return Tree(np.ndarray), [Leaf(name, np.asarray(validation.plain(name, value)), core, lead)]
    found = _parts(value, opened)
    if found is None:
        return Tree(Fixed, fixed=Fixed(value)), []
    trees, leaves = [], []
    for label, part, axes in found:
        inside = f"{name}.{label}" if label else name
        own = core if core is None or axes is None else axes
        tree, more = flatten(inside, part, own, lead, opened=opened)
        trees.append(tree)
        leaves += more
    return Tree(type(value), tuple(label for label, *_ in found), tuple(trees)), leaves


def _numbers(value: Any) -> bool:
    """Whether value is a list, or a list of lists, of numbers; a named tuple has parts instead."""
    if not isinstance(value, list | tuple) or hasattr(value, "_fields") or not value:
        return False
    return all(isinstance(v, Real | np.bool_) or _number(v) or _numbers(v) for v in value)


def _number(value: Any) -> bool:
    return hasattr(value, "__array_namespace__") and np.ndim(value) == 0


def _parts(value: Any, opened: bool) -> list[tuple[str, Any, int | None]] | None:
    """Names, values and declared numbers of axes of a value's parts; None if it has none."""
    if isinstance(value, partial):
        named = [("func", value.func, None), *(("", a, None) for a in value.args)]
        return named + [(name, a, None) for name, a in value.keywords.items()]
    if isinstance(value, tuple):
        names = getattr(value, "_fields", range(len(value)))
        elements = [(str(name), part, None) for name, part in zip(names, value, strict=True)]
        return elements + _attributes(value, set())
    if is_dataclass(value) and not isinstance(value, type):
        found = [(f.name, getattr(value, f.name), f.metadata.get("axes")) for f in fields(value)]
        return found + _attributes(value, {f.name for f in fields(value)})
    plain = type(value).__module__ != "builtins" and not isinstance(value, type | FunctionType)
    if opened and plain and hasattr(value, "__dict__"):
        return _attributes(value, set())
    return None


def _attributes(value: Any, known: set[str]) -> list[tuple[str, Any, int | None]]:
    """What an object has beside its fields, but for what it will compute again."""
    return [
        (name, part, None)
        for name, part in getattr(value, "__dict__", {}).items()
        if name not in known and not isinstance(getattr(type(value), name, None), cached_property)
    ]


def unflatten(tree: Tree, arrays: Iterable[Any]) -> Any:
    """Put a value together again, with other arrays.

    Parameters
    ----------
    tree : Tree
    arrays : iterable of array
        One for each leaf, from left to right: of NumPy, or tracers of JAX.

    Returns
    -------
    object
        As the one taken apart, but for its arrays. Constructors do not run: they check values.
    """
    return _grow(tree, iter(arrays))


def _grow(tree: Tree, arrays: Iterator[Any]) -> Any:
    if tree.kind is np.ndarray:
        return next(arrays)
    if tree.fixed is not None:
        return tree.fixed.value
    parts = [_grow(part, arrays) for part in tree.parts]
    named = list(zip(tree.names, parts, strict=True))
    if issubclass(tree.kind, partial):
        (_, function), *arguments = named
        keywords = {name: part for name, part in arguments if name}
        return partial(function, *(part for name, part in arguments if not name), **keywords)
    if issubclass(tree.kind, tuple):
        size = len(getattr(tree.kind, "_fields", parts))
        kind = tree.kind if hasattr(tree.kind, "_fields") else tuple
        value: Any = tuple.__new__(kind, parts[:size])
        named = named[size:]
    elif issubclass(tree.kind, SimpleNamespace):
        value = tree.kind()
    else:
        value = object.__new__(tree.kind)
    for name, part in named:
        object.__setattr__(value, name, part)
    return value
