"""What depends on the number of the step: as in a direct loop."""

from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from naive import covariances
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Gaussian, SweepError, sweep
from navfilters.estimators.extended import ExtendedKalman
from navfilters.estimators.robust import AdaptiveRobustEKF
from navfilters.models import Linear

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

    push: np.ndarray  # (steps,), of which a step uses one
    Q: np.ndarray

    def at(self, step):
        return Pushed(self.push[step], self.Q)


@dataclass(frozen=True, eq=False)
class Pushed:
    push: float
    Q: np.ndarray

    def transition(self, x):
        xp = x.__array_namespace__()
        F = xp.asarray([[1.0, 1.0], [0.0, 1.0]])
        return (F @ x[..., None])[..., 0] + self.push * xp.asarray([0.5, 1.0]), F


@dataclass(frozen=True)
class Timed:
    """A filter of dynamics that know the time."""

    filter: object

    def init(self, prior):
        return self.filter.init(prior)

    def step(self, state, z, dynamics, sensor, *, step):
        return self.filter.step(state, z, dynamics.at(step), sensor)


def pushed(steps=7, count=5):
    rng = np.random.default_rng(0)
    prior = Gaussian(rng.normal(size=(count, 2)), covariances(rng, (count,), 2))
    dynamics = Cart(np.where(np.arange(steps) % 3 == 1, 4.0, 0.0), 0.01 * np.eye(2))
    sensor = Linear(np.array([[1.0, 0.0]]), np.array([[0.1]]))
    return prior, rng.normal(size=(steps, count, 1)), dynamics, sensor, steps


@engines
@pytest.mark.parametrize("filter_", [ExtendedKalman(), AdaptiveRobustEKF()])
def test_a_swept_filter_knows_the_step(filter_, engine):
    """The AREKF's first step is compiled on its own."""
    prior, z, dynamics, sensor, steps = pushed()
    got = quiet(
        Timed(filter_),
        prior,
        z,
        (dynamics, sensor),
        steps,
        z_varies=True,
        engine=engine,
        keep=["final", "history"],
        chunk=2,
    )
    state, states = filter_.init(prior), [prior]
    for k in range(steps):
        state = filter_.step(state, z[k], Pushed(dynamics.push[k], dynamics.Q), sensor)
        states.append(state.estimate)
    assert_close(got.final.estimate, state.estimate)
    assert_close(got.history, map(np.stack, zip(*states, strict=True)))


def gated(prior, z, model, step, *, every=1):
    """The EKF, which uses every second or third measurement only."""
    xp = prior.mean.__array_namespace__()
    updated = FILTERS["EKF"](prior, z, model)
    used = step % every == 0
    return Gaussian(*(xp.where(used, new, old) for new, old in zip(updated, prior, strict=True)))


@engines
@pytest.mark.parametrize("every", [1, 2, 3])
def test_a_filter_without_a_memory_knows_the_step_too(every, engine):
    prior, _, _, sensor, _ = pushed()
    got = quiet(partial(gated, every=every), prior, [0.3], sensor, 7, engine=engine)
    wanted = prior
    for k in range(7):
        if k % every == 0:
            wanted = FILTERS["EKF"](wanted, np.array([0.3]), sensor)
    assert_close(got.final, wanted)


def test_a_step_that_has_a_value_is_left_alone():
    """An option of that name is the user's: bound, or with a default."""
    prior, _, _, sensor, _ = pushed()
    fixed = quiet(partial(gated, every=2, step=1), prior, [0.3], sensor, 3).final
    assert_array_equal(fixed.cov, prior.cov)  # no step is even
    assert_array_equal(
        quiet(lambda prior, z, model, step=None: prior, prior, [0.3], sensor, 3).final.cov,
        prior.cov,
    )


def test_an_exception_at_a_step_names_the_configuration():
    prior, _, _, sensor, _ = pushed()

    def breaks(prior, z, model, step):
        if step == 2 and (prior.mean == PRIOR_3).all(axis=-1).any():
            raise ZeroDivisionError("third step")
        return prior

    PRIOR_3 = prior.mean[3]
    with pytest.raises(SweepError, match="configuration 3: ZeroDivisionError: third step"):
        quiet(breaks, prior, [0.3], sensor, 3)
    quiet(breaks, prior, [0.3], sensor, 2)
