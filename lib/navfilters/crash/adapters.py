"""Filters of other libraries, one state at a time, in the protocol of this one."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from navfilters.estimators import model_parts
from navfilters.estimators.state import FilterState, first_state, missed
from navfilters.estimators.update import absent
from navfilters.types import Array, Gaussian

Prediction = Callable[[Array, Array, Any], tuple[Array, Array]]
Correction = Callable[[Array, Array, Array, Any], tuple[Array, ...]]


@dataclass(frozen=True)
class Adapted:
    """A filter of one state, run over the members of a batch.

    Parameters
    ----------
    predict : callable
        (mean (n,), cov (n, n), dynamics) -> (mean, cov). ``dynamics`` has f(x), transition(x) ->
        (f(x), F), or both, and Q (n, n): what is added to the covariance in this step.
    update : callable
        (mean, cov, z (m,), model) -> (mean, cov). ``model`` has h(x) and R (m, m), at this mean if
        it depends on the state, and may have jacobian(x) and residual(z, z_hat). Entries of z that
        were not measured are NaN.
    innovations : bool
        Whether ``update`` also returns innovation (k,) and S (k, k) of the k components that were
        measured: (mean, cov, innovation, S).
    """

    predict: Prediction
    update: Correction
    innovations: bool = False

    def init(self, prior: Gaussian) -> FilterState:
        """The state before any step."""
        return first_state(prior)

    def step(
        self, state: FilterState, z: Array, sensor: Any, dynamics: Any = None, k: Array = 0
    ) -> FilterState:
        """A prediction, where there are dynamics, and an update, of every member.

        ValueError for models with batch axes, which one state at a time cannot have.
        """
        z, sensor = model_parts.seen(np.asarray(z, float), sensor, k)
        mean, cov = state.estimate
        m, n = z.shape[-1], mean.shape[-1]
        batch = np.broadcast_shapes(mean.shape[:-1], cov.shape[:-2], z.shape[:-1])
        means = np.broadcast_to(mean, (*batch, n)).reshape(-1, n)
        covs = np.broadcast_to(cov, (*batch, n, n)).reshape(-1, n, n)
        seen = np.broadcast_to(z, (*batch, m)).reshape(-1, m)
        moved = None if dynamics is None else model_parts.at(dynamics, k)
        for name, model, noise in (("model", sensor, "R"), ("dynamics", moved, "Q")):
            if np.ndim(getattr(model, noise, 0)) > 2:
                raise ValueError(
                    f"{name} must have no batch axes for a filter of one state at a time; found "
                    f"{name}.{noise} of shape {np.shape(getattr(model, noise))}"
                )
        with warnings.catch_warnings():  # one per member and step would bury the report
            warnings.simplefilter("ignore")
            new = [self._one(*each, sensor, moved) for each in zip(means, covs, seen, strict=True)]
        mean, cov, y, S = (
            np.array(parts).reshape(*batch, *parts[0].shape) for parts in zip(*new, strict=True)
        )
        told = (y, S) if self.innovations else (None, None)
        return FilterState(Gaussian(mean, cov), missed(state, absent(z)), None, *told)

    def _one(self, x: Array, P: Array, z: Array, sensor: Any, dynamics: Any) -> tuple[Array, ...]:
        """Mean, covariance, innovation and S of a member, the last two NaN where not measured."""
        x, P, kept = x.copy(), P.copy(), np.flatnonzero(~np.isnan(z))
        y, S = np.full(z.shape, np.nan), np.full(z.shape * 2, np.nan)
        shapes = x.shape, P.shape
        if dynamics is not None:
            x, P = self.predict(x, P, _additive(dynamics, x, P))
        if kept.size:
            x, P, *told = self.update(x, P, z, _measuring(sensor, np.reshape(x, -1)))
            if self.innovations:
                y[kept], S[np.ix_(kept, kept)] = np.reshape(told[0], -1), told[1]
        found = np.asarray(x, float).reshape(-1), np.asarray(P, float)
        if (found[0].shape, found[1].shape) != shapes:
            raise ValueError(
                f"predict and update must return mean and cov of shapes {shapes[0]} and "
                f"{shapes[1]}; found {found[0].shape} and {found[1].shape}"
            )
        return *found, y, S


class _With:
    """A model with some of its attributes replaced."""

    def __init__(self, model: Any, **replaced: Any) -> None:
        self.__dict__.update(replaced)
        self._model = model

    def __getattr__(self, name: str) -> Any:
        if name == "_model":  # while it is unpickled
            raise AttributeError(name)
        return getattr(self._model, name)


def _additive(dynamics: Any, x: Array, P: Array) -> Any:
    """Dynamics whose Q is what their noise amounts to at the end of this step."""
    if not hasattr(dynamics, "propagate"):
        return dynamics
    _, _, W = model_parts.transition(dynamics, Gaussian(x, P), dynamics.Q)

    def transition(x: Array) -> tuple[Array, Array]:
        return model_parts.transition(dynamics, Gaussian(x, P), dynamics.Q)[:2]

    return _With(None, f=partial(model_parts.moved, dynamics), transition=transition, Q=W)


def _measuring(model: Any, x: Array) -> Any:
    """A sensor whose R is that of this state."""
    if not hasattr(model, "noise"):
        return model
    return _With(model, R=model_parts.noise(model, x))


def from_functions(
    predict: Prediction, update: Correction, *, innovations: bool = False
) -> Adapted:
    """A filter that is two functions of one state.

    Parameters
    ----------
    predict, update : callable
        As of :class:`Adapted`.
    innovations : bool
        Whether ``update`` returns its innovations, too, for a picture of the NIS.

    Returns
    -------
    Adapted

    Raises
    ------
    TypeError
        What cannot be called.
    """
    for name, function in (("predict", predict), ("update", update)):
        if not callable(function):
            raise TypeError(f"{name} must be a function; found {function!r}")
    return Adapted(predict, update, innovations)


def measured(z: Array, model: Any) -> tuple[Array, Array, Any, Any, Any]:
    """What of a measurement there is, with the model of that alone.

    Parameters
    ----------
    z : array (m,)
        NaN where it was not measured.
    model : MeasurementModel

    Returns
    -------
    tuple
        z (k,), R (k, k), h, jacobian and residual of the components that were measured.
    """
    kept = ~np.isnan(z)
    R = model.R[np.ix_(kept, kept)]

    def residual(a: Array, b: Array) -> Array:
        whole = np.zeros((2, len(kept)))
        whole[:, kept] = np.reshape(a, -1), np.reshape(b, -1)
        return model_parts.residual(model, *whole)[kept]

    return (
        z[kept],
        R,
        lambda x: model.h(np.reshape(x, -1))[kept],
        lambda x: model_parts.jacobian(model, np.reshape(x, -1))[kept],
        residual,
    )
