"""Systems in discrete time whose noises need not be additive."""

from navfilters.estimators.discrete.models import DiscreteDynamics, DiscreteSensor
from navfilters.estimators.discrete.system import DiscreteSystem

__all__ = ["DiscreteDynamics", "DiscreteSensor", "DiscreteSystem"]
