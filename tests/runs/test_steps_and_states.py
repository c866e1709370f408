"""What depends on the number of the step, and a state that is no Gaussian: as in a direct loop."""

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
import pytest
from naive import covariances
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Gaussian, SweepError, sweep
from navfilters.estimators.extended import ExtendedKalman
from navfilters.estimators.multiplicative import MekfState, mekf_update
from navfilters.estimators.robust import AdaptiveRobustEKF
from navfilters.models import Linear
from navfilters.space.frames import body_axes, ellipsoid_intersection, enu_covariance
from navfilters.space.image_measurement import Measurement, SarGeometry
from navfilters.space.quaternions import from_rotation_vector, rotation_vector

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


# --- a state with a quaternion ------------------------------------------------------------------

R0 = np.array([-1108465.150, -6100044.949, 3397134.666])
V0 = np.array([-1003.9419331, 3801.3289491, 6498.2536689])
SIGMA = np.array([300.0] * 3 + [3.0] * 3 + [np.deg2rad(0.05)] * 3)
GEOMETRY = SarGeometry(
    np.deg2rad(34.3),
    0.0,
    np.diag([0.0, 0.0, 1.0, 0.54**2]),
    enu_covariance((2.0, 8.0, 1.0), 29.76, -95.37),
    body_axes(R0, V0),
)


def mekf_state(x, P):
    """From nine components, the last three the misalignment's rotation vector."""
    return MekfState(x[..., :3], x[..., 3:6], from_rotation_vector(x[..., 6:]), P)


class Flown(NamedTuple):
    """What goes from step to step; its estimate is what a sweep reports."""

    mekf: MekfState

    @property
    def estimate(self):
        r, v, q_mu, P = self.mekf
        xp = r.__array_namespace__()
        return Gaussian(xp.concat([r, v, rotation_vector(q_mu)], axis=-1), P)


@dataclass(frozen=True)
class ImageFilter:
    """The multiplicative EKF on images of one place, underweighted in the first steps."""

    underweighted: int

    def init(self, prior):
        return Flown(mekf_state(*prior))

    def step(self, state, z, _, images, *, step):
        measurement = Measurement(images.pixels[step], z[..., 2], z[..., 3])
        beta = 0.5 * (step < self.underweighted)
        update = mekf_update(state.mekf, measurement, images.geometry, underweighting=beta)
        return Flown(update.state)


@dataclass(frozen=True, eq=False)
class Images:
    """One place on the ground for each step, (steps, 3)."""

    geometry: SarGeometry
    pixels: np.ndarray

    @property
    def R(self):
        return self.geometry.R

    def jacobian(self, x):
        return self.geometry.jacobian(mekf_state(x, None), self.pixels[0])


@engines
def test_the_multiplicative_filter_is_swept_as_one_with_a_memory(engine):
    rng, steps, count = np.random.default_rng(1), 4, 5
    truth = np.concatenate([R0, V0, np.zeros(3)])
    prior = Gaussian(truth + SIGMA * rng.normal(size=(count, 9)), np.diag(SIGMA**2))
    axis = GEOMETRY.boresight(np.array([0.0, 0.0, 0.0, 1.0]))
    pixels = ellipsoid_intersection(R0, axis) + 5 * rng.normal(size=(steps, 3))
    z = np.zeros((steps, count, 4))
    z[..., 2] = np.linalg.norm(pixels - R0, axis=-1)[:, None] + rng.normal(size=(steps, count))
    z[..., 3] = np.linalg.norm(V0) + 0.54 * rng.normal(size=(steps, count))
    got = quiet(
        ImageFilter(2),
        prior,
        z,
        (None, Images(GEOMETRY, pixels)),
        steps,
        z_varies=True,
        engine=engine,
        truth=np.broadcast_to(R0, (steps + 1, 3)),
        keep=["final", "error"],
        chunk=2,
    )
    state = mekf_state(prior.mean, np.broadcast_to(prior.cov, (count, 9, 9)))
    errors = [np.linalg.norm(state.r - R0, axis=-1)]
    for k in range(steps):
        seen = Measurement(pixels[k], z[k, :, 2], z[k, :, 3])
        state = mekf_update(state, seen, GEOMETRY, underweighting=0.5 if k < 2 else 0.0).state
        errors.append(np.linalg.norm(state.r - R0, axis=-1))
    assert_allclose(got.error, np.stack(errors), rtol=0, atol=1e-6)
    for ours, theirs in zip(got.final.mekf[:3], state[:3], strict=True):
        assert_allclose(ours, theirs, rtol=0, atol=1e-12 * np.abs(theirs).max())
    deviation = np.sqrt(np.diagonal(state.P, axis1=-2, axis2=-1))
    scale = deviation[:, :, None] * deviation[:, None, :]
    assert_allclose(got.final.mekf.P / scale, state.P / scale, rtol=0, atol=1e-9)
    assert (deviation < SIGMA).all()  # the images did tell something
