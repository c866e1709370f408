"""What depends on the number of the step: as in a direct loop."""

from dataclasses import dataclass
from functools import partial

import naive
import numpy as np
import pytest
from naive import covariances
from numpy.testing import assert_allclose

from navfilters import FILTERS, Filter, Gaussian, SweepError, run, sweep
from navfilters.estimators.robust import AdaptiveRobust
from navfilters.models import Linear
from navfilters.runs import records

engines = pytest.mark.parametrize("engine", ["numpy", pytest.param("jax", marks=pytest.mark.slow)])
quiet = partial(sweep, progress=False)


def assert_close(got, wanted):
    """To 1e-12 of the largest element."""
    for ours, theirs in zip(got, wanted, strict=True):
        assert_allclose(ours, theirs, rtol=0, atol=1e-12 * np.abs(theirs).max())


# --- the number of the step ---------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Cart:
    """x = (place, speed), pushed in some of the steps: a thruster that fires at known times."""

    push: np.ndarray  # (steps,)
    Q: np.ndarray

    def at(self, k):
        return Pushed(self.push[k], self.Q)


@dataclass(frozen=True, eq=False)
class Pushed:
    push: float
    Q: np.ndarray

    def transition(self, x):
        xp = x.__array_namespace__()
        F = xp.asarray([[1.0, 1.0], [0.0, 1.0]])
        return (F @ x[..., None])[..., 0] + self.push * xp.asarray([0.5, 1.0]), F


def pushed(steps=7, count=5):
    rng = np.random.default_rng(0)
    prior = Gaussian(rng.normal(size=(count, 2)), covariances(rng, (count,), 2))
    dynamics = Cart(np.where(np.arange(steps) % 3 == 1, 4.0, 0.0), 0.01 * np.eye(2))
    sensor = Linear(np.array([[1.0, 0.0]]), np.array([[0.1]]))
    return prior, rng.normal(size=(steps, count, 1)), dynamics, sensor, steps


@engines
@pytest.mark.parametrize("filter_", [Filter(), Filter(rule=AdaptiveRobust())])
def test_a_swept_filter_knows_the_step(filter_, engine):
    """The adaptive robust filter's first step is compiled on its own."""
    prior, z, dynamics, sensor, steps = pushed()
    options = {"dynamics": dynamics, "z_per_step": True, "record": records.estimate}
    got = quiet(filter_, prior, z, sensor, steps, **options, engine=engine, chunk=2)
    state, states = filter_.init(prior), [prior]
    for k in range(steps):
        state = filter_.step(state, z[k], sensor, Pushed(dynamics.push[k], dynamics.Q))
        states.append(state.estimate)
    assert_close(got.final, state.estimate)
    assert_close(got.record, map(np.stack, zip(*states, strict=True)))
    assert_close(got.record, run(filter_, prior, z, sensor, steps, **options))


@dataclass(frozen=True, eq=False)
class Moved:
    """A sensor that is somewhere else at each step, and the better the later."""

    H: np.ndarray  # (steps, m, n)
    R: np.ndarray

    def at(self, k):
        return Seen(self.H[k], self.R / (1.0 + k))


@dataclass(frozen=True, eq=False)
class Seen:
    H: np.ndarray
    R: np.ndarray

    def h(self, x):
        return (self.H @ x[..., None])[..., 0]

    def jacobian(self, x):
        return self.H


@engines
@pytest.mark.parametrize("name", ["EKF", "UKF", "B-EKF 1"])
def test_a_sensor_may_be_another_at_each_step(name, engine):
    """Under JAX its arrays are indexed by a number that is traced."""
    rng = np.random.default_rng(3)
    prior, z, dynamics, _, steps = pushed()
    sensor = Moved(rng.normal(size=(steps, 1, 2)), np.array([[0.5]]))
    options = {"z_per_step": True, "dynamics": dynamics, "record": records.estimate}
    got = quiet(FILTERS[name], prior, z, sensor, steps, **options, engine=engine, chunk=2)
    x, P = prior.mean, prior.cov
    F = np.array([[1.0, 1.0], [0.0, 1.0]])
    for k in range(steps):
        x = x @ F.T + dynamics.push[k] * np.array([0.5, 1.0])
        P = F @ P @ F.T + dynamics.Q
        H, R = sensor.H[k], sensor.R / (1 + k)
        noise = R + H @ P @ H.T * (name == "B-EKF 1")
        noise = np.broadcast_to(noise, (len(x), 1, 1))
        members = zip(x, P, z[k], noise, strict=True)
        each = [naive.kalman(*member, H, R_i) for *member, R_i in members]
        x, P = map(np.stack, zip(*each, strict=True))
        assert_allclose(got.record.mean[k + 1], x, rtol=0, atol=1e-11 * np.abs(x).max())
        assert_allclose(got.record.cov[k + 1], P, rtol=0, atol=1e-11 * np.abs(P).max())
    assert_close(run(FILTERS[name], prior, z, sensor, steps, **options), got.record)


@dataclass(frozen=True)
class Gated:
    """The EKF, which uses every second or third measurement only: a filter of somebody's own."""

    every: int = 1

    def init(self, prior):
        return FILTERS["EKF"].init(prior)

    def step(self, state, z, sensor, dynamics, k):
        after = FILTERS["EKF"].step(state, z, sensor, dynamics, k)
        xp = state.estimate.mean.__array_namespace__()
        pairs = zip(after.estimate, state.estimate, strict=True)
        kept = [xp.where(k % self.every == 0, new, old) for new, old in pairs]
        return state._replace(estimate=Gaussian(*kept))


@engines
@pytest.mark.parametrize("every", [1, 2, 3])
def test_a_filter_of_ones_own_knows_the_step_too(every, engine):
    prior, _, _, sensor, _ = pushed()
    got = quiet(Gated(every), prior, [0.3], sensor, 7, engine=engine)
    wanted = prior
    for k in range(7):
        if k % every == 0:
            wanted = FILTERS["EKF"](wanted, np.array([0.3]), sensor)
    assert_close(got.final, wanted)


def test_an_exception_at_a_step_names_the_configuration():
    prior, _, _, sensor, _ = pushed()

    class Breaks(Gated):
        def step(self, state, z, sensor, dynamics, k):
            if k == 2 and (state.estimate.mean == PRIOR_3).all(axis=-1).any():
                raise ZeroDivisionError("third step")
            return state

    PRIOR_3 = prior.mean[3]
    with pytest.raises(SweepError, match="configuration 3: ZeroDivisionError: third step"):
        quiet(Breaks(), prior, [0.3], sensor, 3)
    quiet(Breaks(), prior, [0.3], sensor, 2)
