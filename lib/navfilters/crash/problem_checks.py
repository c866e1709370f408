"""The book's own problems: is a filter lost, is it honest, how far is it from the best?"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np

from navfilters.crash.check import Case
from navfilters.crash.subject import Subject
from navfilters.models import RangeBearing
from navfilters.papers.perea2007 import Setup, divergence_maps, isotropic, position_error
from navfilters.problems import Problem, in_units, problems
from navfilters.problems.outcome import History, judge
from navfilters.problems.static_fix import static_fix
from navfilters.types import Array, Gaussian

MAY_BE_LOST, ERROR, SURE = 0.05, 2.0, 1.25
"""Of a problem: share of lost runs; error over the best honest one's; NEES over the band's end."""

DIGIT = 0.1
"""I of Eq. (27), the last error over the first, of a filter that gains a decimal digit."""


class Followed(NamedTuple):
    """What a figure shows of a problem: the problem, how many runs, and what the filter said."""

    problem: Problem
    runs: int
    history: History


class Map(NamedTuple):
    """What a figure shows of the starts: first estimates (k, 2) and I of each, (k,)."""

    mean: Array
    gain: Array


class Swept(NamedTuple):
    """What a figure shows of a sweep: the parameter (k,), I, and I of the exact filter."""

    parameter: Array
    gain: Array
    exact: Array


@cache
def patients() -> dict[str, Problem]:
    """The book's problems at the sizes of its chapter."""
    return problems()


def on_problem(name: str, runs: int) -> Callable[[Subject], Iterator[Case]]:
    """The cases of one of the book's problems.

    Parameters
    ----------
    name : str
        A key of ``navfilters.problems.problems()``.
    runs : int

    Returns
    -------
    callable
        subject -> iterator of Case.
    """
    return partial(_on_problem, name, runs)


def _on_problem(name: str, runs: int, subject: Subject) -> Iterator[Case]:
    problem = patients()[name]
    history = subject.followed(problem, runs)
    outcome = judge(problem, history, runs)
    subject.kept["runs"] = Followed(problem, runs, history)
    label = f"{name}, {runs} runs"
    yield Case(label, "share of runs lost", float(outcome.lost), MAY_BE_LOST)
    yield Case(label, "median error over the best honest", _median(outcome), ERROR)
    yield Case(label, "NEES over the end of its band", float(outcome.nees / outcome.band[1]), SURE)


def _median(outcome: Any) -> float:
    return float(outcome.median) / outcome.reference


def starts(subject: Subject) -> Iterator[Case]:
    """First estimates all around the truth, perfect measurements, as in the divergence maps."""
    mean = divergence_maps.starts(8).reshape(-1, 2)
    setup = replace(Setup(), steps=100)
    prior = Gaussian(mean, isotropic(mean, setup.sigma).cov)
    model = RangeBearing(setup.model.R)
    z = np.broadcast_to(setup.z, (setup.steps, 2))
    end = subject.history(prior, z, model).mean[-1]
    gain = position_error(end, setup.x_true) / position_error(mean, setup.x_true)
    subject.kept["map"] = Map(mean, gain)
    fails = ~(gain <= DIGIT)
    worst = mean[np.argmax(np.where(np.isfinite(gain), gain, np.inf))]
    label = f"64 starts; the worst is ({worst[0]:.0f}, {worst[1]:.0f})"
    yield Case(label, "share that gains less than a digit", float(fails.mean()), MAY_BE_LOST)


def sweeps(subject: Subject) -> Iterator[Case]:
    """I over the deviation of the paper's first estimate, and over the ratio of the noises.

    The deviations are those of priors that contain the truth. The exact filter of the problem
    linearised at the truth says what can be gained.
    """
    setup = replace(Setup(), steps=100)
    deviations = np.geomspace(100.0, 1e6, 13)
    ratios = np.geomspace(1e-3, 1e4, 15)
    mean = np.tile(setup.x0, (len(deviations), 1))
    z = np.broadcast_to(setup.z, (setup.steps, 1, 2))
    sensor = RangeBearing(setup.model.R)
    end = subject.history(isotropic(mean, deviations), z, sensor).mean[-1]
    one = _swept(setup, deviations, deviations, [sensor] * len(deviations), end)
    sensors = [RangeBearing(setup.bearing_variance * np.diag([r**2, 1.0])) for r in ratios]
    prior = isotropic(mean[:1], setup.sigma)
    ends = [subject.history(prior, z, each).mean[-1, 0] for each in sensors]
    other = _swept(setup, ratios, np.full(len(ratios), setup.sigma), sensors, np.array(ends))
    subject.kept["sweeps"] = {"deviation of the start": one, "ratio of the noises": other}
    for name, found in subject.kept["sweeps"].items():
        beyond = found.gain / np.maximum(DIGIT, ERROR * found.exact)
        fails = ~(beyond <= 1)
        worst = found.parameter[np.argmax(np.where(np.isfinite(beyond), beyond, np.inf))]
        label = f"{name}, {len(fails)} values; the worst is {worst:.2g}"
        yield Case(label, "share that gains too little", float(fails.mean()), MAY_BE_LOST)


def _swept(setup: Any, parameter: Array, sigma: Array, sensors: Any, end: Array) -> Swept:
    truth, first = np.array(setup.x_true), position_error(setup.x0, setup.x_true)
    H = sensors[0].jacobian(truth)
    gained = [setup.steps * H.T @ np.linalg.inv(each.R) @ H for each in sensors]
    prior = np.eye(2) / sigma[:, None, None] ** 2
    left = np.linalg.inv(prior + gained) @ prior @ (np.array(setup.x0) - truth)
    gain = position_error(end, setup.x_true) / first
    return Swept(parameter, gain, np.linalg.norm(left, axis=-1) / first)


def behind_the_jump(subject: Subject) -> Iterator[Case]:
    """A truth on one side of the bearing's jump, a start on the other."""
    R = np.diag([0.01, 1e-4])
    model, truth = RangeBearing(R), np.array([-80.0, -1.5])
    prior = Gaussian(np.array([[-80.0, 1.5]]), 4.0 * np.eye(2)[None])
    z = np.broadcast_to(model.h(truth), (20, 1, 2))
    found = subject.history(prior, z, model)
    off = float(position_error(found.mean[-1, 0], truth))
    yield Case("bearings of -179 and 179 degrees", "distance from the truth", off, 1.0)


def other_units(subject: Subject) -> Iterator[Case]:
    """The same problem in kilometres, and with one coordinate in millimetres."""
    problem = static_fix(True, 30)
    before = _end(subject, problem)
    for name, unit in (("kilometres", (1e3, 1e3)), ("one in millimetres", (1e-3, 1.0))):
        changed = _end(subject, in_units(problem, np.array(unit)))
        mean = changed.mean * unit
        off = np.abs(mean - before.mean) / np.sqrt(np.diagonal(before.cov, axis1=1, axis2=2))
        yield Case(f"noisy fix in {name}", "deviations moved", _most(off), 1e-3)


def turned_axes(subject: Subject) -> Iterator[Case]:
    """The same problem with the coordinates turned by 30 degrees."""
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    T = np.array([[c, -s], [s, c]])
    problem = static_fix(True, 30)
    prior, _, z = problem.drawn(20)
    before = _end(subject, problem)
    turned = Gaussian(prior.mean @ T.T, T @ prior.cov @ T.T)
    found = subject.history(turned, z, Turned(T, problem.model))
    mean = found.mean[-1] @ T
    off = np.abs(mean - before.mean) / np.sqrt(np.diagonal(before.cov, axis1=1, axis2=2))
    yield Case("noisy fix, axes turned by 30 degrees", "deviations moved", _most(off), 0.1)


class Turned:
    """Range and bearing of a point whose coordinates are turned."""

    def __init__(self, T: Array, model: RangeBearing) -> None:
        self.T, self.model, self.R = T, model, model.R

    def h(self, x: Array) -> Array:
        """Range and bearing, (..., 2)."""
        return self.model.h(x @ self.T)

    def jacobian(self, x: Array) -> Array:
        """By the turned coordinates, (..., 2, 2)."""
        return self.model.jacobian(x @ self.T) @ self.T.T

    def hessian(self, x: Array) -> Array:
        """By the turned coordinates, (..., 2, 2, 2)."""
        return self.T @ self.model.hessian(x @ self.T) @ self.T.T

    def residual(self, z: Array, z_hat: Array) -> Array:
        """That of the model, (..., 2)."""
        return self.model.residual(z, z_hat)


def last_bits(subject: Subject) -> Iterator[Case]:
    """First estimates that differ in their last bit end at the same place."""
    problem = static_fix(True, 100)
    prior, _, z = problem.drawn(20)
    one = subject.history(prior, z, problem.model)
    nudged = Gaussian(divergence_maps.next_bit(prior.mean), prior.cov)
    other = subject.history(nudged, z, problem.model)
    deviation = np.sqrt(np.abs(np.diagonal(one.cov[-1], axis1=1, axis2=2)))
    off = np.abs(other.mean[-1] - one.mean[-1]) / deviation
    yield Case("noisy fix, starts changed by one bit", "deviations moved", _most(off), 1e-3)


def one_by_one(subject: Subject) -> Iterator[Case]:
    """A member alone, last in a batch, and a second time: always the same."""
    problem = static_fix(True, 20)
    prior, _, z = problem.drawn(4)
    batch = subject.history(prior, z, problem.model)
    again = subject.history(Gaussian(prior.mean[::-1], prior.cov), z[:, ::-1], problem.model)
    alone = subject.history(Gaussian(prior.mean[:1], prior.cov), z[:, :1], problem.model)
    deviation = np.sqrt(np.abs(np.diagonal(batch.cov[-1], axis1=1, axis2=2)))
    for name, off in (
        ("members in the other order", again.mean[-1, ::-1] - batch.mean[-1]),
        ("a member alone", alone.mean[-1] - batch.mean[-1, :1]),
    ):
        yield Case(name, "deviations moved", _most(off / deviation[: len(off)]), 1e-6)


def sound_covariances(subject: Subject) -> Iterator[Case]:
    """Symmetric and positive definite at every step of a noisy fix."""
    problem = static_fix(True, 100)
    prior, _, z = problem.drawn(20)
    P = subject.history(prior, z, problem.model).cov
    size = np.sqrt(np.abs(np.diagonal(P, axis1=-2, axis2=-1)))
    scaled = (
        P
        / np.where(size > 0, size, 1.0)[..., :, None]
        / np.where(size > 0, size, 1.0)[..., None, :]
    )
    label = "noisy fix, 20 runs of 100 updates"
    yield Case(label, "asymmetry", _most(np.abs(scaled - scaled.mT)), 1e-9)
    even = np.where(np.isfinite(scaled).all((-2, -1))[..., None, None], scaled, -np.eye(2))
    lowest = np.linalg.eigvalsh((even + even.mT) / 2)[..., 0]
    yield Case(label, "share not positive definite", float(np.mean(lowest <= 0)), 0.0)


def _end(subject: Subject, problem: Problem) -> Gaussian:
    prior, _, z = problem.drawn(20)
    found = subject.history(prior, z, problem.model)
    return Gaussian(found.mean[-1], found.cov[-1])


def _most(values: Array) -> float:
    return float(values.max()) if np.isfinite(values).all() else np.nan
