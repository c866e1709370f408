"""What depends on the number of the step, and a state that is no Gaussian: as in a direct loop."""

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import naive
import numpy as np
import pytest
from naive import covariances
from numpy.testing import assert_allclose

from navfilters import FILTERS, Filter, Gaussian, SweepError, run, sweep
from navfilters.estimators.multiplicative import MekfState, mekf_update
from navfilters.estimators.robust import AdaptiveRobust
from navfilters.models import Linear
from navfilters.runs import records
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

    def step(self, state, z, images, dynamics, k):
        measurement = Measurement(images.pixels[k], z[..., 2], z[..., 3])
        beta = 0.5 * (k < self.underweighted)
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
        Images(GEOMETRY, pixels),
        steps,
        z_per_step=True,
        engine=engine,
        record=records.Distance(R0),
        chunk=2,
    )
    state = mekf_state(prior.mean, np.broadcast_to(prior.cov, (count, 9, 9)))
    errors = [np.linalg.norm(state.r - R0, axis=-1)]
    for k in range(steps):
        seen = Measurement(pixels[k], z[k, :, 2], z[k, :, 3])
        state = mekf_update(state, seen, GEOMETRY, underweighting=0.5 if k < 2 else 0.0).state
        errors.append(np.linalg.norm(state.r - R0, axis=-1))
    assert_allclose(got.record, np.stack(errors), rtol=0, atol=1e-6)
    for ours, theirs in zip(got.state.mekf[:3], state[:3], strict=True):
        assert_allclose(ours, theirs, rtol=0, atol=1e-12 * np.abs(theirs).max())
    deviation = np.sqrt(np.diagonal(state.P, axis1=-2, axis2=-1))
    scale = deviation[:, :, None] * deviation[:, None, :]
    assert_allclose(got.state.mekf.P / scale, state.P / scale, rtol=0, atol=1e-9)
    assert (deviation < SIGMA).all()  # the images did tell something
