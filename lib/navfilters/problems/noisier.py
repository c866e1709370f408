"""Dynamics with more process noise than they had."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from navfilters.estimators import model_parts
from navfilters.types import Array


@dataclass(frozen=True, eq=False)
class Noisier:
    """The same motion with Q times a factor, always or in some steps.

    Parameters
    ----------
    dynamics : Dynamics
    factor : float or array (...)
        At least 0.
    when : bool array (steps,), optional
        The steps in which the factor counts; all by default.
    """

    dynamics: Any
    factor: Array = field(metadata={"axes": 0})
    when: Array | None = None

    @property
    def Q(self) -> Array:
        """The noise of the dynamics times the factor, (..., w, w)."""
        return np.asarray(self.factor)[..., None, None] * self.dynamics.Q

    def at(self, k: int) -> Any:
        """The motion of step k, from 0."""
        here = model_parts.at(self.dynamics, k)
        if self.when is not None and not self.when[k]:
            return Noisier(here, np.ones_like(self.factor))
        return Noisier(here, self.factor)

    def __getattr__(self, name: str) -> Any:
        # What else the dynamics have is not changed; what they lack, this lacks.
        if name in ("f", "transition", "propagate", "hessian", "retract", "difference"):
            return getattr(self.dynamics, name)
        raise AttributeError(name)
