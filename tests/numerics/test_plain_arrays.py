"""Arrays that are more than their numbers are refused by name, wherever arrays come in."""

import warnings
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from navfilters import FILTERS, Gaussian, SigmaPoints, first_indefinite, run, sweep
from navfilters.estimators.adaptive import AdaptiveEKF
from navfilters.estimators.continuous import extended_kalman_bucy
from navfilters.estimators.continuous_system import ContinuousSystem
from navfilters.estimators.discrete import DiscreteSystem, extended_kalman_filter, predict, update
from navfilters.estimators.extended import ExtendedKalman
from navfilters.estimators.moments import linearized
from navfilters.estimators.robust import AdaptiveRobustEKF, RobustEKF
from navfilters.estimators.update import kalman_update
from navfilters.models import Linear, RangeBearing
from navfilters.numerics import validation
from navfilters.runs.consistency import mean_nees, nees

MEAN, COV, Z, R = np.array([28.0, 41.0]), 4 * np.eye(2), np.array([50.2, 0.92]), 0.01 * np.eye(2)
MODEL = RangeBearing(R)


class Metres(np.ndarray):
    """An array with a unit, as those of astropy and unyt are."""

    unit = "m"


class Quantity:
    """Numbers with a unit, that are no arrays, as those of pint are."""

    def __init__(self, value, units="m"):
        self.value, self.units = np.asarray(value), units

    def __array__(self, dtype=None, copy=None):
        return self.value


class Odd(np.ndarray):
    """A subclass with rules of its own."""


def masked(value):
    """The last entry is not known; 9999 stands in its place."""
    array = np.ma.array(value, dtype=float)
    array.mask = np.zeros(array.shape, bool)
    array[(-1,) * array.ndim] = 9999.0
    array[(-1,) * array.ndim] = np.ma.masked
    return array


def matrix(value):
    """NumPy's own, which warns that it is old."""
    with warnings.catch_warnings(action="ignore"):
        return np.asmatrix(value)


UNPLAIN = {
    "masked": (masked, "have no masked entries.*found 1 masked, the first at index"),
    "a list of masked": (lambda a: list(masked(a)), "have no masked entries"),
    "in a unit": (lambda a: np.asarray(a, float).view(Metres), "found .*Metres in m"),
    "a quantity": (Quantity, "found .*Quantity in m"),
    "a matrix": (matrix, "found numpy.matrix"),
    "a subclass": (lambda a: np.asarray(a, float).view(Odd), "found .*Odd"),
}


@dataclass(frozen=True)
class Bare:
    """A model that checks nothing of its own."""

    R: object

    def h(self, x):
        return MODEL.h(x)

    def jacobian(self, x):
        return MODEL.jacobian(x)

    def hessian(self, x):
        return MODEL.hessian(x)


@dataclass(frozen=True)
class Drift:
    """x stays where it is."""

    Q: object

    def transition(self, x):
        return x, np.eye(2)


DISCRETE = DiscreteSystem(
    lambda x, u, w, k: x + w, lambda x, v, k: x + v, 0.01 * np.eye(2), 0.1 * np.eye(2)
)
CONTINUOUS = ContinuousSystem(
    lambda x, u, w, t: -x + w, lambda x, v, t: x + v, np.eye(2), 0.1 * np.eye(2)
)


def remembering(filter_, z=Z, Q=R, noise=R, mean=MEAN, cov=COV):
    state = filter_.init(Gaussian(mean, cov))
    return filter_.step(state, z, Drift(Q), Bare(noise))


def swept(mean=MEAN, cov=COV, z=Z, model=MODEL, **options):
    return sweep(FILTERS["EKF"], Gaussian(mean, cov), z, model, 1, progress=False, **options)


def ran(mean=MEAN, cov=COV, z=Z, model=MODEL, estimator=FILTERS["EKF"], **options):
    return run(estimator, Gaussian(mean, cov), z, model, 1, **options)


def together(z):
    prior = Gaussian(MEAN, COV)
    return kalman_update(prior, z, linearized(prior, MODEL))


ALONE = Gaussian(MEAN, COV)
BUMPED = FILTERS["B-EKF 1"]
DOORS = {
    "run, mean": ("prior.mean", MEAN, lambda a: ran(mean=a)),
    "run, cov": ("prior.cov", COV, lambda a: ran(cov=a)),
    "run, z": ("z", Z, lambda a: ran(z=a)),
    "run, z of each step": ("z", [Z], lambda a: ran(z=a, z_varies=True)),
    "run, R": ("model.R", R, lambda a: ran(model=Bare(a))),
    "run, bump": ("bump", [0.5, 1.0], lambda a: ran(estimator=partial(BUMPED, bump=a))),
    "sweep, mean": ("priors.mean", MEAN, lambda a: swept(mean=a)),
    "sweep, cov": ("priors.cov", COV, lambda a: swept(cov=a)),
    "sweep, z": ("z", Z, lambda a: swept(z=a)),
    "sweep, R": ("model.R", R, lambda a: swept(model=Bare(a))),
    "sweep, truth": ("truth", MEAN, lambda a: swept(keep=["error"], truth=a)),
    "a filter, mean": ("prior.mean", MEAN, lambda a: FILTERS["UKF"](Gaussian(a, COV), Z, MODEL)),
    "a filter, cov": ("prior.cov", COV, lambda a: FILTERS["UKF"](Gaussian(MEAN, a), Z, MODEL)),
    "a filter, z": ("z", Z, lambda a: FILTERS["EKF"](Gaussian(MEAN, COV), a, MODEL)),
    "a filter, R": ("model.R", R, lambda a: FILTERS["EKF"](Gaussian(MEAN, COV), Z, Bare(a))),
    "kalman_update, z": ("z", Z, together),
    "a model, R": ("R", R, RangeBearing),
    "a model, H": ("H", COV, lambda a: Linear(a, R)),
    "alpha": ("alpha", [0.5, 1.0], SigmaPoints),
    "kappa": ("kappa", [0.5, 1.0], lambda a: SigmaPoints(kappa=a)),
    "gamma": ("gamma", [50.0, 60.0], RobustEKF),
    "a": ("a", [1.0, 1.5], AdaptiveEKF),
    "directions": ("directions", COV, lambda a: AdaptiveEKF(directions=a)),
    "rho": ("rho", [0.5, 0.9], lambda a: AdaptiveRobustEKF(rho=a)),
    "lam": ("lam", [1.5, 2.0], lambda a: AdaptiveRobustEKF(lam=a)),
    "robust, z": ("z", Z, lambda a: remembering(RobustEKF(), z=a)),
    "adaptive, z": ("z", Z, lambda a: remembering(AdaptiveEKF(directions=np.eye(2)), z=a)),
    "adaptive robust, z": ("z", Z, lambda a: remembering(AdaptiveRobustEKF(), z=a)),
    "robust, Q": ("dynamics.Q", R, lambda a: remembering(ExtendedKalman(), Q=a)),
    "robust, R": ("model.R", R, lambda a: remembering(ExtendedKalman(), noise=a)),
    "robust, mean": ("prior.mean", MEAN, lambda a: remembering(RobustEKF(), mean=a)),
    "robust, cov": ("prior.cov", COV, lambda a: remembering(RobustEKF(), cov=a)),
    "discrete, Q": ("Q", R, lambda a: DiscreteSystem(DISCRETE.f, DISCRETE.h, a, R)),
    "discrete, R": ("R", R, lambda a: DiscreteSystem(DISCRETE.f, DISCRETE.h, R, a)),
    "discrete, y": ("y", [Z], lambda a: extended_kalman_filter(DISCRETE, Gaussian(MEAN, COV), a)),
    "discrete, u": (
        "u",
        [Z],
        lambda a: extended_kalman_filter(DISCRETE, Gaussian(MEAN, COV), [Z], a),
    ),
    "discrete, mean": (
        "posterior.mean",
        MEAN,
        lambda a: predict(DISCRETE, Gaussian(a, COV), np.zeros(0), 0),
    ),
    "discrete, y alone": ("y", Z, lambda a: update(DISCRETE, Gaussian(MEAN, COV), a, 1)),
    "continuous, mean": (
        "prior.mean",
        MEAN,
        lambda a: extended_kalman_bucy(CONTINUOUS, Gaussian(a, COV), lambda t: Z, [0.0, 0.1]),
    ),
    "continuous, y": (
        "y",
        Z,
        lambda a: extended_kalman_bucy(
            CONTINUOUS, Gaussian(MEAN, COV), lambda t: a if t < 0.05 else Z, [0.0, 0.1]
        ),
    ),
    "continuous, t": (
        "t",
        [0.0, 0.1],
        lambda a: extended_kalman_bucy(CONTINUOUS, Gaussian(MEAN, COV), lambda t: Z, a),
    ),
    "first_indefinite": ("cov", [COV, COV], first_indefinite),
    "linear_limit, z": ("z", Z, lambda a: FILTERS["EKF"].linear_limit(ALONE, a, Linear(COV, R))),
    "nees, error": ("error", MEAN, lambda a: nees(a, COV)),
    "mean_nees, cov": ("cov", [COV, COV], lambda a: mean_nees([MEAN, Z], a, runs_axis=0)),
}


@pytest.mark.parametrize("kind", UNPLAIN)
@pytest.mark.parametrize("door", DOORS)
def test_more_than_numbers_is_refused_by_name(door, kind):
    name, value, go = DOORS[door]
    make, message = UNPLAIN[kind]
    if kind == "a matrix" and np.ndim(value) > 2:
        pytest.skip("no matrix")
    with pytest.raises(ValueError, match=rf"{name} must.*{message}"):
        go(make(value))


@pytest.mark.parametrize("door", DOORS)
@pytest.mark.parametrize("kind", ["plain", "a list", "nothing masked"])
def test_numbers_are_taken(door, kind):
    """A list, and a masked array that masks nothing, too."""
    _, value, go = DOORS[door]
    value = np.asarray(value, float)
    go({"plain": value, "a list": value.tolist(), "nothing masked": np.ma.array(value)}[kind])


def test_what_a_function_returns_is_looked_at_too():
    class Masking(Bare):
        def h(self, x):
            return np.ma.masked_greater(MODEL.h(x), 40.0)

    with pytest.raises(ValueError, match=r"the value of model.h must have no masked entries"):
        ran(model=Masking(R))

    class Matrix(Bare):
        def jacobian(self, x):
            return matrix(MODEL.jacobian(x)) if x.ndim == 1 else MODEL.jacobian(x)

    with pytest.raises(ValueError, match=r"the value of model.jacobian must be a plain array"):
        swept(model=Matrix(R))


def test_a_masked_array_that_masks_nothing_gives_the_same():
    wanted = ran().mean
    assert_array_equal(ran(mean=np.ma.array(MEAN), z=np.ma.array(Z, mask=False)).mean, wanted)
    assert type(ran(mean=np.ma.array(MEAN)).mean) is np.ndarray


def test_a_file_mapped_into_memory_is_an_array(tmp_path):
    stored = np.memmap(tmp_path / "z", dtype=float, mode="w+", shape=2)
    stored[:] = Z
    assert_array_equal(ran(z=stored).mean, ran().mean)


@pytest.mark.parametrize("value", [True, np.True_, [1.0, True], [[1.0, 2.0], [np.False_, 1.0]]])
def test_a_bool_among_numbers_is_refused(value):
    with pytest.raises(ValueError, match=r"x must be .*real numbers; found (a|dtype) bool"):
        validation.real_array("x", value, "")


def test_a_longer_double_that_overflows_is_infinite():
    with pytest.raises(ValueError, match="inf at index"):
        validation.real_array("x", [np.longdouble("1e400")], "")
