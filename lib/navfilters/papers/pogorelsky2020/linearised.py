"""The experiment of Pogorelsky et al. linearised: along its true flight, and in one update."""

from dataclasses import replace
from functools import reduce
from typing import Any, NamedTuple

import numpy as np

from navfilters.estimators.multiplicative import MekfState, mekf_update
from navfilters.numerics import validation
from navfilters.papers.pogorelsky2020.experiment import NOMINAL, Setup
from navfilters.papers.pogorelsky2020.true_flight import Truth
from navfilters.space.frames import ellipsoid_intersection
from navfilters.space.image_measurement import Measurement, SarGeometry
from navfilters.types import Array


class FixedModel(NamedTuple):
    """A model whose residual, H and R are given: for an update that differs in one of them.

    Parameters
    ----------
    y : array (..., m)
        Measured minus expected.
    H : array (..., m, 9)
    R : array (..., m, m)
    """

    y: Array
    H: Array
    R: Array

    def linearize(self, state: MekfState, measurement: Any) -> tuple[Array, Array, Array]:
        """What was given, whatever the state and the measurement.

        Parameters
        ----------
        state : MekfState
        measurement
            Not used.

        Returns
        -------
        tuple of array
            y, H, R.
        """
        return self.y, self.H, self.R


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
        state = MekfState(r, v, NOMINAL, before)
        _, H, R = model.linearize(state, image)
        b = setup.underweighting if k <= setup.underweighted else 0.0
        legs.append(Leg(F, before - F @ P @ F.T, H, R, b * H @ before @ H.T, image, model))
        P = mekf_update(state, image, model, underweighting=b).state.P
    return legs, P
