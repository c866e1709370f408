"""Filters on a real flight: vague starts, what is kept of a run, and how it is judged."""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from navfilters.runs import sweep
from navfilters.tracking.least_squares import DRAG, LEAK_RATE, Solution, solve
from navfilters.tracking.legs import BIASES, LEAK
from navfilters.tracking.orbit import orbit
from navfilters.tracking.sequential import Sequence, sequence, state_of
from navfilters.tracking.w3b import Flight
from navfilters.types import Array, Gaussian

STARTS = np.array([1e4, 1e5, 1e6])
"""Deviations of a first position, m; of a first velocity, 1e-4 /s times as much."""

LEAK_DEVIATION = 1e-5
"""Of each component of an unknown leak, m/s^2."""

BIAS_DEVIATIONS = np.array([200.0, *np.radians([0.1, 0.1])])
"""Of range, m, and of azimuth and elevation, rad, about the file's values."""


class Kept(NamedTuple):
    """What is kept of a state.

    Parameters
    ----------
    mean : array (..., n)
    spread : array (...)
        Square root of the trace of the position's covariance, m.
    innovation, variance : array (...)
        Of the last number; the innovation NaN where it was hidden.
    """

    mean: Array
    spread: Array
    innovation: Array
    variance: Array


def kept(state: Any) -> Kept:
    """What is kept of a filter's state."""
    mean, cov = state.estimate
    spread = np.sqrt(np.trace(cov[..., :3, :3], axis1=-2, axis2=-1))
    if state.innovation is None:
        nothing = np.full(spread.shape, np.nan)
        return Kept(mean, spread, nothing, nothing)
    return Kept(mean, spread, state.innovation[..., 0], state.S[..., 0, 0])


@dataclass(frozen=True, eq=False)
class Trial:
    """A flight, its reference and its numbers.

    Parameters
    ----------
    flight : Flight
    reference : Solution
        By all measurements at once, with a leak that does not grow.
    truth : array (K, 9)
        Position, velocity and leak of the reference at each number.
    sequence : Sequence
        With the drag of the reference and without light, which does not matter.
    first : array (n,)
        The reference's state at the epoch.
    """

    flight: Flight
    reference: Solution
    truth: np.ndarray
    sequence: Sequence
    first: np.ndarray

    def starts(self, scale: Array, draws: int, *, leak: Array = True, seed: int = 0) -> Gaussian:
        """Vague starts: drawn about the reference, with no leak and the file's biases.

        Parameters
        ----------
        scale : float or array (...)
            Deviations of the first position, m, as in ``STARTS``.
        draws : int
        leak : bool or bool array (...)
            Whether a leak is allowed for.
        seed : int

        Returns
        -------
        Gaussian
            (..., draws) members; the same draws for every scale.
        """
        scale, leak = np.broadcast_arrays(np.asarray(scale, float), leak)
        n = len(self.first)
        deviation = np.zeros((*scale.shape, 1, n))
        deviation[..., :3] = scale[..., None, None]
        deviation[..., 3:6] = 1e-4 * scale[..., None, None]
        deviation[..., LEAK] = LEAK_DEVIATION * leak[..., None, None]
        assumed = self.flight.problem.deviation
        deviation[..., BIASES:] = np.tile(BIAS_DEVIATIONS / assumed, (n - BIASES) // 3)
        drawn = np.random.default_rng(seed).standard_normal((draws, 6))
        mean = np.zeros((*scale.shape, draws, n))
        mean[..., :6] = self.first[:6] + drawn * deviation[..., :6]
        mean[..., BIASES:] = state_of(self.flight.start, assumed)[BIASES:]
        return Gaussian(mean, deviation[..., None] ** 2 * np.eye(n))

    def fly(
        self,
        estimator: Any,
        starts: Gaussian,
        *,
        density: Array = 0.0,
        hidden: Array = -1,
        steps: int | None = None,
        **how: Any,
    ) -> Kept:
        """A filter through the flight.

        Parameters
        ----------
        estimator : Filter
        starts : Gaussian
        density : float or array (...)
            Of a white acceleration, m^2/s^3.
        hidden : int or int array (...)
            A station that is not seen; -1 for none.
        steps : int, optional
            The first numbers alone.
        **how
            As of ``sweep``: workers, progress.

        Returns
        -------
        Kept
            After each number, (K, ...). Where one was hidden the mean is the prediction.
        """
        model, dynamics = self.sequence.model, self.sequence.noisy(density)
        if not np.ndim(hidden):  # all members see the same
            z = self.sequence.without([hidden])[:steps, 0]
        else:
            axes = np.broadcast_shapes(np.shape(hidden), np.shape(density), starts.mean.shape[:-1])
            hidden = np.reshape(hidden, (1,) * (len(axes) - np.ndim(hidden)) + np.shape(hidden))
            z = self.sequence.without(hidden)[:steps]
        flown = sweep(
            estimator, starts, z, model, dynamics=dynamics, z_per_step=True, record=kept, **how
        )
        return Kept(*(part[1:] for part in flown.record))

    def errors(self, flown: Kept) -> np.ndarray:
        """Distance from the reference after each number, m, (K, ...)."""
        position = flown.mean[..., :3]
        truth = self.truth[: len(position), :3]
        truth = truth.reshape(len(position), *(1,) * (position.ndim - 2), 3)
        return np.linalg.norm(position - truth, axis=-1)

    def surprises(self, flown: Kept, station: int) -> tuple[np.ndarray, np.ndarray]:
        """Measured minus expected of a hidden station, in its deviations, and which numbers.

        Parameters
        ----------
        flown : Kept
        station : int

        Returns
        -------
        surprises : array (k, ...)
        rows : int array (k,)
        """
        rows = np.flatnonzero(self.sequence.station == station)
        found = []
        for k in rows:
            sensor = self.sequence.model.at(int(k))
            found.append(sensor.residual(self.sequence.z[k], sensor.h(flown.mean[k]))[..., 0])
        return np.array(found), rows


def trial(flight: Flight, start: Array | None = None) -> Trial:
    """The reference of a flight, and the flight for filters.

    Parameters
    ----------
    flight : Flight
    start : array (n,), optional
        Where to begin to look for the reference; by default at the file's.

    Returns
    -------
    Trial
    """
    problem = flight.problem
    start = np.array(flight.start if start is None else start)
    free = np.ones(problem.size, bool)
    free[LEAK_RATE], start[LEAK_RATE] = False, 0.0
    reference = solve(problem, start, free=free)
    found = reference.parameters
    forces = replace(problem.forces, drag=found[DRAG.start], radiation=0.0)
    first = state_of(found, problem.deviation)
    states = orbit(replace(forces, leak=first[LEAK]), first[:6], problem.observations.time)
    numbers = sequence(replace(problem, forces=forces), np.linalg.norm(states[:, :3], axis=-1))
    row = np.searchsorted(problem.observations.time, numbers.time)
    leak = np.broadcast_to(first[LEAK], (len(row), 3))
    return Trial(flight, reference, np.hstack([states[row], leak]), numbers, first)
