"""What is true of every dataclass of the library."""

import dataclasses
import importlib
import pkgutil
import re

import pytest

import navfilters

pytest.importorskip("matplotlib")


def dataclasses_of(package):
    found = set()
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        if not re.search(r"__main__|oracles|compiled", module.name):
            every = vars(importlib.import_module(module.name)).values()
            found |= {e for e in every if isinstance(e, type) and dataclasses.is_dataclass(e)}
    return sorted(found, key=lambda each: (each.__module__, each.__name__))


EVERY = dataclasses_of(navfilters)


@pytest.mark.parametrize("each", EVERY, ids=lambda each: f"{each.__module__}.{each.__name__}")
def test_what_holds_arrays_is_equal_to_itself_only(each):
    """By its docstring: comparing arrays has no one answer, and they have no hash."""
    if re.search(r"^ +\w+(?:, \w+)* : array", each.__doc__ or "", re.M):
        assert each.__eq__ is object.__eq__
        assert each.__hash__ is object.__hash__


def test_values_are_frozen():
    """All but the one that remembers which of its functions are analytic."""
    changing = [each.__name__ for each in EVERY if not each.__dataclass_params__.frozen]
    assert len(EVERY) > 100
    assert changing == ["ByComplexStep"]


def test_what_is_computed_is_not_shown():
    """A value's text is what it was made of."""
    for each in EVERY:
        for field in dataclasses.fields(each):
            assert field.init or not field.repr, f"{each.__name__}.{field.name}"
