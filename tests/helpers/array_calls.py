"""A valid call of each public function of arrays, argument by argument.

What an argument is: "cov", symmetric and definite; "symmetric"; "root", any matrix; "vector",
components along the last axis; "numbers", of any shape; "one", an array that is taken as a whole
and has no batch.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from navfilters import models, numerics, runs, space, tracking
from navfilters.papers import perea2007
from navfilters.sar import ground, images
from navfilters.types import Gaussian

MEAN, Z = np.array([28.0, 41.0]), np.array([50.0, 1.0])
COV, R = np.array([[4.0, 1.0], [1.0, 2.0]]), np.array([[0.5, 0.0], [0.0, 0.25]])
QUATERNION, OTHER = np.array([0.5, -0.5, 0.5, 0.5]), np.array([0.5, 0.5, 0.5, -0.5])
FIRST, SECOND = np.array([1.0, 2.0, -3.0]), np.array([0.5, -4.0, 1.0])
SITE, AHEAD = np.array([7e6, 1024.0, -2048.0]), np.array([-8.0, 1.0, 0.5])
STATE = np.concatenate([SITE, [0.0, 512.0, 7424.0], QUATERNION])


class Call(NamedTuple):
    """A function, its arguments by name, and what each of them is."""

    function: Callable[..., Any]
    arguments: Mapping[str, Any]
    kinds: Mapping[str, str]


def call(function, **arguments):
    """Of arguments as (kind, value)."""
    values = {name: value for name, (_, value) in arguments.items()}
    return Call(function, values, {name: kind for name, (kind, _) in arguments.items()})


PRIOR = {"mean": ("vector", MEAN), "cov": ("cov", COV)}


RUNS = np.array([[1.0, 2.0], [0.5, -1.0], [-2.0, 0.25]])

CALLS = {
    "numerics.cholesky": call(numerics.cholesky, A=("cov", COV)),
    "numerics.is_positive_definite": call(numerics.is_positive_definite, A=("cov", COV)),
    "numerics.right_divide": call(numerics.right_divide, B=("root", 2 * COV), A=("root", COV)),
    "numerics.semidefinite_root": call(numerics.semidefinite_root, A=("cov", COV)),
    "numerics.spectral_norm": call(numerics.spectral_norm, A=("symmetric", COV)),
    "numerics.symmetric_root": call(numerics.symmetric_root, A=("cov", COV)),
    "models.to_polar": call(models.to_polar, x=("vector", MEAN)),
    "models.to_cartesian": call(models.to_cartesian, p=("vector", Z)),
    "models.RangeBearing": call(lambda R: models.RangeBearing(R).R, R=("cov", R)),
    "models.PolarState": call(lambda R: models.PolarState(R).R, R=("cov", R)),
    "models.ConvertedRangeBearing": call(lambda R: models.ConvertedRangeBearing(R).R, R=("cov", R)),
    "models.Linear": call(
        lambda H, R: tuple(vars(models.Linear(H, R)).values()), H=("root", COV), R=("cov", R)
    ),
    "runs.nees": call(runs.nees, error=("vector", MEAN), cov=("cov", COV)),
    "runs.nis": call(runs.nis, innovation=("vector", Z), S=("cov", COV)),
    "runs.first_indefinite": call(runs.first_indefinite, cov=("one", np.stack([COV, R, COV]))),
    "runs.mean_nees": call(
        lambda error, cov: runs.mean_nees(error, cov, runs_axis=-2),
        error=("one", RUNS), cov=("one", np.stack([COV, R, COV])),
    ),
    "runs.sample_deviation": call(
        lambda error, cov: runs.sample_deviation(error, cov, runs_axis=-2),
        error=("one", RUNS), cov=("one", np.stack([COV, R, COV])),
    ),
    "runs.coverage": call(
        lambda error, cov: runs.coverage(error, cov, runs_axis=-2),
        error=("one", RUNS), cov=("one", np.stack([COV, R, COV])),
    ),
    "space.cross_matrix": call(space.cross_matrix, v=("vector", FIRST)),
    "space.product": call(space.product, p=("vector", QUATERNION), q=("vector", OTHER)),
    "space.conjugate": call(space.conjugate, q=("vector", QUATERNION)),
    "space.matrix": call(space.matrix, q=("vector", QUATERNION)),
    "space.normalized": call(space.normalized, q=("vector", QUATERNION)),
    "space.rotation_vector": call(space.rotation_vector, q=("vector", QUATERNION)),
    "space.from_rotation_vector": call(space.from_rotation_vector, theta=("vector", SECOND)),
    "space.body_axes": call(space.body_axes, r=("vector", SITE), v=("vector", FIRST)),
    "space.ecef_to_geodetic": call(space.ecef_to_geodetic, r=("vector", SITE)),
    "space.ellipsoid_intersection": call(
        space.ellipsoid_intersection, r=("vector", SITE), direction=("vector", AHEAD)
    ),
    "space.geodetic_to_ecef": call(
        space.geodetic_to_ecef, latitude=("numbers", np.array([30.0, 40.0])),
        longitude=("numbers", np.array([-95.0, 2.0])), height=("numbers", np.array([0.0, 8.0])),
    ),
    "space.enu_covariance": call(
        lambda deviations: space.enu_covariance(deviations, 30.0, -95.0),
        deviations=("vector", np.array([1.0, 2.0, 3.0])),
    ),
    "space.perigee_apogee": call(
        space.perigee_apogee, x=("vector", np.array([7e6, 0.0, 0.0, 0.0, 7680.0, 0.0]))
    ),
    "space.retract": call(
        space.retract, x=("vector", STATE),
        dx=("vector", np.array([8.0, 1.0, -2.0, 0.5, 0.25, 1.0, 0.5, -0.25, 0.125])),
    ),
    "space.difference": call(
        space.difference, x=("vector", STATE), y=("vector", np.concatenate([STATE[:6], OTHER]))
    ),
    "sar.images.decibels": call(images.decibels, power=("numbers", np.array([1.0, 8.0]))),
    "sar.images.sharpness": call(images.sharpness, intensity=("one", COV)),
    "sar.images.image_entropy": call(images.image_entropy, intensity=("one", COV)),
    "sar.images.effective_velocity": call(
        images.effective_velocity, r=("vector", SITE), v=("vector", np.array([0.0, 512.0, 7424.0])),
        r_f=("vector", np.array([6378000.0, 1024.0, 4096.0])),
        acceleration=("vector", np.array([-8.0, 0.5, 0.25])),
    ),
    "sar.ground.lambert": call(ground.lambert, cosine=("numbers", np.array([0.5, 0.25]))),
    "tracking.delay": call(
        tracking.delay, elevation=("numbers", np.array([0.5, 1.0])),
        height=("numbers", np.array([16.0, 512.0])),
    ),
    "tracking.refraction": call(
        tracking.refraction, elevation=("numbers", np.array([0.5, 1.0])),
        height=("numbers", np.array([16.0, 512.0])),
    ),
    "tracking.density": call(tracking.density, height=("numbers", np.array([2e5, 4e5]))),
    "papers.perea2007.isotropic": call(
        perea2007.isotropic, mean=("vector", MEAN), sigma=("numbers", np.array(2.0))
    ),
    "papers.perea2007.position_error": call(
        perea2007.position_error, x=("vector", MEAN), x_true=("vector", Z)
    ),
    "papers.perea2007.deviations": call(
        lambda mean, cov, x_true: perea2007.deviations(Gaussian(mean, cov), x_true),
        **PRIOR, x_true=("vector", Z),
    ),
}  # fmt: skip
