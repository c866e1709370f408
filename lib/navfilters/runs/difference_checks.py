"""Whether the differences that a model has of its own take batches and sigma points."""

from typing import Any

import numpy as np

from navfilters.numerics.probing import first_member, members, unwritable
from navfilters.types import Gaussian, MeasurementModel

FAR = 200.0
"""More than half a turn, in degrees as in radians: a residual that wraps has to."""


def residual(model: MeasurementModel, prior: Gaussian, m: int) -> None:
    """Check its residual, (z, z_hat) -> (..., m), as of sigma points and of a batch."""
    if not hasattr(model, "residual") or not hasattr(model, "h"):
        return
    own = np.shape(model.R)[:-2]
    with np.errstate(all="ignore"):
        z_hat = np.asarray(model.h(unwritable(first_member(prior.mean))))
        z = z_hat + _several(np.full(m, FAR), 2 * m, own)
        batch = np.broadcast_shapes(z.shape[:-1], own)
        options: dict[str, Any] = {"whole": True, "finite": False}
        members("model.residual", model.residual, (z, z_hat), 2, (m,), batch, own, **options)


def manifold(name: str, model: Any, prior: Gaussian, own: tuple[int, ...]) -> None:
    """Check its retract and its difference, as of sigma points and of a batch."""
    x, (n,), state = first_member(prior.mean), prior.cov.shape[-1:], prior.mean.shape[-1:]
    deviation = np.sqrt(np.diagonal(first_member(prior.cov, 2)))
    options: dict[str, Any] = {"whole": True, "finite": False}
    with np.errstate(all="ignore"):
        dx = _several(deviation, n + len(x), own)
        batch = dx.shape[:-1]
        if hasattr(model, "retract"):
            moved = members(
                f"{name}.retract", model.retract, (x, dx), 2, state, batch, own, **options
            )
            if hasattr(model, "difference"):
                both = moved, x
                members(
                    f"{name}.difference", model.difference, both, 2, (n,), batch, own, **options
                )


def _several(one: np.ndarray, longer: int, own: tuple[int, ...]) -> np.ndarray:
    """More multiples of a vector than any axis is long, in front of the model's batch axes."""
    count = 1 + longer
    near = 1 + 2.0**-10 * np.arange(count)
    return (near[:, None] * one).reshape(count, *(1,) * len(own), -1)
