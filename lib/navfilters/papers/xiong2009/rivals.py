"""Other answers to an unknown thrust, flown as the paper's filters are."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np

from navfilters.estimators.filter import Filter
from navfilters.estimators.gated_inflation import GatedInflation
from navfilters.estimators.interacting import InteractingModels, Modes
from navfilters.estimators.robust import AdaptiveRobust
from navfilters.estimators.strong_tracking import StrongTracking
from navfilters.papers.xiong2009.experiment import ESTIMATORS, Setup
from navfilters.papers.xiong2009.monte_carlo import measurements
from navfilters.papers.xiong2009.side_by_side import Flown, SideBySide
from navfilters.papers.xiong2009.true_flight import truth
from navfilters.runs.consistency import nees, nis
from navfilters.runs.sweeping import sweep
from navfilters.space.manoeuvring_orbit import SIZES, manoeuvring
from navfilters.types import Array, Gaussian

EKF = Filter(form="short")

IN_BURNS, END, AFTER = slice(73, 141), slice(180, 201), slice(73, 201)
"""Updates from the first that sees fire to 2000 s after the last one; in the last 2000 s; all from
the first that sees fire."""

P_A = 0.4528
"""How large a filter thinks that a component of the thrust may be, m/s^2: the true strength."""


class Course(NamedTuple):
    """What is measured on some flights, z (updates, ..., m), and their states (updates + 1, ..., 6)
    at the first estimate and the updates."""

    z: Array
    states: Array


class Flight(NamedTuple):
    """What is asked of flights, at the first estimate and after each update.

    Parameters
    ----------
    error : array (updates + 1, ..., 6)
        Truth minus estimate, m and m/s.
    nees : array (updates + 1, ...)
        Of these six components.
    nis : array (updates, ...)
    """

    error: Array
    nees: Array
    nis: Array

    @property
    def distance(self) -> Array:
        """Position error, m, (updates + 1, ...)."""
        return np.linalg.norm(self.error[..., :3], axis=-1)

    def rms(self, updates: slice) -> Array:
        """Root mean square of the position error over updates and seeds, m, (...)."""
        return np.sqrt(np.mean(self.distance[updates] ** 2, axis=(0, -1)))


class Rival(NamedTuple):
    """A filter, and what its model says of the thrust.

    Parameters
    ----------
    filter : Filter or InteractingModels
        The latter has two modes: no thrust, and the model that the others say.
    told : bool
        Whether it is told when the engine runs. If not, its model is the same at all times.
    thrust : {"none", "strength", "vector"}
        What of it is in the state; with ``memory``, s, as of ``ManoeuvringOrbit``.
    q_v, q_a : float or array (k, 1, ...)
        Deviation per second of the noise of velocity, m/s, and thrust, m/s^2, beside that of (41).
    """

    filter: Any = EKF
    told: bool = False
    thrust: Literal["none", "strength", "vector"] = "none"
    q_v: Any = 0.0
    q_a: Any = 0.0
    memory: float = np.inf

    def dynamics(self, setup: Setup, arcs: tuple[Any, ...] | None = None) -> Any:
        """Its model of the motion; the arcs that it is told are the true ones by default."""
        if not self.told:
            arcs = ((0, setup.duration),)
        elif arcs is None:
            arcs = truth(setup).thrust.arcs
        loud = {"arcs": arcs, "q_v": self.q_v, "q_a": self.q_a, "memory": self.memory}
        orbit = manoeuvring(setup.orbit(), self.thrust, **loud)
        if isinstance(self.filter, InteractingModels):
            return Modes((replace(orbit, arcs=()), orbit))
        return orbit

    def prior(self, setup: Setup) -> Gaussian:
        """The paper's first estimate, and a thrust of 0 with deviation ``P_A``."""
        first, more = setup.prior, SIZES[self.thrust] - 6
        cov = np.pad(first.cov, (0, more))
        cov[6:, 6:] = P_A**2 * np.eye(more)
        return Gaussian(np.pad(first.mean, (0, more)), cov)


def imm(stay: Array, back: Array) -> InteractingModels:
    """Two EKFs, one for a silent engine and one for an engine that runs.

    Parameters
    ----------
    stay, back : float or array (...)
        Probability that a silent engine stays silent, and that a running one goes on, from one
        update to the next.

    Returns
    -------
    InteractingModels
    """
    stay, back = np.broadcast_arrays(stay, back)
    rows = [[stay, 1 - stay], [1 - back, back]]
    switching = np.moveaxis(np.array(rows), (0, 1), (-2, -1))
    return InteractingModels(EKF, switching, np.array([0.99, 0.01]))


def _ruled(rule: Any) -> Filter:
    return Filter(rule=rule, form="short")


RIVALS = {
    **{name: Rival(ESTIMATORS[name].filter) for name in ("EKF", "REKF", "AEKF", "AREKF")},
    "AREKF, tuned": Rival(_ruled(AdaptiveRobust(alpha=0.1))),
    "gate": Rival(_ruled(GatedInflation(0.99999))),
    "strong tracking": Rival(_ruled(StrongTracking(rho=0.95))),
    "strong tracking, softened": Rival(_ruled(StrongTracking(rho=0.95, beta=5.0))),
    "constant Q": Rival(q_v=0.1),
    "thrust as state": Rival(thrust="vector", q_a=1e-3, memory=100.0),
    "IMM": Rival(imm(0.9999, 0.999), q_v=10.0),
    "IMM, strength": Rival(imm(0.9999, 0.999), thrust="strength"),
    "timed Q": Rival(told=True, q_v=3.0),
    "timed thrust vector": Rival(told=True, thrust="vector", q_a=0.01),
    "timed strength": Rival(told=True, thrust="strength"),
}
"""The paper's filters and others, each with one parameter tuned in reading A by the error at the
end; the chapter on fair comparisons shows the scans."""


def course(
    setup: Setup, seeds: Iterable[int], *, burns: tuple[bool, ...] = (True, False)
) -> Course:
    """Flights with the burns and without them, with the same noise.

    Parameters
    ----------
    setup : Setup
        With burns.
    seeds : iterable of int
    burns : tuple of bool
        Of each flight.

    Returns
    -------
    Course
        z (updates, flights, ..., seeds, m), states (updates + 1, flights, 1, ..., 6); the axes
        between are those of the set-up's noises.
    """
    seeds = list(seeds)
    flights = [setup if fire else replace(setup, burns=()) for fire in burns]
    z = np.stack([measurements(one, seeds) for one in flights], axis=1)
    states = np.stack([truth(one).states[:: setup.interval] for one in flights], axis=1)
    return Course(z, np.expand_dims(states, tuple(range(2, z.ndim - 1))))


def fly_rival(
    rival: Rival, flights: Course, setup: Setup, arcs: tuple[Any, ...] | None = None
) -> Flight:
    """A rival through the flights.

    Parameters
    ----------
    rival : Rival
        Tuning arrays (k, 1, ..., 1), with as many axes as z has between updates and components and
        one more, fly k of it.
    flights : Course
    setup : Setup
        What the filter is told of noise and orbit.
    arcs : tuple, optional
        As of ``Rival.dynamics``.

    Returns
    -------
    Flight
        Batch axes (k, ..., seeds); k is 1 without arrays.
    """
    (flown,) = _fly((rival.filter,), rival, flights, setup, arcs)
    return flown


def fly_rivals(rivals: Mapping[Any, Rival], flights: Course, setup: Setup) -> dict[Any, Flight]:
    """Rivals through the same flights; those of one model predict together where they can.

    Parameters
    ----------
    rivals : mapping
        Name to Rival. One whose deviations are arrays flies alone.
    flights : Course
    setup : Setup
        As of ``fly_rival``.

    Returns
    -------
    dict
        Name to Flight: to the last bit as if each flew alone.
    """
    together, flown = dict[Any, list[Any]](), dict[Any, Flight]()
    for name, rival in rivals.items():
        alone = not isinstance(rival.filter, Filter) or np.ndim(rival.q_v) or np.ndim(rival.q_a)
        together.setdefault((name,) if alone else rival[1:], []).append(name)
    for names in together.values():
        filters = tuple(rivals[name].filter for name in names)
        flown |= zip(names, _fly(filters, rivals[names[0]], flights, setup), strict=True)
    return {name: flown[name] for name in rivals}


def _fly(
    filters: tuple[Any, ...],
    rival: Rival,
    flights: Course,
    setup: Setup,
    arcs: tuple[Any, ...] | None = None,
) -> list[Flight]:
    """Filters of one rival's model."""
    several = len(filters) > 1
    flown = sweep(
        SideBySide(filters) if several else filters[0],
        rival.prior(setup),
        flights.z[:, None],
        setup.sensor,
        z_per_step=True,
        progress=False,
        dynamics=rival.dynamics(setup, arcs),
        record=_all_kept if several else _kept,
    )
    records, found = flown.record if several else (flown.record,), list[Flight]()
    for mean, cov, y, S in records:
        with np.errstate(all="ignore"):
            error = flights.states[:, None] - mean
            found.append(Flight(error, nees(error, cov), nis(y[1:], S[1:])))
    return found


def _all_kept(flown: Flown) -> tuple[Any, ...]:
    return tuple(_kept(state) for state in flown.states)


def _kept(state: Any) -> tuple[Any, ...]:
    mean, cov = state.estimate
    return mean[..., :6], cov[..., :6, :6], state.innovation, state.S
