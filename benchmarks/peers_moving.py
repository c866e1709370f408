"""The problems in motion by other libraries, each as its documentation shows it.

None has a multiplicative EKF. Each makes its update with the peer's EKF on the error state, folding
the rotation vector into the quaternion outside, in plain array code. filterpy and Stone Soup are
given this library's model functions, so that what differs is the filter: called for one member,
they are most of what these two take. dynamax derives its own Jacobians of the same f and h by
automatic differentiation. As in ``peers``, (prior, z, problem, steps) prepares and returns what is
timed; the covariance (n, n) is all members'.
"""

from collections.abc import Callable
from datetime import datetime, timedelta

import jax
import jax.numpy as jnp
import numpy as np
from dynamax.nonlinear_gaussian_ssm import ParamsNLGSSM, extended_kalman_filter
from filterpy.kalman import ExtendedKalmanFilter
from peers import Prepared
from problems import NOMINAL, Coasting
from stonesoup.base import Property
from stonesoup.models.measurement.nonlinear import NonLinearGaussianMeasurement
from stonesoup.models.transition.nonlinear import GaussianTransitionModel
from stonesoup.predictor.kalman import ExtendedKalmanPredictor
from stonesoup.types.array import StateVector
from stonesoup.types.detection import Detection
from stonesoup.types.hypothesis import SingleHypothesis
from stonesoup.types.state import GaussianState
from stonesoup.updater.kalman import ExtendedKalmanUpdater


def ours(engine: str) -> Callable[..., Prepared]:
    """This library, through its public functions, checks of the input included."""
    return lambda prior, z, problem, steps: lambda: problem.ours(prior, z, steps, engine)


class Member(ExtendedKalmanFilter):
    """filterpy's filter with ``predict_x`` overridden, as it asks of one whose f is not F x."""

    def __init__(self, problem, mean, cov):
        super().__init__(dim_x=len(mean), dim_z=len(problem.measured(problem.z[0])))
        self.problem = problem
        self.x, self.P, self.Q = mean, cov, problem.Q

    def predict_x(self, u=0):
        self.x, self.F = self.problem.transition(self.x)


def filterpy(prior, z, problem, steps) -> Prepared:
    """One object per member."""

    def fly(mean, cov):
        x, q = problem.fold(mean, NOMINAL)
        member = Member(problem, x, cov)
        for k in range(steps):
            member.predict()
            about = q, z[k]
            member.update(
                problem.measured(z[k]),
                problem.jacobian,
                problem.h,
                R=problem.noise(member.x, *about),
                args=about,
                hx_args=about,
            )
            member.x, q = problem.fold(member.x, q)
        return problem.unfold(member.x, q), member.P

    return lambda: collected(fly(mean, prior.cov.copy()) for mean in prior.mean)


def collected(flown) -> tuple[np.ndarray, np.ndarray]:
    """Means and covariances of all members."""
    means, covs = zip(*flown, strict=True)
    return np.array(means), np.array(covs)


class Transition(GaussianTransitionModel):
    """Stone Soup's model of a flight."""

    problem: object = Property(doc="Coasting or Images")

    @property
    def ndim_state(self):
        return len(self.problem.Q)

    def function(self, state, noise=False, **_):
        return StateVector(self.problem.move(plain(state.state_vector)))

    def jacobian(self, state, **_):
        return self.problem.transition(plain(state.state_vector))[1]

    def covar(self, **_):
        return self.problem.Q


class Seen(NonLinearGaussianMeasurement):
    """Stone Soup's model of one measurement."""

    problem: object = Property(doc="Coasting or Images")
    about: tuple = Property(doc="reference quaternion and measurement")

    @property
    def ndim_meas(self):
        return len(self.noise_covar)

    def function(self, state, noise=False, **_):
        return StateVector(self.problem.h(plain(state.state_vector), *self.about))

    def jacobian(self, state, **_):
        return self.problem.jacobian(plain(state.state_vector), *self.about)


def plain(column) -> np.ndarray:
    """A vector of numbers from Stone Soup's column."""
    return np.asarray(column, float)[:, 0]


def stone_soup(prior, z, problem, steps) -> Prepared:
    """One prediction, measurement model, detection and hypothesis per member and step."""
    n, start = prior.mean.shape[-1], datetime(2000, 1, 1)
    predictor = ExtendedKalmanPredictor(Transition(problem))
    times = [start + timedelta(seconds=k) for k in range(steps + 1)]

    def fly(mean, P):
        x, q = problem.fold(mean, NOMINAL)
        for k in range(steps):
            state = GaussianState(x, P, timestamp=times[k])
            predicted = predictor.predict(state, timestamp=times[k + 1])
            about = q, z[k]
            R = problem.noise(plain(predicted.state_vector), *about)
            model = Seen(
                ndim_state=n, mapping=range(n), noise_covar=R, problem=problem, about=about
            )
            seen = StateVector(problem.measured(z[k]))
            detection = Detection(seen, timestamp=times[k + 1], measurement_model=model)
            updated = ExtendedKalmanUpdater().update(SingleHypothesis(predicted, detection))
            x, q = problem.fold(plain(updated.state_vector), q)
            P = np.asarray(updated.covar, float)
        return problem.unfold(x, q), P

    return lambda: collected(fly(mean, prior.cov) for mean in prior.mean)


def dynamax(prior, z, problem, steps) -> Prepared:
    """Its filter, vmapped over the members and compiled.

    It updates first and predicts then. So it starts from predicted priors, made before the clock
    runs, and its last prediction is one too many: as many of both as the others make. For images it
    is called with one measurement at a time, since the quaternion is folded in between.

    It adds 1e-9 to the diagonal of S, whatever the units, so that h is measured in deviations of
    its noise here: in rad^2 that would be more than a hundredth of the angles' R.
    """
    x_0, f, Q = problem.first.mean, problem.move, jnp.asarray(problem.Q)
    unit = np.sqrt(np.diag(problem.noise(x_0, NOMINAL, z[0])))
    seen = jnp.stack([problem.measured(z_k) for z_k in z[:steps]]) / unit
    kept = ["filtered_means", "filtered_covariances", "predicted_means", "predicted_covariances"]

    def predicted(mean, P):
        x, q = problem.fold(mean, NOMINAL)
        x, F = problem.transition(x)
        return x, F @ P @ F.T + Q, q

    def params(x, P, q, z_k):
        R = problem.noise(x, q, z_k) / (unit[:, None] * unit)
        return ParamsNLGSSM(x, P, f, Q, lambda x: problem.h(x, q, z_k) / unit, R)

    def coasting(x, P, q):
        found = extended_kalman_filter(params(x, P, q, None), seen, output_fields=kept[:2])
        return found.filtered_means[-1], found.filtered_covariances[-1]

    def imaging(x, P, q):
        def step(carry, image):
            (x, P, q), (z_k, seen_k) = carry[0], image
            found = extended_kalman_filter(params(x, P, q, z_k), seen_k[None], output_fields=kept)
            ahead, q_after = problem.fold(found.predicted_means[0], q)
            final = found.filtered_means[0], found.filtered_covariances[0], q
            return ((ahead, found.predicted_covariances[0], q_after), final), None

        start = (x, P, q), (x, P, q)
        (_, (x, P, q)), _ = jax.lax.scan(step, start, (z[:steps], seen))
        return problem.unfold(*problem.fold(x, q)), P

    one = coasting if isinstance(problem, Coasting) else imaging
    go = jax.jit(jax.vmap(one))
    start = jax.jit(jax.vmap(predicted, in_axes=(0, None)))(*prior)
    return lambda: jax.tree.map(np.asarray, go(*start))
