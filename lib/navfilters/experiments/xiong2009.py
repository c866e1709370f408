"""Xiong, Zhang and Liu (2009): navigation by stars and the Earth, through unknown burns."""

import argparse
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from navfilters._extras import command
from navfilters._memory import keep_freed_memory
from navfilters._progress import progress as progress_bar
from navfilters.linalg import right_divide
from navfilters.models.orbit import COASTING, EARTH, Gravity, Orbit, Thrust, perigee_apogee
from navfilters.models.star_earth_sensor import StarEarthSensor
from navfilters.robust import AdaptiveEKF, AdaptiveRobustEKF, ExtendedKalman, RobustEKF
from navfilters.types import Array, Gaussian

ARCSECOND = np.pi / 648000


@dataclass(frozen=True, eq=False)
class Setup:
    """The manoeuvre experiment; change a field with ``dataclasses.replace`` and run again.

    Parameters
    ----------
    gravity : Gravity
        Eq. (36); values not in the text.
    altitude : float
        Height of the first, circular orbit, m.
    inclination : float
        Degrees; not in the text. In Table 1 sigma_z / sigma_y is tan(26 to 27 deg) in every row.
    burns : tuple of (float, float)
        Whole seconds between which the thruster fires.
    perigee : float
        Height of the osculating perigee that the last burn ends with, m.
    thrust : float, optional
        Acceleration while the thruster fires, m/s^2; by default what reaches the perigee.
    stars : tuple
        Directions, inertial; not in the text, but Eq. (44) has them in the pattern of A.
    earth_noise, star_noise : float or array (..., 1)
        Deviations, degrees and arcseconds; each angle has both, independent. An array is one
        setting per leading axis; the trailing 1 is for the seeds.
    p_r, p_v : float
        First error and its deviation in each component, m and m/s: Eqs. (39), (40).
    q_r, q_v : float or array (..., 1)
        Deviation of the process noise of one sub-step, m and m/s: Eq. (41).
    interval, step, duration : int
        Seconds between measurements, of a sub-step (not in the text), and of the run.
    window : int
        The n of Eq. (42): seconds at the end of the run from which an RMS error is taken.
    integrator : {"rk4", "euler"}
        That of the filters; the printed Eq. (35) is "euler".

    References
    ----------
    xiong2009, section 5.
    """

    gravity: Gravity = EARTH
    altitude: float = 500e3
    inclination: float = 27.0
    burns: tuple[tuple[float, float], ...] = ((7293, 8373), (11279, 12068))
    perigee: float = 2000e3
    thrust: float | None = None
    stars: tuple[tuple[float, float, float], ...] = ((1, 0, 1), (0, 1, 0))
    earth_noise: Any = 0.02
    star_noise: Any = 5.0
    p_r: float = 5000.0
    p_v: float = 10.0
    q_r: Any = 2e-5
    q_v: Any = 2e-4
    interval: int = 100
    step: float = 1.0
    duration: int = 20000
    window: int = 2000
    integrator: Literal["rk4", "euler"] = "rk4"

    def __post_init__(self) -> None:
        if not (self.interval > 0 and self.duration % self.interval == 0):
            found = f"{self.interval} and {self.duration}"
            raise ValueError(f"interval must divide duration; found {found}")
        if not (0 < self.step <= 1 and (1 / self.step).is_integer()):
            raise ValueError(f"step must be a second or a whole part of it; found {self.step}")
        if not 1 < self.window <= self.duration:
            raise ValueError(f"window must be 2 to {self.duration} s; found {self.window}")

    @property
    def x0(self) -> Array:
        """The true first state, on the circular orbit at its ascending node: (6,), m and m/s."""
        radius, i = self.gravity.radius + self.altitude, np.deg2rad(self.inclination)
        speed = np.sqrt(self.gravity.mu / radius)
        return np.array([radius, 0.0, 0.0, 0.0, speed * np.cos(i), speed * np.sin(i)])

    @property
    def prior(self) -> Gaussian:
        """The first estimate, x0 minus the error (39), and P0 of (40)."""
        p = np.array([self.p_r] * 3 + [self.p_v] * 3)
        return Gaussian(self.x0 - p, np.diag(p**2))

    @property
    def sigma(self) -> Array:
        """Deviation of each measured angle, rad: both sensors' noise combined."""
        earth, star = np.deg2rad(self.earth_noise), np.asarray(self.star_noise) * ARCSECOND
        return np.hypot(earth, star)

    @property
    def sensor(self) -> StarEarthSensor:
        """The stars' angles, Eq. (38), with R = sigma^2 I."""
        R = self.sigma[..., None, None] ** 2 * np.eye(len(self.stars))
        return StarEarthSensor(np.array(self.stars, float), R)

    def orbit(self, thrust: Thrust = COASTING) -> Orbit:
        """The filters' dynamics, Eqs. (35), (36), (41), with what they know of the thruster."""
        q_r, q_v = (np.asarray(q, float)[..., None, None] ** 2 for q in (self.q_r, self.q_v))
        Q = q_r * np.diag([1.0, 1, 1, 0, 0, 0]) + q_v * np.diag([0.0, 0, 0, 1, 1, 1])
        substeps = round(self.interval / self.step)
        return Orbit(self.gravity, thrust, Q, self.step, substeps, self.integrator)


VARIANTS = {
    "A": Setup(),
    "B": Setup(earth_noise=0.0),
    "C": Setup(q_v=13 * 2e-4),
}
"""Readings of the noise: A both sensors as stated; B 5 arcseconds only and C a larger q_v, both
chosen after seeing what the paper's 203 m needs."""


class Estimator(NamedTuple):
    """One row of the comparison: a filter, whether it is told the thrust, and Table 1's numbers."""

    filter: Any
    knows_thrust: bool = False
    paper: tuple[float, ...] = (np.nan,) * 4


ESTIMATORS = {
    "EKF": Estimator(ExtendedKalman(), paper=(0.2771e6, 2.4096e6, 1.2367e6, 2.7175e6)),
    "REKF": Estimator(RobustEKF(), paper=(0.1382e6, 1.4027e6, 0.7055e6, 1.5762e6)),
    "AEKF": Estimator(AdaptiveEKF(), paper=(1.9091e4, 1.2786e4, 0.6441e4, 2.3863e4)),
    "AREKF": Estimator(AdaptiveRobustEKF(), paper=(126.1731, 143.1503, 69.5699, 203.1050)),
    "EKF with thrust": Estimator(ExtendedKalman(), knows_thrust=True),
}
"""The filters of Table 1 by the paper's names, with its values in m, and one that is told more."""


class Truth(NamedTuple):
    """The true flight: thrust, and states (duration + 1, 6) at whole seconds, m and m/s."""

    thrust: Thrust
    states: Array


def truth(setup: Setup = VARIANTS["A"]) -> Truth:
    """The flight that reaches the stated perigee, by DOP853 at 1e-12, arc by arc.

    Parameters
    ----------
    setup : Setup
        Without burns there is no thrust.

    Returns
    -------
    Truth
        Computed once for each orbit; do not write into it.

    Raises
    ------
    ValueError
        Burns that are not within the run, or a perigee that no thrust up to 12.8 m/s^2 reaches.

    References
    ----------
    xiong2009, section 5. "Height of the perigee raised from 500 km to 2000 km" is read as that of
    the osculating ellipse when the last burn ends; the thrust is along the velocity.
    """
    burns = tuple((start, end) for start, end in setup.burns)
    if burns and not (burns[0][0] >= 0 and burns[-1][1] <= setup.duration):
        raise ValueError(f"burns must be within 0 to {setup.duration} s; found {burns}")
    x0 = tuple(setup.x0.tolist())
    magnitude = setup.thrust if burns else 0.0
    if magnitude is None:
        magnitude = _solved_thrust(setup.gravity, x0, burns, setup.perigee)
    return _truth(setup.gravity, x0, Thrust(magnitude, burns), setup.duration)


@lru_cache(maxsize=16)
def _truth(gravity: Gravity, x0: tuple, thrust: Thrust, duration: int) -> Truth:
    states = _fly(gravity, np.array(x0), thrust, np.arange(duration + 1.0))
    states.setflags(write=False)
    return Truth(thrust, states)


@lru_cache(maxsize=16)
def _solved_thrust(gravity: Gravity, x0: tuple, burns: tuple, perigee: float) -> float:
    """The strength with which the last burn ends at the perigee, m/s^2."""
    start, end = burns[0][0], burns[-1][1]
    before = _fly(gravity, np.array(x0), Thrust(0.0, ()), np.array([0.0, start]))[-1]

    def excess(magnitude: float) -> float:
        x = _fly(gravity, before, Thrust(magnitude, burns), np.array([start, end]))[-1]
        return float(perigee_apogee(x, gravity)[0]) - perigee

    high = 0.1
    while excess(high) < 0 and high < 10:
        high *= 2
    if excess(0.0) > 0 or excess(high) < 0:
        raise ValueError(f"perigee must be reached by a thrust of 0 to {high}; found {perigee}")
    return brentq(excess, 0.0, high, xtol=1e-14)


def _fly(gravity: Gravity, x: Array, thrust: Thrust, times: Array) -> Array:
    """States at the given times, the first of which is that of x; one integration for each arc."""
    orbit, first, last = Orbit(gravity), times[0], times[-1]
    inside = [t for t in np.ravel(thrust.arcs) if first < t < last]
    edges = np.unique([first, *inside, last])
    states = np.empty((len(times), 6))
    for a, b in pairwise(edges):
        strength = thrust.strength((a + b) / 2)
        here = (times >= a) & (times <= b)
        flight = solve_ivp(
            lambda _, x, strength=strength: orbit.derivative(x, strength),
            (a, b),
            x,
            method="DOP853",
            rtol=1e-12,
            atol=1e-9,
            dense_output=True,
        )
        if here.any():
            states[here] = flight.sol(times[here]).T
        x = flight.y[:, -1]
    return states


def noise(seeds: Iterable[int], setup: Setup = VARIANTS["A"]) -> Array:
    """Standard normal noise of each update, seed and star, (updates, seeds, m).

    Parameters
    ----------
    seeds : iterable of int
        Each has its own stream, ``numpy.random.default_rng(seed)``, whatever the others are.
    setup : Setup

    Returns
    -------
    array (updates, seeds, m)
        To be multiplied by ``setup.sigma``.

    Raises
    ------
    ValueError
        No seeds, or something that is not a seed.
    """
    updates, m = setup.duration // setup.interval, len(setup.stars)
    try:
        streams = [np.random.default_rng(seed) for seed in seeds]
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"seeds must be integers of at least 0; found {seeds!r} ({error})"
        ) from None
    if not streams:
        raise ValueError("seeds must be at least one integer; found none")
    return np.stack([stream.standard_normal((updates, m)) for stream in streams], axis=1)


def errors(
    estimator: Any,
    setup: Setup = VARIANTS["A"],
    seeds: Iterable[int] = range(20),
    *,
    knows_thrust: bool = False,
    since: int = 0,
    progress: Callable[[Iterable], Iterable] = iter,
) -> Array:
    """Position error of a filter at every whole second, all seeds in one batch.

    Parameters
    ----------
    estimator : ExtendedKalman, RobustEKF, AdaptiveEKF or AdaptiveRobustEKF
        With any tuning; tuning arrays (..., 1) put their axes in front of the seeds.
    setup : Setup
    seeds : iterable of int
    knows_thrust : bool
        Whether the filter's dynamics have the true thrust.
    since : int
        First second to be kept.
    progress : callable
        Wraps the iterable of updates.

    Returns
    -------
    array (duration + 1 - since, ..., seeds, 3)
        Truth minus estimate, m: of predictions between the measurements, and of the updated
        estimate at their times. Not finite from where a member failed.
    """
    keep_freed_memory()
    flight, sensor, every = truth(setup), setup.sensor, round(1 / setup.step)
    orbit = setup.orbit(flight.thrust if knows_thrust else COASTING)
    v, sigma = noise(seeds, setup), setup.sigma[..., None]
    perfect = sensor.h(flight.states[setup.interval :: setup.interval])
    state = estimator.init(setup.prior)
    path = [state.estimate.mean[None, :3]]
    with np.errstate(all="ignore"):  # a member that fails is not finite in the result
        for k in progress(range(len(perfect))):
            t = k * setup.interval
            interval = orbit.interval(state.estimate.mean, float(t))
            state = estimator.step(state, perfect[k] + sigma * v[k], interval, sensor)
            if t + setup.interval >= since:
                seconds = interval.path[every - 1 :: every, ..., :3]
                path += [seconds[:-1], state.estimate.mean[None, ..., :3]]
    batch = state.estimate.mean.shape[:-1]
    kept = setup.duration + 1 - since
    estimate = np.concatenate([_in_batch(p, batch) for p in path])[-kept:]
    return _in_batch(flight.states[-kept:, :3], batch) - estimate


def _in_batch(path: Array, batch: tuple[int, ...]) -> Array:
    """A path (t, ..., 3) with all batch axes behind that of time."""
    missing = len(batch) + 2 - path.ndim
    path = path.reshape(len(path), *(1,) * missing, *path.shape[1:])
    return np.broadcast_to(path, (len(path), *batch, 3))


def root_mean_square(error: Array) -> Array:
    """sigma_x, sigma_y, sigma_z and their root sum of squares over time, m.

    Parameters
    ----------
    error : array (n + 1, ..., 3)
        Errors at each second of the window, m; or standard deviations, for a bound.

    Returns
    -------
    array (..., 4)

    References
    ----------
    xiong2009, Eqs. (42), (43): n + 1 terms, divided by n - 1 as printed.
    """
    squares = np.sum(error**2, axis=0) / (len(error) - 2)
    total = np.sum(squares, axis=-1, keepdims=True)
    return np.sqrt(np.concatenate([squares, total], axis=-1))


def rms_error(
    filter_name: str,
    variant: str = "A",
    seeds: Iterable[int] = range(20),
    *,
    progress: Callable[[Iterable], Iterable] = iter,
) -> Array:
    """RMS position errors of one filter over the last 2000 s, a row of Table 1 for each seed.

    Parameters
    ----------
    filter_name : str
        A key of ``ESTIMATORS``.
    variant : {"A", "B", "C"}
        The reading of the noise, a key of ``VARIANTS``.
    seeds : iterable of int
        One run each.
    progress : callable
        Wraps the iterable of updates.

    Returns
    -------
    array (seeds, 4)
        sigma_x, sigma_y, sigma_z and sigma_p, m.

    Raises
    ------
    ValueError
        A name that is not known, or bad seeds.

    References
    ----------
    xiong2009, Table 1 and Eqs. (42), (43).
    """
    estimator, setup = _named("filter_name", filter_name, ESTIMATORS), _variant(variant)
    error = errors(
        estimator.filter,
        setup,
        seeds,
        knows_thrust=estimator.knows_thrust,
        since=setup.duration - setup.window,
        progress=progress,
    )
    with np.errstate(all="ignore"):
        return root_mean_square(error)


def position_errors(
    filter_name: str, variant: str = "A", seeds: Iterable[int] = range(20)
) -> Array:
    """Distance between truth and estimate at every whole second, for Figs. 2 to 5.

    Parameters
    ----------
    filter_name : str
        A key of ``ESTIMATORS``.
    variant : {"A", "B", "C"}
        A key of ``VARIANTS``.
    seeds : iterable of int

    Returns
    -------
    array (seeds, duration + 1)
        Metres; the updated estimate's at measurement times.

    Raises
    ------
    ValueError
        A name that is not known, or bad seeds.
    """
    estimator, setup = _named("filter_name", filter_name, ESTIMATORS), _variant(variant)
    error = errors(estimator.filter, setup, seeds, knows_thrust=estimator.knows_thrust)
    with np.errstate(all="ignore"):
        return np.linalg.norm(error, axis=-1).T


def cramer_rao_bound(
    variant: str | Setup = "A",
    *,
    thrust: Literal["known", "unknown"] = "known",
    process_noise: bool = True,
    acceleration: float | None = None,
) -> Array:
    """Smallest deviation of each position component of an unbiased estimate, at each second.

    J_t = (F J_{t-1}^-1 F^T + Q)^-1 + H^T R^-1 H   along the true flight.

    Parameters
    ----------
    variant : str or Setup
        A key of ``VARIANTS``, or a set-up of one noise.
    thrust : {"known", "unknown"}
        Unknown: whoever estimates knows when the thruster fires, but in each sampling interval
        with fire its acceleration is another unknown constant vector: one model of ignorance.
        Whoever knows its direction and that its strength is constant can have far less.
    process_noise : bool
        Without, the limit of the experiment, whose truth has none; with the filters' Q, the limit
        for an orbit that is disturbed as the filters believe.
    acceleration : float, optional
        Deviation of each component of the unknown acceleration, m/s^2, up to 1000. By default the
        true thrust's strength; 100 times as much raises the bound by 2 percent.

    Returns
    -------
    array (duration + 1, 3)
        Metres. ``root_mean_square`` of its window bounds the RMS over seeds of an RMS error.

    Raises
    ------
    ValueError
        An unknown variant or thrust, or an acceleration out of range.

    Notes
    -----
    The classical bound at one flight, with the first estimate as one more measurement: the
    covariance half of a Kalman filter that is linearised at the truth. P0 is that of (40), though
    the first error (39) is not random. An unknown acceleration is appended to
    the state. At measurement times alone, reading A has 650.6 m without and 682.0 m with Q; between
    them the uncertainty is a little larger.
    """
    setup = _variant(variant)
    if thrust not in ("known", "unknown"):
        raise ValueError(f"thrust must be one of ['known', 'unknown']; found {thrust!r}")
    flight, sensor = truth(setup), setup.sensor
    a = flight.thrust.magnitude if acceleration is None else acceleration
    if not 0 <= a <= 1000:  # beyond, doubles do not carry P
        raise ValueError(f"acceleration must be 0 to 1000 m/s^2; found {acceleration}")
    orbit = replace(setup, step=1.0).orbit(flight.thrust if thrust == "known" else COASTING)
    burning = [flight.thrust.strength(t + 0.5) > 0 for t in range(setup.duration)]
    F = np.zeros((setup.duration, 9, 9)) + np.eye(9)
    F[:, :6, :6] = orbit.transitions(flight.states)
    unknown = np.array(burning) & (thrust == "unknown")
    F[:, :6, 6:] = unknown[:, None, None] * np.concatenate([np.eye(3) / 2, np.eye(3)])
    Q = np.pad(orbit.Q if process_noise else np.zeros((6, 6)), (0, 3))
    Phi, W = _since_start(F.reshape(-1, setup.interval, 9, 9), Q)
    H = np.pad(
        sensor.jacobian(flight.states[setup.interval :: setup.interval]), [(0, 0)] * 2 + [(0, 3)]
    )
    P = np.zeros((9, 9))
    P[:6, :6] = setup.prior.cov
    path = [P[None]]
    for k in range(len(H)):
        P[6:], P[:, 6:] = 0, 0  # another acceleration, and nothing known of it
        P[6:, 6:] = a**2 * np.eye(3)
        path.append(Phi[k] @ P @ Phi[k].mT + W[k])
        P_xz = path[-1][-1] @ H[k].T
        K = right_divide(P_xz, H[k] @ P_xz + sensor.R)
        keep = np.eye(9) - K @ H[k]
        P = keep @ path[-1][-1] @ keep.T + K @ sensor.R @ K.T  # Joseph: P may span 20 decades
        path[-1][-1] = P
    return np.sqrt(np.diagonal(np.concatenate(path), axis1=1, axis2=2)[:, :3])


def _since_start(F: Array, Q: Array) -> tuple[Array, Array]:
    """Transition and accumulated noise from each interval's start to each of its seconds."""
    Phi, W = [F[:, 0]], [Q + np.zeros_like(F[:, 0])]
    for step in np.moveaxis(F[:, 1:], 1, 0):
        Phi.append(step @ Phi[-1])
        W.append(step @ W[-1] @ step.mT + Q)
    return np.stack(Phi, axis=1), np.stack(W, axis=1)


def _named(argument: str, name: Any, known: Mapping[str, Any]) -> Any:
    if not isinstance(name, str) or name not in known:
        raise ValueError(f"{argument} must be one of {sorted(known)}; found {name!r}")
    return known[name]


def _variant(variant: Any) -> Setup:
    return variant if isinstance(variant, Setup) else _named("variant", variant, VARIANTS)


def table(variant: str = "A", seeds: Sequence[int] = range(20), **options: Any) -> str:
    """Table 1 beside the paper's: median and range over seeds, of each filter, m.

    Parameters
    ----------
    variant : {"A", "B", "C"}
    seeds : sequence of int
    **options
        Those of ``rms_error``.

    Returns
    -------
    str
        One line for each filter and each of its two sources.
    """
    lines = [f"{'':17}{'':10}" + "".join(f"{f'sigma_{i} (m)':>15}" for i in "xyzp")]
    for name, estimator in ESTIMATORS.items():
        ours = rms_error(name, variant, seeds, **options)
        rows = {"median": np.median(ours, axis=0), "least": ours.min(axis=0)}
        rows |= {"largest": ours.max(axis=0), "paper": estimator.paper}
        for i, (label, row) in enumerate(rows.items()):
            numbers = "".join("-".rjust(15) if np.isnan(x) else f"{x:15.4g}" for x in row)
            lines.append(f"{'' if i else name:17}{label:10}{numbers}")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print Table 1: ``python -m navfilters.experiments.xiong2009 --variant B --seeds 20``.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line by default.
    """
    parser = argparse.ArgumentParser(description="Table 1 of Xiong, Zhang and Liu (2009).")
    parser.add_argument("--variant", choices=sorted(VARIANTS), default="A", help="noise reading")
    parser.add_argument("--seeds", type=int, default=20, help="number of runs")
    chosen = parser.parse_args(arguments)
    if chosen.seeds < 1:
        parser.error(f"--seeds must be at least 1; found {chosen.seeds}")
    text = table(chosen.variant, range(chosen.seeds), progress=progress_bar)
    sys.stdout.write(f"variant {chosen.variant}, {chosen.seeds} seeds\n{text}\n")


if __name__ == "__main__":
    command(main)
