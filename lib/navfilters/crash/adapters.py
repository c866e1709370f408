"""Filters of other libraries, one state at a time, in the protocol of this one."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from navfilters.estimators import model_parts
from navfilters.estimators.state import FilterState, first_state, missed
from navfilters.estimators.update import absent
from navfilters.numerics.extras import needed
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
        (f(x), F), or both, and Q (n, n).
    update : callable
        (mean, cov, z (m,), model) -> (mean, cov). ``model`` has h(x) and R (m, m), and may have
        jacobian(x) and residual(z, z_hat). Entries of z that were not measured are NaN.
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
        """A prediction, where there are dynamics, and an update, of every member."""
        z, sensor = model_parts.seen(np.asarray(z, float), sensor, k)
        mean, cov = state.estimate
        m, n = z.shape[-1], mean.shape[-1]
        batch = np.broadcast_shapes(mean.shape[:-1], cov.shape[:-2], z.shape[:-1])
        means = np.broadcast_to(mean, (*batch, n)).reshape(-1, n)
        covs = np.broadcast_to(cov, (*batch, n, n)).reshape(-1, n, n)
        seen = np.broadcast_to(z, (*batch, m)).reshape(-1, m)
        moved = None if dynamics is None else model_parts.at(dynamics, k)
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
        if dynamics is not None:
            x, P = self.predict(x, P, dynamics)
        if kept.size:
            x, P, *told = self.update(x, P, z, sensor)
            if self.innovations:
                y[kept], S[np.ix_(kept, kept)] = np.reshape(told[0], -1), told[1]
        return np.asarray(x, float).reshape(-1), np.asarray(P, float), y, S


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


def from_filterpy(kind: Any, **options: Any) -> Adapted:
    """A filter of filterpy.

    Parameters
    ----------
    kind : class
        ``KalmanFilter``, ``ExtendedKalmanFilter``, ``UnscentedKalmanFilter`` or
        ``CubatureKalmanFilter`` of filterpy.kalman, or a class derived from one.
    **options
        For an unscented one, ``points``: a function of the state's size that gives its sigma
        points, by default Merwe's with alpha 1, beta 2, kappa 3 - n.

    Returns
    -------
    Adapted

    Raises
    ------
    ImportError
        Without filterpy.
    TypeError
        Another class, or an option that it has not.

    Notes
    -----
    Components that were not measured are left out of z, h and R.
    """
    kalman = needed("filterpy.kalman", "filterpy", "from_filterpy")
    if not isinstance(kind, type):
        raise TypeError(f"kind must be a class of filterpy.kalman; found {kind!r}")
    unknown = set(options) - {"points"}
    if unknown:
        raise TypeError(f"unknown options {sorted(unknown)}; from_filterpy has points")
    if issubclass(kind, kalman.ExtendedKalmanFilter):
        return Adapted(_linear_prediction(kind), _extended(kind), True)
    if issubclass(kind, kalman.KalmanFilter):
        return Adapted(_linear_prediction(kind), _linear(kind), True)
    if issubclass(kind, kalman.UnscentedKalmanFilter):
        points = options.get("points", lambda n: kalman.MerweScaledSigmaPoints(n, 1.0, 2.0, 3 - n))
        return _sampled(lambda n, m, **calls: kind(n, m, 1.0, points=points(n), **calls))
    if issubclass(kind, kalman.CubatureKalmanFilter):
        return _sampled(lambda n, m, hx, fx, **calls: _cubature(kind, n, m, hx, fx, calls))
    raise TypeError(f"kind must be one of filterpy's four; found {kind.__name__}")


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


def _linear_prediction(kind: Any) -> Prediction:
    def predict(x: Array, P: Array, dynamics: Any) -> tuple[Array, Array]:
        here = Gaussian(x, P)
        f, F, W = model_parts.transition(dynamics, here, dynamics.Q)
        theirs = kind(dim_x=len(x), dim_z=1)
        theirs.x, theirs.P, theirs.F, theirs.Q = x, P, F, W
        theirs.predict()
        return f, theirs.P

    return predict


def _extended(kind: Any) -> Correction:
    def update(x: Array, P: Array, z: Array, model: Any) -> tuple[Array, ...]:
        z, R, h, jacobian, residual = measured(z, model)
        theirs = kind(dim_x=len(x), dim_z=len(z))
        theirs.x, theirs.P, theirs.R = x, P, R
        theirs.update(z, jacobian, h, residual=residual)
        return theirs.x, theirs.P, theirs.y, theirs.S

    return update


def _linear(kind: Any) -> Correction:
    def update(x: Array, P: Array, z: Array, model: Any) -> tuple[Array, ...]:
        z, R, h, jacobian, residual = measured(z, model)
        theirs = kind(dim_x=len(x), dim_z=len(z))
        theirs.x, theirs.P, theirs.R, theirs.H = x, P, R, jacobian(x)
        theirs.update(theirs.H @ x + residual(z, h(x)))
        return theirs.x, theirs.P, theirs.y, theirs.S

    return update


def _sampled(make: Callable[..., Any]) -> Adapted:
    def predict(x: Array, P: Array, dynamics: Any) -> tuple[Array, Array]:
        def f(state: Array, dt: float) -> Array:
            return model_parts.moved(dynamics, np.reshape(state, -1))

        theirs = make(len(x), 1, hx=lambda s: s[:1], fx=f)
        _, _, W = model_parts.transition(dynamics, Gaussian(x, P), dynamics.Q)
        theirs.x, theirs.P, theirs.Q = x, P, W
        theirs.predict()
        return np.reshape(theirs.x, -1), theirs.P

    def update(x: Array, P: Array, z: Array, model: Any) -> tuple[Array, ...]:
        z, R, h, _, residual = measured(z, model)

        def mean(sigmas: Array, weights: Array) -> Array:
            away = np.array([residual(s, sigmas[0]) for s in sigmas])  # angles have no plain mean
            return sigmas[0] + weights @ away

        theirs = make(len(x), len(z), hx=h, fx=lambda s, dt: s, residual_z=residual, z_mean_fn=mean)
        theirs.x, theirs.P, theirs.Q, theirs.R = x, P, np.zeros_like(P), R
        theirs.predict()  # draws the points again; nothing moves
        theirs.update(z)
        return np.reshape(theirs.x, -1), theirs.P, theirs.y, theirs.S

    return Adapted(predict, update, True)


def _cubature(kind: Any, n: int, m: int, hx: Any, fx: Any, calls: dict) -> Any:
    theirs = kind(n, m, 1.0, hx=hx, fx=fx)
    if "residual_z" in calls:
        residual = calls["residual_z"]
        theirs.residual_z = lambda a, b: residual(a, b).reshape(-1, 1)
    return _Columns(theirs)


class _Columns:
    """Filterpy's cubature filter, which keeps columns where the others keep vectors."""

    def __init__(self, theirs: Any) -> None:
        self.theirs, self.x, self.P, self.Q, self.R = theirs, theirs.x, theirs.P, theirs.Q, theirs.R

    def predict(self) -> None:
        self.theirs.x, self.theirs.P, self.theirs.Q = self.x.reshape(-1, 1), self.P, self.Q
        self.theirs.predict()
        self._take()

    def update(self, z: Array) -> None:
        self.theirs.R = self.R
        self.theirs.update(z.reshape(-1, 1))
        self.y, self.S = self.theirs.y, self.theirs.S
        self._take()

    def _take(self) -> None:
        self.x, self.P = self.theirs.x.reshape(-1), self.theirs.P
