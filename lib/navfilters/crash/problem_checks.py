"""The book's own problems: is a filter lost, is it honest, how far is it from the best?"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np

from navfilters.crash.check import Case, history
from navfilters.models import RangeBearing
from navfilters.papers.perea2007 import Setup, divergence_maps, isotropic, position_error
from navfilters.problems import Problem, in_units, problems, treat
from navfilters.problems.static_fix import static_fix
from navfilters.types import Array, Gaussian

MAY_BE_LOST, ERROR, SURE = 0.05, 2.0, 1.25
"""Of a problem: share of lost runs; error over the best honest one's; NEES over the band's end."""


@cache
def patients() -> dict[str, Problem]:
    """The book's problems at the sizes of its chapter."""
    return problems()


def on_problem(name: str, runs: int) -> Callable[[Any], Iterator[Case]]:
    """The cases of one of the book's problems.

    Parameters
    ----------
    name : str
        A key of ``navfilters.problems.problems()``.
    runs : int

    Returns
    -------
    callable
        filter -> iterator of Case.
    """
    return partial(_on_problem, name, runs)


def _on_problem(name: str, runs: int, filter: Any) -> Iterator[Case]:
    problem = patients()[name]
    outcome = treat(problem, filter, runs)
    label = f"{name}, {runs} runs"
    yield Case(label, "share of runs lost", float(outcome.lost), MAY_BE_LOST)
    yield Case(label, "median error over the best honest", _median(outcome), ERROR)
    yield Case(label, "NEES over the end of its band", float(outcome.nees / outcome.band[1]), SURE)


def _median(outcome: Any) -> float:
    return float(outcome.median) / outcome.reference


def starts(filter: Any) -> Iterator[Case]:
    """First estimates all around the truth, perfect measurements, as in the divergence maps."""
    mean = divergence_maps.starts(8).reshape(-1, 2)
    setup = replace(Setup(), steps=100)
    prior = Gaussian(mean, isotropic(mean, setup.sigma).cov)
    model = RangeBearing(setup.model.R)
    z = np.broadcast_to(setup.z, (setup.steps, 2))
    end = history(filter, prior, z, model).mean[-1]
    gain = position_error(end, setup.x_true) / position_error(mean, setup.x_true)
    fails = ~(gain <= 0.1)
    worst = mean[np.argmax(np.where(np.isfinite(gain), gain, np.inf))]
    label = f"64 starts; the worst is ({worst[0]:.0f}, {worst[1]:.0f})"
    yield Case(label, "share that gains less than a digit", float(fails.mean()), MAY_BE_LOST)


def behind_the_jump(filter: Any) -> Iterator[Case]:
    """A truth on one side of the bearing's jump, a start on the other."""
    R = np.diag([0.01, 1e-4])
    model, truth = RangeBearing(R), np.array([-80.0, -1.5])
    prior = Gaussian(np.array([[-80.0, 1.5]]), 4.0 * np.eye(2)[None])
    z = np.broadcast_to(model.h(truth), (20, 1, 2))
    found = history(filter, prior, z, model)
    off = float(position_error(found.mean[-1, 0], truth))
    yield Case("bearings of -179 and 179 degrees", "distance from the truth", off, 1.0)


def other_units(filter: Any) -> Iterator[Case]:
    """The same problem in kilometres, and with one coordinate in millimetres."""
    problem = static_fix(True, 30)
    before = _end(filter, problem)
    for name, unit in (("kilometres", (1e3, 1e3)), ("one in millimetres", (1e-3, 1.0))):
        changed = _end(filter, in_units(problem, np.array(unit)))
        mean = changed.mean * unit
        off = np.abs(mean - before.mean) / np.sqrt(np.diagonal(before.cov, axis1=1, axis2=2))
        yield Case(f"noisy fix in {name}", "deviations moved", _most(off), 1e-3)


def turned_axes(filter: Any) -> Iterator[Case]:
    """The same problem with the coordinates turned by 30 degrees."""
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    T = np.array([[c, -s], [s, c]])
    problem = static_fix(True, 30)
    prior, _, z = problem.drawn(20)
    before = _end(filter, problem)
    found = history(
        filter, Gaussian(prior.mean @ T.T, T @ prior.cov @ T.T), z, Turned(T, problem.model)
    )
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


def last_bits(filter: Any) -> Iterator[Case]:
    """First estimates that differ in their last bit end at the same place."""
    problem = static_fix(True, 100)
    prior, _, z = problem.drawn(20)
    one = history(filter, prior, z, problem.model)
    nudged = Gaussian(divergence_maps.next_bit(prior.mean), prior.cov)
    other = history(filter, nudged, z, problem.model)
    deviation = np.sqrt(np.abs(np.diagonal(one.cov[-1], axis1=1, axis2=2)))
    off = np.abs(other.mean[-1] - one.mean[-1]) / deviation
    yield Case("noisy fix, starts changed by one bit", "deviations moved", _most(off), 1e-3)


def one_by_one(filter: Any) -> Iterator[Case]:
    """A member alone, last in a batch, and a second time: always the same."""
    problem = static_fix(True, 20)
    prior, _, z = problem.drawn(4)
    batch = history(filter, prior, z, problem.model)
    again = history(filter, Gaussian(prior.mean[::-1], prior.cov), z[:, ::-1], problem.model)
    alone = history(filter, Gaussian(prior.mean[:1], prior.cov), z[:, :1], problem.model)
    deviation = np.sqrt(np.abs(np.diagonal(batch.cov[-1], axis1=1, axis2=2)))
    for name, off in (
        ("members in the other order", again.mean[-1, ::-1] - batch.mean[-1]),
        ("a member alone", alone.mean[-1] - batch.mean[-1, :1]),
    ):
        yield Case(name, "deviations moved", _most(off / deviation[: len(off)]), 1e-6)


def sound_covariances(filter: Any) -> Iterator[Case]:
    """Symmetric and positive definite at every step of a noisy fix."""
    problem = static_fix(True, 100)
    prior, _, z = problem.drawn(20)
    P = history(filter, prior, z, problem.model).cov
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


def _end(filter: Any, problem: Problem) -> Gaussian:
    prior, _, z = problem.drawn(20)
    found = history(filter, prior, z, problem.model)
    return Gaussian(found.mean[-1], found.cov[-1])


def _most(values: Array) -> float:
    return float(values.max()) if np.isfinite(values).all() else np.nan
