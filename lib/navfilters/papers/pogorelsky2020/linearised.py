"""The experiment of Pogorelsky et al. linearised: along its true flight, and in one update."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any, NamedTuple

import numpy as np

from navfilters.estimators.filter import Filter
from navfilters.estimators.model_parts import at
from navfilters.numerics import validation
from navfilters.papers.pogorelsky2020.experiment import NOMINAL, Setup
from navfilters.papers.pogorelsky2020.true_flight import Truth
from navfilters.space.frames import ellipsoid_intersection
from navfilters.space.image_measurement import Measurement, SarGeometry
from navfilters.space.navigation_state import NavigationState
from navfilters.space.pose import difference, retract
from navfilters.types import Array, Gaussian


@dataclass(frozen=True, eq=False)
class FixedModel:
    """A sensor of which H and R are given, and whose measurement is the residual.

    Parameters
    ----------
    H : array (..., m, 9)
    R : array (..., m, m)
    """

    H: Array
    R: Array

    def h(self, x: Array) -> Array:
        """Zero, (..., m)."""
        return x[..., :1] * np.zeros(self.H.shape[-2])

    def jacobian(self, x: Array) -> Array:
        """H."""
        return self.H

    retract = staticmethod(retract)
    difference = staticmethod(difference)


class Seen(NamedTuple):
    """An image as a filter sees it: what :class:`Altered` is asked to change.

    Parameters
    ----------
    k : int
        Number of the image, from 1.
    state : NavigationState
        What the filter predicts.
    image : Measurement
    geometry : SarGeometry
    """

    k: int
    state: NavigationState
    image: Measurement
    geometry: SarGeometry

    def linearise(self, state: NavigationState | None = None) -> tuple[Array, Array, Array]:
        """Residual (..., 4), H (..., 4, 9) and R + B (..., 4, 4), at the filter's state or another.

        Parameters
        ----------
        state : NavigationState, optional

        Returns
        -------
        tuple of array
        """
        state = self.state if state is None else state
        y, pixel = self.geometry.given(self.image.z)
        x = state.x
        return y - pixel.h(x), pixel.jacobian(x), pixel.noise(x)


@dataclass(frozen=True, eq=False)
class Altered:
    """A filter that is told another residual, H or R than its images'.

    Parameters
    ----------
    filter : Filter
    change : callable
        (Seen) -> (y, H, R).
    """

    filter: Any
    change: Callable[[Seen], tuple[Array, Array, Array]]

    def init(self, prior: Gaussian) -> Any:
        """As of ``filter``."""
        return self.filter.init(prior)

    def predict(self, state: Any, dynamics: Any, k: int = 0) -> Any:
        """As of ``filter``."""
        return self.filter.predict(state, dynamics, k)

    def update(self, state: Any, z: Array, sensor: Any, k: int = 0) -> Any:
        """As of ``filter``, with what was changed."""
        own = NavigationState.of(state.estimate.mean)
        y, H, R = self.change(Seen(k + 1, own, Measurement.of(z), at(sensor, k)))
        return self.filter.update(state, y, FixedModel(H, R), k)

    step = Filter.step


class Leg(NamedTuple):
    """An interval of the true flight and the image at its end, linearised there.

    Parameters
    ----------
    F, Q : array (9, 9)
        Transition and process noise of the interval.
    H : array (4, 9)
    R : array (4, 4)
        Of the measurement, R + B.
    extra : array (4, 4)
        What underweighting adds to R.
    image : Measurement
        Without noise.
    model : SarGeometry
    """

    F: Array
    Q: Array
    H: Array
    R: Array
    extra: Array
    image: Measurement
    model: SarGeometry


def linearised_flight(setup: Setup, flight: Truth, images: int = 72) -> tuple[list[Leg], Array]:
    """The filter along the true flight, without noise and without misalignment.

    Parameters
    ----------
    setup : Setup
    flight : Truth
        Of at least as many intervals.
    images : int

    Returns
    -------
    list of Leg
    array (9, 9)
        Covariance after the last image.

    Raises
    ------
    ValueError
        Fewer than one image, or more than the flight has intervals.
    """
    found = len(flight.times) - 1
    if validation.whole_number("images", images, 1) > found:
        raise ValueError(f"images must be at most the flight's intervals, {found}; found {images}")
    legs, P = list[Leg](), setup.P0
    for k in range(1, images + 1):
        path = setup.orbit.path(flight.x[k - 1], setup.steps)
        F = reduce(lambda done, one: one @ done, setup.orbit.transitions(path))
        before = setup.orbit.propagate(flight.x[k - 1], P, setup.steps)[1]
        r, v = flight.x[k, :3], flight.x[k, 3:]
        model = replace(setup.geometry, T_e_b=flight.T_e_b[k])
        pixel = ellipsoid_intersection(r, model.boresight(NOMINAL))
        image = Measurement(pixel, np.linalg.norm(pixel - r), np.linalg.norm(v))
        state = NavigationState(r, v, NOMINAL)
        _, H, R = Seen(k, state, image, model).linearise()
        b = setup.underweighting if k <= setup.underweighted else 0.0
        legs.append(Leg(F, before - F @ P @ F.T, H, R, b * H @ before @ H.T, image, model))
        estimator = setup.mekf
        P = estimator.update(
            estimator.init(Gaussian(state.x, before)), image.z, model, k - 1
        ).estimate.cov
    return legs, P
