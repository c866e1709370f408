"""Predictors and updaters of Stone Soup in the protocol of this library."""

from collections.abc import Callable
from typing import Any

import numpy as np

from navfilters.crash.adapters import Adapted, measured
from navfilters.estimators import model_parts
from navfilters.numerics.extras import needed
from navfilters.types import Array, Gaussian


def from_stonesoup(predictor: Callable[..., Any], updater: Callable[..., Any]) -> Adapted:
    """A filter of Stone Soup.

    Parameters
    ----------
    predictor : callable
        transition model -> predictor: a class such as ``ExtendedKalmanPredictor``, or a
        ``functools.partial`` of one with its options.
    updater : callable
        measurement model -> updater: a class such as ``ExtendedKalmanUpdater``, or a partial.

    Returns
    -------
    Adapted

    Raises
    ------
    ImportError
        Without Stone Soup.
    TypeError
        What cannot be called.

    Notes
    -----
    Angles are counted from the expected measurement on, so that neither their differences nor the
    means of sigma points meet a jump. Components that were not measured are left out.
    """
    needed("stonesoup.types", "stonesoup", "from_stonesoup")
    for name, made in (("predictor", predictor), ("updater", updater)):
        if not callable(made):
            raise TypeError(f"{name} must be a class of Stone Soup or a partial; found {made!r}")

    def predict(x: Array, P: Array, dynamics: Any) -> tuple[Array, Array]:
        new = predictor(_Transition(dynamics, x, P)).predict(_state(x, P))
        return _numbers(new)

    def update(x: Array, P: Array, z: Array, model: Any) -> tuple[Array, ...]:
        from stonesoup.types.detection import Detection
        from stonesoup.types.hypothesis import SingleHypothesis
        from stonesoup.types.prediction import GaussianStatePrediction

        sensor = _Sensor(model, x, z)
        seen = Detection(sensor.z[:, None], measurement_model=sensor)
        pair = SingleHypothesis(GaussianStatePrediction(x[:, None], P), seen)
        new = _numbers(updater(sensor).update(pair))
        expected, S = _numbers(pair.measurement_prediction)
        return *new, sensor.z - expected, S

    return Adapted(predict, update, True)


def _state(x: Array, P: Array) -> Any:
    from stonesoup.types.state import GaussianState

    return GaussianState(x[:, None], P)


def _numbers(state: Any) -> tuple[Array, Array]:
    return np.array(state.state_vector, float).reshape(-1), np.array(state.covar, float)


def _columns(values: Array) -> Any:
    """(n,) or (k, n) as Stone Soup's vectors, which stand upright."""
    from stonesoup.types.array import StateVector, StateVectors

    return StateVector(values[0][:, None]) if len(values) == 1 else StateVectors(values.T)


def _rows(state: Any) -> Array:
    return np.asarray(state.state_vector, float).T


class _Transition:
    """Dynamics as a transition model; their noise is that of the whole step, from x on."""

    def __init__(self, dynamics: Any, x: Array, P: Array) -> None:
        self.ndim_state, self._dynamics = len(x), dynamics
        _, self._F, self._Q = model_parts.transition(dynamics, Gaussian(x, P), dynamics.Q)

    def function(self, state: Any, noise: Any = False, **_: Any) -> Any:
        return _columns(model_parts.moved(self._dynamics, _rows(state)))

    def jacobian(self, state: Any, **_: Any) -> Array:
        return self._F

    def matrix(self, **_: Any) -> Array:
        return self._F

    def covar(self, **_: Any) -> Array:
        return self._Q


class _Sensor:
    """A sensor as a measurement model of what was measured."""

    def __init__(self, model: Any, x: Array, z: Array) -> None:
        z, self._R, self._h, self._jacobian, self._residual = measured(z, model)
        self.ndim_state, self.ndim_meas, self._x = len(x), len(z), x
        self._expected = self._h(x)
        self.z = self._from_expected(z)

    def _from_expected(self, z: Array) -> Array:
        return self._expected + self._residual(z, self._expected)

    def function(self, state: Any, noise: Any = False, **_: Any) -> Any:
        return _columns(np.array([self._from_expected(self._h(x)) for x in _rows(state)]))

    def jacobian(self, state: Any, **_: Any) -> Array:
        return self._jacobian(_rows(state)[0])

    def matrix(self, **_: Any) -> Array:
        return self._jacobian(self._x)

    def covar(self, **_: Any) -> Array:
        return self._R
