"""Filters that predict together are filters that fly alone, to the last bit."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from navfilters import Filter, unscented
from navfilters.estimators import AdaptiveNoise, StrongTracking
from navfilters.papers.xiong2009 import ESTIMATORS, VARIANTS, Setup, SideBySide, fly, together

FILTERS = [e.filter for e in ESTIMATORS.values() if not e.knows_thrust]
FILTERS.append(Filter(rule=AdaptiveNoise(memory=True, cap=1e4), form="short"))
FILTERS.append(Filter(rule=StrongTracking(), form="short"))


def whole(state):
    memory = () if state.memory is None else tuple(x for x in state.memory if x is not None)
    return (*state.estimate, *memory)


@pytest.mark.parametrize("setup", [Setup(), together("AC")])
def test_each_is_as_alone(setup):
    setup = replace(setup, burns=((300, 500),), thrust=0.45, perigee=600e3, duration=2000)
    beside = fly(SideBySide(tuple(FILTERS)), setup, range(3), record=lambda state: state)
    for one, flown in zip(FILTERS, beside.states, strict=True):
        alone = fly(one, setup, range(3), record=lambda state: state)
        for found, wanted in zip(whole(flown), whole(alone), strict=True):
            assert_array_equal(found, wanted)


def test_the_estimates_of_all():
    beside, prior = SideBySide(tuple(FILTERS[:2])), VARIANTS["A"].prior
    mean, cov = beside.init(prior).estimate
    assert_array_equal(mean, np.stack([prior.mean] * 2))
    assert_array_equal(cov, np.stack([prior.cov] * 2))


@pytest.mark.parametrize("other", [Filter(unscented), "EKF"])
def test_filters_that_cannot(other):
    with pytest.raises(ValueError, match=r"filters must be .* found"):
        SideBySide((FILTERS[0], other))
