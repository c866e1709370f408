"""What the code of a model reads beside its arguments decides whether it will do the same again."""

import datetime
import math
from dataclasses import dataclass
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from polar_models import quiet
from scipy import stats

from navfilters import FILTERS, Gaussian
from navfilters.models import Linear
from navfilters.runs.surroundings import Surroundings
from navfilters.runs.trees import flatten

GAIN = 1.0
TRUTH = np.zeros(2)
WORDS = {0: {1.0}}
KNOWN = {"gain": [1.0, np.ones(2)]}
KNOWN["itself"] = KNOWN
MINE = ModuleType("mine")
MINE.gain = 1.0
OBJECTS = np.array([None, 1.0])
ONLY = np.ma.masked_array([1.0, 2.0], [True, False])
PRIORS = Gaussian(np.array([[1.0, 2.0], [3.0, 4.0]]), np.eye(2))


def scaled(x):
    return GAIN * x


@dataclass(frozen=True, eq=False)
class Scaled:
    R: Any
    factor = 1.0

    def h(self, x):
        return self.factor * scaled(x[..., :1])


def error(state):
    return state.estimate.mean - TRUTH


def key_of(value):
    return Surroundings.of(flatten("value", value, None)[0]).key


@pytest.mark.slow
def test_jax_compiles_anew_what_reads_another_global(monkeypatch):
    """The program of before was used again, with the old numbers in it."""

    def both():
        options = {"steps": 1, "record": error}
        return [
            quiet(FILTERS["EKF"], PRIORS, np.array([5.0]), Scaled(np.eye(1)), engine=e, **options)
            for e in ("numpy", "jax")
        ]

    before = both()
    for name, value in (("GAIN", 2.0), ("TRUTH", np.array([100.0, 200.0]))):
        monkeypatch.setitem(globals(), name, value)
        ours, compiled = both()
        np.testing.assert_allclose(compiled.record, ours.record, rtol=1e-12)
        assert not np.allclose(compiled.record, before[1].record)


def test_what_is_read_is_in_the_key(monkeypatch):
    first = key_of(Scaled(np.eye(1)))
    assert first is not None
    assert first == key_of(Scaled(4 * np.eye(1)))  # arrays of the model are arguments
    monkeypatch.setitem(globals(), "GAIN", 2.0)  # of a function that its method calls
    second = key_of(Scaled(np.eye(1)))
    monkeypatch.setattr(Scaled, "factor", 3.0)
    third = key_of(Scaled(np.eye(1)))
    assert len({first, second, third}) == 3


def test_an_array_is_known_by_its_numbers():
    before = key_of(error)
    assert key_of(error) == before
    TRUTH[0] = 1.0
    try:
        assert key_of(error) != before
    finally:
        TRUTH[0] = 0.0


def with_default(x, by=TRUTH):
    return x - by


def with_attribute(x):
    return x


with_attribute.gain = 1.0


class Slotted:
    __slots__ = ("gain",)


class Owner:
    """Attributes of every kind."""

    made = staticmethod(with_default)

    @classmethod
    def named(cls):
        return GAIN

    @property
    def gain(self):
        return math.pi * GAIN


def test_library_and_kinds_of_attributes_are_followed():
    assert key_of(Linear(np.eye(1), np.eye(1))) == ()
    assert key_of(FILTERS["UKF"]) == ()
    assert key_of(Slotted) == ()
    read = {entry[0]: entry[1:] for entry in key_of(Owner)}
    assert {"GAIN", "Owner.made", "with_default default 0"} <= set(read)


def test_dictionaries_lists_and_modules_of_ones_own_are_looked_into(monkeypatch):
    for function, owner, name, value in (
        (lambda x: KNOWN["gain"][0] * x, KNOWN, "gain", [2.0, np.ones(2)]),
        (lambda x: KNOWN["gain"][1] * x, KNOWN, "gain", [2.0, np.zeros(2)]),
        (lambda x: KNOWN["other"] * x, KNOWN, "other", 1.0),
        (lambda x: MINE.gain * x, MINE.__dict__, "gain", 2.0),
    ):
        before = key_of(function)
        assert before == key_of(function) is not None
        monkeypatch.setitem(owner, name, value)
        assert key_of(function) != before


def test_what_is_installed_is_not():
    """Else a model whose class has a use for them compiled anew for every sweep."""
    assert key_of(lambda x: datetime.timedelta(1) * math.pi * stats.norm.pdf(x)) is not None
    assert key_of(lambda x: FILTERS["EKF"]) == ()


@pytest.mark.parametrize(
    "value",
    [
        partial(lambda x: WORDS[0] * x),
        lambda x: OBJECTS[1] * x,
        lambda x: ONLY[1] * x,
        lambda x: [GAIN_OF() * x for _ in range(2)],
        with_attribute,
        Owner(),
    ],
)
def test_what_may_change_unseen_has_no_key(value):
    assert key_of(value) is None


def GAIN_OF():  # called within a comprehension
    return WORDS[0]


def test_a_method_that_calls_its_base_is_no_closure():
    class Below(Scaled):
        def h(self, x):
            return super().h(x)

    assert key_of(Below(np.eye(1))) is not None


def test_a_changed_global_is_seen_under_numpy_too(monkeypatch):
    before = quiet(FILTERS["EKF"], PRIORS, np.array([5.0]), Scaled(np.eye(1)), 1).final.mean
    monkeypatch.setitem(globals(), "GAIN", 2.0)
    after = quiet(FILTERS["EKF"], PRIORS, np.array([5.0]), Scaled(np.eye(1)), 1).final.mean
    assert_array_equal(before[0], [3.0, 2.0])
    assert_array_equal(after[0].round(12), [2.2, 2.0])
