"""Filters of filterpy in the protocol of this library."""

from collections.abc import Callable
from typing import Any

import numpy as np

from navfilters.crash.adapters import Adapted, Correction, Prediction, measured
from navfilters.estimators import model_parts
from navfilters.numerics.extras import needed
from navfilters.types import Array, Gaussian


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


def _cubature(kind: Any, n: int, m: int, hx: Any, fx: Any, calls: dict[Any, Any]) -> Any:
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
