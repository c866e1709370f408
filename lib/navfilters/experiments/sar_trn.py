"""Pogorelsky et al. (2020): navigation by SAR images of known terrain, simulated open-loop."""

import argparse
import importlib
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from navfilters import validation
from navfilters._extras import command
from navfilters._progress import progress as progress_bar
from navfilters.attitude import (
    conjugate,
    from_rotation_vector,
    normalized,
    product,
    rotation_vector,
)
from navfilters.consistency import mean_nees, sample_deviation
from navfilters.frames import (
    body_axes,
    east_north_up,
    ellipsoid_intersection,
    enu_covariance,
    geodetic_to_ecef,
)
from navfilters.models.earth_fixed import EARTH_RATE, EarthFixedOrbit
from navfilters.models.gravity import EARTH, Gravity
from navfilters.models.sar_geometry import Measurement, SarGeometry
from navfilters.multiplicative import MekfState, MekfUpdate, mekf_update
from navfilters.types import Array


@dataclass(frozen=True)
class Setup:
    """The open-loop experiment; change a field with ``dataclasses.replace`` and run again.

    Parameters
    ----------
    gravity : Gravity
        Values not in the text.
    rate : float
        Rotation of the Earth, rad/s.
    altitude : float
        Of the circular orbit above the equatorial radius, m: Table 2.
    inclination : float
        Deg: Table 2.
    ascending : bool
        Whether the pass goes north: "ascending to northern Canada".
    target : tuple of float
        Geodetic latitude and longitude that the boresight meets at the start, deg: Houston; not in
        the text.
    look : float
        Nominal look angle, deg, positive to the right; not in the text, PALSAR's.
    squint : float
        Nominal squint angle, deg.
    attitude : {"earth-fixed", "inertial", "constant rate"}
        Which horizontal axes the body keeps: along the Earth-fixed velocity, along the inertial
        velocity, or turned at the mean rate of the first of these over the closed-loop trajectory.
    sigma_r, sigma_v, sigma_mu : float
        First deviations of each component, m, m/s, deg: Table 4.
    psd_v, psd_mu : float
        Power spectral densities of the process noise, m^2/s^3 and rad^2/s: Q_PSD.
    sigma_range, sigma_speed : float
        Deviations of the measured slant range and in-track velocity, m, m/s: Table 3.
    pixel : tuple of float
        Deviations of the pixel's position to the east, the north and upwards at the target, m: D.
        The text says 2 to 8 m, Earth-fixed; these were chosen after seeing the paper's results.
    underweighting : float
        Lear's beta-bar.
    underweighted : int
        The first so many updates are underweighted.
    gamma : float, optional
        Trace rule of Eq. (31) on top of the index rule, m: see ``mekf_update``.
    walk : bool
        Whether the true misalignment takes the random walk that ``psd_mu`` describes.
    interval : float
        Seconds between updates: 72 in 600 s.
    steps : int
        Steps of the propagation in each interval.
    shortest : int
        The flight lasts at least so many intervals, updated or not: 41.67 s.
    integrator : {"rk4", "printed"}
        That of the filter.

    References
    ----------
    pogorelsky2020, sections "Numerical simulation" and "Test cases".
    """

    gravity: Gravity = EARTH
    rate: float = EARTH_RATE
    altitude: float = 691.5e3
    inclination: float = 98.16
    ascending: bool = True
    target: tuple[float, float] = (29.76, -95.37)
    look: float = 34.3
    squint: float = 0.0
    attitude: Literal["earth-fixed", "inertial", "constant rate"] = "earth-fixed"
    sigma_r: float = 1000.0
    sigma_v: float = 10.0
    sigma_mu: float = 0.1
    psd_v: float = 3.5e-11
    psd_mu: float = 3.4e-13
    sigma_range: float = 1.0
    sigma_speed: float = 0.54
    pixel: tuple[float, float, float] = (2.0, 8.0, 1.0)
    underweighting: float = 0.2
    underweighted: int = 10
    gamma: float | None = None
    walk: bool = True
    interval: float = 600 / 72
    steps: int = 10
    shortest: int = 5
    integrator: Literal["rk4", "printed"] = "rk4"

    def __post_init__(self) -> None:
        for name in ("pixel", "target"):  # lists too: a set-up is a key
            object.__setattr__(self, name, tuple(getattr(self, name)))
        known = ("constant rate", "earth-fixed", "inertial")
        if self.attitude not in known:
            raise ValueError(f"attitude must be one of {list(known)}; found {self.attitude!r}")
        for name in ("altitude", "interval"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name} must be positive; found {getattr(self, name)}")
        for name in ("steps", "shortest"):
            validation.whole_number(name, getattr(self, name), 1)
        validation.whole_number("underweighted", self.underweighted, 0)
        for name in NOT_NEGATIVE:
            found, needed = getattr(self, name), (3,) if name == "pixel" else ()
            value = validation.real_array(name, found, "")
            if value.shape != needed or (value < 0).any():
                each = "three numbers" if needed else "a number"
                raise ValueError(f"{name} must be {each} of at least 0; found {found}")
        if self.gamma is not None and not self.gamma >= 0:
            raise ValueError(f"gamma must be None or at least 0 m; found {self.gamma}")

    @property
    def orbit(self) -> EarthFixedOrbit:
        """The filter's dynamics, Eqs. (8)-(12)."""
        Q = np.diag([self.psd_v] * 3 + [self.psd_mu] * 3)
        step = self.interval / self.steps
        return EarthFixedOrbit(self.gravity, self.rate, Q, step, self.integrator)

    @property
    def geometry(self) -> SarGeometry:
        """The measurement, Eqs. (13)-(30), with a body attitude that is yet to be set."""
        R = np.diag([0.0, 0.0, self.sigma_range**2, self.sigma_speed**2])
        D = enu_covariance(self.pixel, *self.target)
        return SarGeometry(np.deg2rad(self.look), np.deg2rad(self.squint), R, D)

    @property
    def P0(self) -> Array:
        """Covariance of the first estimate, (9, 9): Table 4."""
        sigma = [self.sigma_r] * 3 + [self.sigma_v] * 3 + [np.deg2rad(self.sigma_mu)] * 3
        return np.diag(np.square(sigma))


NOT_NEGATIVE = (
    "sigma_r",
    "sigma_v",
    "sigma_mu",
    "psd_v",
    "psd_mu",
    "sigma_range",
    "sigma_speed",
    "pixel",
    "underweighting",
)
NOMINAL = np.array([0.0, 0.0, 0.0, 1.0])
"""The quaternion of no misalignment."""

CASES = {"TC-1": Setup(), "TC-2": Setup(sigma_mu=0.01, underweighting=0.0)}
"""The two test cases of Table 4. Only the first is underweighted."""

PAPER = {
    "TC-1": {"x": (20.0, 98.0), "y": (740.0, 26.0)},
    "TC-2": {"x": (12.0, 98.8), "y": (138.0, 86.2)},
}
"""Deviation at 600 s, m, and by how many percent it fell: what the text gives of each case."""


class Truth(NamedTuple):
    """The true flight at the start and after each interval, the same in every run.

    Parameters
    ----------
    times : array (k + 1,)
        Seconds.
    x : array (k + 1, 6)
        Earth-fixed position, m, and velocity, m/s.
    T_e_b : array (k + 1, 3, 3)
        Attitude of the body, which the filter knows.
    """

    times: Array
    x: Array
    T_e_b: Array


def initial_state(setup: Setup = CASES["TC-1"]) -> Array:
    """Where a circular orbit is when the boresight meets the target.

    The inertial axes are the Earth-fixed ones at this moment: v = v_i - w x r. The argument of
    latitude and the node are solved for.

    Parameters
    ----------
    setup : Setup

    Returns
    -------
    array (6,)
        Earth-fixed position, m, and velocity, m/s.

    Raises
    ------
    ValueError
        A target that no such pass sees.

    References
    ----------
    pogorelsky2020, Table 2. The text gives no state.
    """
    ground = geodetic_to_ecef(*setup.target)
    axes, geometry = east_north_up(*setup.target), setup.geometry
    latitude, longitude = np.deg2rad(setup.target)
    start = latitude if setup.ascending else np.pi - latitude

    def miss(angles: Array) -> Array:
        x = _circular(setup, *angles)
        beam = replace(geometry, T_e_b=_attitude(setup, x)).boresight(NOMINAL)
        return (axes @ (ellipsoid_intersection(x[:3], beam) - ground))[:2]

    overhead = _circular(setup, start, 0.0)
    node = longitude - np.arctan2(overhead[1], overhead[0])
    try:
        found = root(miss, [start, node], tol=1e-13)
    except ValueError:
        found = None  # a beam that misses the Earth
    if found is None or np.abs(found.fun).max() > 1e-3:
        raise ValueError(
            "target must be seen from a circular orbit of altitude, inclination and look angle "
            f"{setup.altitude} m, {setup.inclination} and {setup.look} deg; found {setup.target}"
        )
    return _circular(setup, *found.x)


def _circular(setup: Setup, argument: float, node: float) -> Array:
    """Earth-fixed state on the circular orbit, inertial axes being Earth-fixed."""
    radius, i = setup.gravity.radius + setup.altitude, np.deg2rad(setup.inclination)
    speed = np.sqrt(setup.gravity.mu / radius)
    cos, sin = np.cos, np.sin
    to_node = np.array([cos(node), sin(node), 0.0])
    across = np.array([-sin(node) * cos(i), cos(node) * cos(i), sin(i)])
    r = radius * (cos(argument) * to_node + sin(argument) * across)
    v = speed * (cos(argument) * across - sin(argument) * to_node)
    return np.concatenate([r, v + setup.rate * np.array([r[1], -r[0], 0.0])])


def _attitude(setup: Setup, x: Array) -> Array:
    """T_e^b from states (..., 6), along the velocity that the set-up names."""
    r, v = x[..., :3], x[..., 3:]
    if setup.attitude == "inertial":
        turning = np.stack([-r[..., 1], r[..., 0], np.zeros_like(r[..., 0])], axis=-1)
        v = v + setup.rate * turning
    return body_axes(r, v)


@lru_cache(maxsize=32)
def truth(setup: Setup = CASES["TC-1"], intervals: int = 72) -> Truth:
    """The flight from the start, by Runge-Kutta.

    Parameters
    ----------
    setup : Setup
    intervals : int
        At least 1.

    Returns
    -------
    Truth
        Computed once for each set-up; its arrays are read-only.

    Raises
    ------
    ValueError
        A target that is not seen, or fewer than one interval.

    References
    ----------
    pogorelsky2020, sections "Closed-loop trajectory" and "Open-loop trajectory".
    """
    validation.whole_number("intervals", intervals, 1)
    orbit = replace(setup, integrator="rk4").orbit
    flown = max(intervals, setup.shortest)
    x = orbit.path(initial_state(setup), flown * setup.steps)[:: setup.steps]
    T_e_b = _attitude(setup, x)
    if setup.attitude == "constant rate":
        turned = Rotation.from_matrix(T_e_b[setup.shortest] @ T_e_b[0].T).as_rotvec()
        steps = np.arange(flown + 1)[:, None] / setup.shortest
        T_e_b = Rotation.from_rotvec(steps * turned).as_matrix() @ T_e_b[0]
    flight = (setup.interval * np.arange(flown + 1.0), x, T_e_b)
    for array in flight:
        array.setflags(write=False)
    return Truth(*(array[: intervals + 1] for array in flight))


class Noise(NamedTuple):
    """Standard normal numbers behind each run.

    Parameters
    ----------
    first : array (runs, 9)
        Of the first estimate's errors.
    pixel : array (runs, k, 3)
        Of the pixel's position: east, north, up at the target.
    slant_range, speed : array (runs, k)
        Of the measured range and velocity.
    walk : array (runs, k, 3)
        Of the true misalignment's steps.
    """

    first: Array
    pixel: Array
    slant_range: Array
    speed: Array
    walk: Array


def noise(runs: int | Sequence[int] = 100, intervals: int = 72, seed: int = 0) -> Noise:
    """The random numbers of a Monte Carlo experiment, before they are scaled.

    Parameters
    ----------
    runs : int or sequence of int
        How many runs, or which: run i has the stream ``numpy.random.default_rng([seed, i])``,
        whatever the others are, and a longer flight begins with the numbers of a shorter one.
    intervals : int
    seed : int

    Returns
    -------
    Noise

    Raises
    ------
    ValueError
        No runs, or numbers that are not integers of at least 0.
    """
    indices = range(runs) if isinstance(runs, int | np.integer) else runs
    try:
        streams = [np.random.default_rng([seed, i]) for i in indices]
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"runs and seed must be integers of at least 0; found {runs!r} and {seed!r} ({error})"
        ) from None
    if not streams:
        raise ValueError(f"runs must be at least one; found {runs!r}")
    first = np.stack([stream.standard_normal(9) for stream in streams])
    later = np.stack([stream.standard_normal((intervals, 8)) for stream in streams])
    return Noise(first, later[..., :3], later[..., 3], later[..., 4], later[..., 5:])


def misalignment(setup: Setup, walk: Array) -> Array:
    """The true misalignment at the start, where there is none, and after each interval.

    Parameters
    ----------
    setup : Setup
    walk : array (runs, k, 3)
        Standard normal: ``Noise.walk``.

    Returns
    -------
    array (runs, k + 1, 4)
        Quaternions.

    References
    ----------
    pogorelsky2020, section "MEKF parameters": the process noise of the misalignment accounts for
    noise "in the true data"; whether the true antenna moves open-loop is not stated.
    """
    step = np.sqrt(setup.psd_mu * setup.interval) if setup.walk else 0.0
    q = [np.broadcast_to(NOMINAL, (*walk.shape[:-2], 4))]
    for k in range(walk.shape[-2]):
        turned = product(from_rotation_vector(step * walk[..., k, :]), q[-1])
        q.append(normalized(turned))
    return np.stack(q, axis=-2)


@dataclass(frozen=True, eq=False)
class SimulatedImages:
    """Measurements with simulated errors: what stands in for images in the open loop.

    Parameters
    ----------
    setup : Setup
    flight : Truth
    q_mu : array (runs, k + 1, 4)
        True misalignment.
    noise : Noise

    References
    ----------
    pogorelsky2020, section "Open-loop trajectory".
    """

    setup: Setup
    flight: Truth
    q_mu: Array
    noise: Noise

    def __call__(self, k: int, state: MekfState) -> Measurement:
        """The image after interval k; it does not depend on the state, a focused one would.

        Parameters
        ----------
        k : int
            From 1.
        state : MekfState
            What the filter predicts.

        Returns
        -------
        Measurement
            r_f (runs, 3), slant_range (runs,), speed (runs,).
        """
        setup, x = self.setup, self.flight.x[k]
        model = replace(setup.geometry, T_e_b=self.flight.T_e_b[k])
        r_f = ellipsoid_intersection(x[:3], model.boresight(self.q_mu[:, k]))
        slant_range = np.linalg.norm(r_f - x[:3], axis=-1)
        local = np.asarray(setup.pixel) * self.noise.pixel[:, k - 1]
        # one product per row, not one of matrices: a run's digits must not depend on the batch
        shift = np.sum(local[:, :, None] * east_north_up(*setup.target), axis=1)
        return Measurement(
            r_f + shift,
            slant_range + setup.sigma_range * self.noise.slant_range[:, k - 1],
            np.linalg.norm(x[3:]) + setup.sigma_speed * self.noise.speed[:, k - 1],
        )


@dataclass(frozen=True, eq=False)
class MonteCarlo:
    """What the runs of one case gave.

    Parameters
    ----------
    times : array (t,)
        0, after each update, and the end of a coast, s.
    errors : array (runs, t, 9)
        Truth minus estimate: position, m, velocity, m/s, misalignment as a rotation vector, rad.
    covariances : array (runs, t, 9, 9)
        What the filter believed of them.
    innovations : array (runs, updates, 4)
        Measured minus expected; NaN where there was no measurement.
    S : array (runs, updates, 4, 4)
        What the filter believed of them, underweighting included.
    """

    times: Array
    errors: Array
    covariances: Array
    innovations: Array
    S: Array


def monte_carlo(
    case: str | Setup = "TC-1",
    updates: int = 72,
    runs: int | Sequence[int] = 100,
    seed: int = 0,
    *,
    flight: Truth | None = None,
    measure: Callable[[int, MekfState], Measurement] | None = None,
    update: Callable[..., MekfUpdate] = mekf_update,
    progress: Callable[[Iterable], Iterable] = iter,
) -> MonteCarlo:
    """All runs of a test case in one batch.

    The true flight is the same in every run and its antenna starts without misalignment; drawn are
    the first *estimates*, so that all runs see the same ground, the measurements' errors, and the
    small random walk of the true misalignment.

    Parameters
    ----------
    case : {"TC-1", "TC-2"} or Setup
        A key of ``CASES``, or any set-up.
    updates : int
        72 for 600 s; with 3, at 8.33, 16.67 and 25 s, the filter coasts until 41.67 s.
    runs : int or sequence of int
        How many, or which: see ``noise``.
    seed : int
    flight : Truth, optional
        Another than that of the set-up, which is the default: of as many intervals, at least
        ``updates``, as it is to last.
    measure : callable, optional
        (k, predicted state) -> Measurement of update k, from 1; by default ``SimulatedImages``. A
        NaN in it is an image that was not matched.
    update : callable
        Called as ``mekf_update`` is.
    progress : callable
        Wraps the iterable of intervals.

    Returns
    -------
    MonteCarlo

    Raises
    ------
    ValueError
        An unknown case, bad counts, a flight of fewer intervals than updates, or a set-up whose
        beam leaves the Earth.

    References
    ----------
    pogorelsky2020, Figs. 8 to 11.
    """
    setup = of_case(case)
    validation.whole_number("updates", updates, 1)
    if flight is None:
        flight = truth(setup, max(updates, setup.shortest))
    intervals = len(flight.times) - 1
    if intervals < updates:
        raise ValueError(f"flight must last {updates} intervals, one an update; found {intervals}")
    drawn = noise(runs, intervals, seed)
    q_true = misalignment(setup, drawn.walk)
    measure = SimulatedImages(setup, flight, q_true, drawn) if measure is None else measure
    state = _first_estimate(setup, flight.x[0], q_true[:, 0], drawn.first)
    orbit, geometry, after = setup.orbit, setup.geometry, [(0, state)]
    made: list[MekfUpdate] = []
    for k in progress(range(1, intervals + 1)):
        x = np.concatenate([state.r, state.v], axis=-1)
        x, P = orbit.propagate(x, state.P, setup.steps)
        state = MekfState(x[..., :3], x[..., 3:], state.q_mu, P)
        if k <= updates:
            made.append(
                update(
                    state,
                    measure(k, state),
                    replace(geometry, T_e_b=flight.T_e_b[k]),
                    underweighting=setup.underweighting if k <= setup.underweighted else 0.0,
                    gamma=setup.gamma,
                )
            )
            state = made[-1].state
        if k <= updates or k == intervals:
            after.append((k, state))
    errors = [_error(flight.x[k], q_true[:, k], state) for k, state in after]
    return MonteCarlo(
        flight.times[[k for k, _ in after]],
        np.stack(errors, axis=1),
        np.stack([state.P for _, state in after], axis=1),
        np.stack([each.innovation for each in made], axis=1),
        np.stack([each.S for each in made], axis=1),
    )


def _first_estimate(setup: Setup, x: Array, q_mu: Array, drawn: Array) -> MekfState:
    """The truth without a drawn error, so that truth minus estimate is that error exactly."""
    error = np.sqrt(np.diag(setup.P0)) * drawn
    q = product(from_rotation_vector(-error[:, 6:]), q_mu)
    P = np.broadcast_to(setup.P0, (len(drawn), 9, 9))
    return MekfState(x[:3] - error[:, :3], x[3:] - error[:, 3:6], q, P)


def _error(x: Array, q_mu: Array, state: MekfState) -> Array:
    """Truth minus estimate, (runs, 9)."""
    turned = rotation_vector(product(q_mu, conjugate(state.q_mu)))
    return np.concatenate([x[:3] - state.r, x[3:] - state.v, turned], axis=-1)


def of_case(case: Any) -> Setup:
    """The set-up of a test case.

    Parameters
    ----------
    case : {"TC-1", "TC-2"} or Setup

    Returns
    -------
    Setup

    Raises
    ------
    ValueError
        An unknown case.
    """
    if isinstance(case, Setup):
        return case
    if not isinstance(case, str) or case not in CASES:
        raise ValueError(f"case must be a Setup or one of {sorted(CASES)}; found {case!r}")
    return CASES[case]


def table(case: str = "TC-1", runs: int = 100, seed: int = 0, progress: Callable = iter) -> str:
    """Position at 600 s beside the paper's: deviations, how far they fell, and the NEES.

    Parameters
    ----------
    case : {"TC-1", "TC-2"}
    runs : int
        At least 2.
    seed : int
    progress : callable
        Wraps the iterable of intervals.

    Returns
    -------
    str
    """
    result = monte_carlo(case, runs=runs, seed=seed, progress=progress)
    first = of_case(case).sigma_r
    spread = sample_deviation(result.errors[:, -1], result.covariances[:, -1])
    total = mean_nees(result.errors[:, -1], result.covariances[:, -1])
    lines = [f"{'':6}{'predicted':>11}{'sample (95 %)':>25}{'fell by':>10}{'paper':>18}"]
    for i, axis in enumerate("xyz"):
        low, sample, high = (f"{s[i]:.1f}" for s in (spread.low, spread.sample, spread.high))
        fell = 100 * (1 - spread.predicted[i] / first)
        paper = "{:.0f} m, {} %".format(*PAPER[case][axis]) if axis in PAPER[case] else "-"
        lines.append(
            f"{axis} (m) {spread.predicted[i]:11.1f}{f'{sample} ({low} to {high})':>25}"
            f"{fell:8.1f} %{paper:>18}"
        )
    band = f"{total.low:.1f} to {total.high:.1f}"
    lines.append(f"NEES  {total.mean:11.1f}{f'consistent: {band}':>25}")
    return "\n".join(lines)


def parsed(description: str, arguments: Sequence[str] | None) -> argparse.Namespace:
    """The command line of a Monte Carlo experiment: case, runs and seed.

    Parameters
    ----------
    description : str
        For the help.
    arguments : sequence of str, optional
        Those of the command line by default.

    Returns
    -------
    argparse.Namespace
        ``case``, ``runs`` of at least 2 and ``seed`` of at least 0; anything else ends the program
        with a message.
    """
    parser = _parser(description)
    chosen = parser.parse_args(arguments)
    _counted(parser, chosen, least=2, runs=100)
    return chosen


def _parser(description: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--case", choices=sorted(CASES), default="TC-1", help="test case")
    parser.add_argument("--runs", type=int, help="number of runs; 100 by default")
    parser.add_argument("--seed", type=int, default=0, help="seed of all runs")
    return parser


def _add_product(parser: argparse.ArgumentParser) -> None:
    """What says where the product is and how to read it; None where it is not given."""
    group = parser.add_argument_group("the closed loop on an ALOS PALSAR level-1.0 product")
    group.add_argument(
        "--palsar", metavar="FOLDER", help="with IMG-... and LED-...; 1 run by default"
    )
    group.add_argument("--dem", metavar="FILE", help="GeoTIFF of heights, m")
    group.add_argument(
        "--reference", metavar="FILE", help="GeoTIFF of a geocoded, terrain-corrected SAR image"
    )
    group.add_argument(
        "--reference-unit",
        choices=["dB", "linear"],
        help="of that image, where neither its band nor its pixels tell",
    )
    group.add_argument(
        "--geoid",
        metavar="METRES",
        type=float,
        help="added to the heights (0 by default). Positions are reckoned above the WGS-84 "
        "ellipsoid; most elevation models count from sea level, which lies up to 107 m below and "
        "86 m above it: an error of that size in height is one of the same order in position",
    )
    group.add_argument("--polarisation", choices=["HH", "HV", "VH", "VV"], help="which of several")
    group.add_argument(
        "--records",
        metavar=("FIRST", "LAST"),
        type=int,
        nargs=2,
        help="only these signal records, from 0, half-open: where the pulse rate changes",
    )
    group.add_argument(
        "--clock-offset", metavar="SECONDS", type=float, help="added to the times of the lines"
    )


def _counted(
    parser: argparse.ArgumentParser, chosen: argparse.Namespace, least: int, runs: int
) -> None:
    """End the program unless runs, by default so many, and seed are large enough."""
    chosen.runs = runs if chosen.runs is None else chosen.runs
    if chosen.runs < least or chosen.seed < 0:
        parser.error(
            f"--runs must be at least {least} and --seed at least 0; found {chosen.runs}, "
            f"{chosen.seed}"
        )


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table: ``python -m navfilters.experiments.sar_trn --case TC-1``.

    With ``--closed-loop`` this is the command of ``navfilters.experiments.sar_closed_loop``; with
    ``--closed-loop --palsar FOLDER --dem FILE --reference FILE`` that loop runs on a PALSAR
    product: see ``navfilters.experiments.palsar_loop``.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line by default.
    """
    parser = _parser("Monte Carlo of Pogorelsky et al.: open-loop, closed-loop, or on real data.")
    parser.add_argument(
        "--closed-loop", action="store_true", help="form and match images instead of drawing errors"
    )
    _add_product(parser)
    chosen = parser.parse_args(arguments)
    options = (
        "dem",
        "reference",
        "reference_unit",
        "geoid",
        "polarisation",
        "records",
        "clock_offset",
    )
    given = [name for name in options if getattr(chosen, name) is not None]
    if chosen.palsar is None and given:
        parser.error(f"--{given[0].replace('_', '-')} must come with --palsar")
    if chosen.palsar is not None:
        needed = ("closed_loop", "dem", "reference")
        if absent := [name.replace("_", "-") for name in needed if not getattr(chosen, name)]:
            parser.error(f"--palsar must come with --{', --'.join(absent)}")
        _counted(parser, chosen, least=1, runs=1)
        sys.stdout.write(f"{_on_product(chosen)}\n")
        return
    _counted(parser, chosen, least=2, runs=100)
    if chosen.closed_loop:
        closed = importlib.import_module("navfilters.experiments.sar_closed_loop")
        closed.main([f"--{name}={getattr(chosen, name)}" for name in ("case", "runs", "seed")])
        return
    text = table(chosen.case, chosen.runs, chosen.seed, progress_bar)
    sys.stdout.write(f"{chosen.case}, {chosen.runs} runs, 1-sigma position at 600 s\n{text}\n")


def _on_product(chosen: argparse.Namespace) -> str:
    """The table of a product; what is wrong with its files ends the program with a message."""
    try:
        return importlib.import_module("navfilters.experiments.palsar_loop").report(
            chosen.palsar,
            chosen.dem,
            chosen.reference,
            chosen.case,
            chosen.runs,
            chosen.seed,
            geoid=chosen.geoid or 0.0,
            unit=chosen.reference_unit,
            polarisation=chosen.polarisation,
            records=chosen.records,
            clock_offset=chosen.clock_offset or 0.0,
            progress=progress_bar,
        )
    except (ValueError, OSError, ImportError) as error:
        sys.exit(f"{error}")


if __name__ == "__main__":
    command(main)
