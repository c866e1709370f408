"""The same updates by other libraries, each as its documentation shows it.

Every function takes (prior, z, R, steps) for mean (members, 2) and cov (members, 2, 2), prepares,
and returns a function without arguments that makes all updates and gives (mean, cov) afterwards.
What a library asks for anyhow, such as a prediction of a state that stands still, is timed with it.
"""

from collections.abc import Callable
from datetime import datetime, timedelta

import jax
import jax.numpy as jnp
import numpy as np
from dynamax.nonlinear_gaussian_ssm import (
    ParamsNLGSSM,
    UKFHyperParams,
    extended_kalman_filter,
    unscented_kalman_filter,
)
from filterpy.kalman import ExtendedKalmanFilter, MerweScaledSigmaPoints, UnscentedKalmanFilter
from stonesoup.models.measurement.nonlinear import CartesianToBearingRange
from stonesoup.types.detection import Detection
from stonesoup.types.hypothesis import SingleHypothesis
from stonesoup.types.prediction import GaussianStatePrediction
from stonesoup.updater.kalman import ExtendedKalmanUpdater, UnscentedKalmanUpdater

from navfilters import FILTERS, Gaussian, sweep
from navfilters.models import RangeBearing

Prepared = Callable[[], tuple[np.ndarray, np.ndarray]]


def ours(name: str, engine: str) -> Callable[..., Prepared]:
    """This library, through its public function, checks of the input included."""

    def prepare(prior, z, R, steps):
        model = RangeBearing(R)
        return lambda: (
            sweep(
                FILTERS[name], prior, z, model, steps, engine=engine, workers=1, progress=False
            ).final
        )

    return prepare


def h(x):
    """Range and bearing from the origin, as one writes it without a library."""
    return np.array([np.hypot(x[0], x[1]), np.arctan2(x[1], x[0])])


def jacobian(x):
    r = np.hypot(x[0], x[1])
    return np.array([[x[0] / r, x[1] / r], [-x[1] / r**2, x[0] / r**2]])


def filterpy(name: str) -> Callable[..., Prepared]:
    """One object per member; for the UKF, prediction makes it draw its sigma points anew."""

    def make(mean, cov, R):
        if name == "EKF":
            member = ExtendedKalmanFilter(dim_x=2, dim_z=2)
        else:
            points = MerweScaledSigmaPoints(2, alpha=1.0, beta=2.0, kappa=1.0)
            member = UnscentedKalmanFilter(2, 2, dt=1.0, hx=h, fx=lambda x, dt: x, points=points)
            member.Q = np.zeros((2, 2))
        member.x, member.P, member.R = mean.copy(), cov.copy(), R
        return member

    def prepare(prior, z, R, steps):
        def run():
            members = [make(mean, cov, R) for mean, cov in zip(*prior, strict=True)]
            for member in members:
                for _ in range(steps):
                    if name == "EKF":
                        member.update(z, jacobian, h)
                    else:
                        member.predict()
                        member.update(z)
            return np.array([m.x for m in members]), np.array([m.P for m in members])

        return run

    return prepare


def stone_soup(name: str) -> Callable[..., Prepared]:
    """One hypothesis per member and step; its model has the bearing first.

    Its UKF averages bearings on the circle, as no other does, so that its numbers are its own.
    """

    def prepare(prior, z, R, steps):
        start = datetime(2000, 1, 1)
        model = CartesianToBearingRange(
            ndim_state=2, mapping=(0, 1), noise_covar=R[::-1, ::-1].copy()
        )
        if name == "EKF":
            updater = ExtendedKalmanUpdater(model)
        else:
            updater = UnscentedKalmanUpdater(model, alpha=1.0, beta=2.0, kappa=1.0)
        detections = [
            Detection([[z[1]], [z[0]]], timestamp=start + timedelta(seconds=k))
            for k in range(steps)
        ]

        def run():
            means, covs = [], []
            for mean, cov in zip(*prior, strict=True):
                state, P = mean[:, None], cov
                for detection in detections:
                    predicted = GaussianStatePrediction(state, P, timestamp=detection.timestamp)
                    updated = updater.update(SingleHypothesis(predicted, detection))
                    state, P = updated.state_vector, updated.covar
                means.append(np.asarray(state, float)[:, 0])
                covs.append(np.asarray(P, float))
            return np.array(means), np.array(covs)

        return run

    return prepare


def dynamax(name: str) -> Callable[..., Prepared]:
    """Its filter over a series, vmapped over the members and compiled."""

    def h(x):
        return jnp.array([jnp.hypot(x[0], x[1]), jnp.arctan2(x[1], x[0])])

    def prepare(prior, z, R, steps):
        kept = ["filtered_means", "filtered_covariances"]

        def one(mean, cov, series):
            params = ParamsNLGSSM(mean, cov, lambda x: x, jnp.zeros((2, 2)), h, jnp.asarray(R))
            if name == "EKF":
                found = extended_kalman_filter(params, series, output_fields=kept)
            else:
                points = UKFHyperParams(alpha=1.0, beta=2.0, kappa=1.0)
                found = unscented_kalman_filter(params, series, points, output_fields=kept)
            return found.filtered_means[-1], found.filtered_covariances[-1]

        go = jax.jit(jax.vmap(one, in_axes=(0, 0, None)))
        series = np.tile(z, (steps, 1))
        return lambda: jax.tree.map(np.asarray, go(*prior, series))

    return prepare


def limit(function: Callable) -> Callable[..., Prepared]:
    """One of the C functions of ``limit.compiled``."""
    return lambda prior, z, R, steps: lambda: function(Gaussian(*prior), z, R, steps)
