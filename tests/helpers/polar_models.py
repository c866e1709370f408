"""Range and bearing, in every way in which a model may be written."""

from functools import partial
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest

from navfilters import Gaussian, sweep
from navfilters.models import RangeBearing

R = np.diag([0.04, 1e-4])
MANY = R * np.arange(1.0, 6.0)[:, None, None]
PRIORS = Gaussian(np.linspace([28.0, 41.0], [31.0, 38.0], 5), 4 * np.eye(2))
Z = np.array([50.2, 0.92])
POLAR = RangeBearing(np.eye(2))
quiet = partial(sweep, progress=False)
engines = pytest.mark.parametrize("engine", ["numpy", pytest.param("jax", marks=pytest.mark.slow)])


class Polar:
    """Range and bearing, whatever the class that has R."""

    def h(self, x):
        return POLAR.h(x)

    def jacobian(self, x):
        return POLAR.jacobian(x)

    def hessian(self, x):
        return POLAR.hessian(x)


class AsNamedTuple(NamedTuple):
    R: Any
    name: str = "a sensor"
    h = Polar.h
    jacobian = Polar.jacobian
    hessian = Polar.hessian


class AsClass(Polar):
    def __init__(self, R):
        self.R = R


def in_closures(R):
    return SimpleNamespace(
        R=R,
        h=lambda x: POLAR.h(x),
        jacobian=lambda x: POLAR.jacobian(x),
        hessian=lambda x: POLAR.hessian(x),
    )
