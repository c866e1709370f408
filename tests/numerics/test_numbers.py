"""A number as an option: NumPy's are taken wherever Python's are, a bool nowhere."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Filter, Gaussian, SigmaPoints, run, sweep, unscented
from navfilters.estimators.adaptive import AdaptiveNoise
from navfilters.estimators.continuous import ContinuousSystem, extended_kalman_bucy
from navfilters.estimators.robust import AdaptiveRobust, Robust
from navfilters.models import Linear, RangeBearing
from navfilters.numerics import validation
from navfilters.runs.chi_square import chi_square_band
from navfilters.runs.consistency import coverage
from navfilters.space.earth_fixed_orbit import EarthFixedOrbit
from navfilters.space.inertial_orbit import Orbit

MODEL = RangeBearing(np.diag([0.04, 1e-4]))
PRIORS = Gaussian(np.array([[28.0, 41.0], [31.0, 38.0], [33.0, 42.0]]), 4 * np.eye(2))
Z = np.array([50.2, 0.92])
quiet = partial(sweep, progress=False)
START = Filter(rule=Robust()).init(PRIORS)

REAL = {
    "float32": np.float32,
    "float16": np.float16,
    "longdouble": np.longdouble,
    "no axes": np.array,
    "float32, no axes": lambda x: np.array(x, np.float32),
    "big-endian": lambda x: np.array(x, ">f8"),
}
WHOLE = {
    "int8": np.int8,
    "uint64": np.uint64,
    "no axes": np.array,
    "uint8, no axes": lambda k: np.array(k, np.uint8),
}


def filtered(**options):
    """With every number exactly a float16, so that the kinds do not differ by rounding."""
    name = "B-UKF" if "points" in options else "B-EKF 1"
    return run(partial(FILTERS[name], **options), PRIORS, Z, MODEL, 2).mean


OPTIONS = {
    "bump": (0.5, lambda x: filtered(bump=x)),
    "alpha": (0.5, lambda x: filtered(points=SigmaPoints(alpha=x))),
    "beta": (1.5, lambda x: filtered(points=SigmaPoints(beta=x))),
    "kappa": (0.5, lambda x: filtered(points=SigmaPoints(kappa=x))),
    "gamma": (512.0, lambda x: Filter(rule=Robust(gamma=x)).update(START, Z, MODEL).estimate.cov),
    "a": (0.25, lambda x: AdaptiveNoise(a=x).a * 1.0),
    "alpha of the adaptive robust rule": (0.25, lambda x: AdaptiveRobust(alpha=x).alpha * 1.0),
    "lam": (1.5, lambda x: AdaptiveRobust(lam=x).lam * 1.0),
    "step": (0.5, lambda x: Orbit(step=x, substeps=2).transition(ORBIT)[0]),
    "rate": (0.5, lambda x: EarthFixedOrbit(rate=x).acceleration(ORBIT)),
    "k": (2.5, lambda x: coverage(np.ones((5, 2)), np.eye(2), x, runs_axis=0).expected),
    "confidence": (0.875, lambda x: chi_square_band(3, 4, x)),
    "dof": (3, lambda x: chi_square_band(x)),
}
ORBIT = np.array([7e6, 0.0, 0.0, 0.0, 7.5e3, 0.0])


@pytest.mark.parametrize("kind", REAL)
@pytest.mark.parametrize("name", OPTIONS)
def test_numpys_numbers_are_numbers(name, kind):
    value, go = OPTIONS[name]
    assert_array_equal(go(REAL[kind](value)), go(value))


@pytest.mark.parametrize("bad", [True, np.True_, np.array(True), "0.5", 1 + 0j, np.nan])
@pytest.mark.parametrize("name", OPTIONS)
def test_what_is_no_number_is_refused_by_name(name, bad):
    with pytest.raises(ValueError, match=rf"{name.split()[0]} must.*; found"):
        OPTIONS[name][1](bad)


@pytest.mark.parametrize("bad", [-1.0, np.float32(-1), [-1.0, 2.0], np.array(-1), np.int8(-1)])
def test_a_negative_bump_is_refused_whatever_its_kind(bad):
    with pytest.raises(ValueError, match="bump must be at least 0; found -1"):
        FILTERS["B-EKF 1"](Gaussian(PRIORS.mean[:2], PRIORS.cov), Z, MODEL, bump=bad)


@pytest.mark.parametrize("bad", [-2.0, np.float32(-2), np.int8(-2), np.array(-2), [1.0, -2.0]])
def test_a_kappa_of_minus_n_is_refused_whatever_its_kind(bad):
    with pytest.raises(ValueError, match="kappa must be larger than -2"):
        SigmaPoints(kappa=bad).weights(2)


COUNTS = {
    "steps": (3, lambda k: run(FILTERS["EKF"], PRIORS, Z, MODEL, k).mean),
    "steps of a sweep": (3, lambda k: quiet(FILTERS["EKF"], PRIORS, Z, MODEL, k).final.mean),
    "chunk": (2, lambda k: quiet(FILTERS["EKF"], PRIORS, Z, MODEL, 2, chunk=k).final.mean),
    "workers": (1, lambda k: quiet(FILTERS["EKF"], PRIORS, Z, MODEL, 2, workers=k).final.mean),
    "substeps": (3, lambda k: Orbit(substeps=k).transition(ORBIT)[0]),
    "N": (4, lambda k: AdaptiveNoise(N=k).init(PRIORS).innovations),
    "k": (3, lambda k: AdaptiveNoise(k=k).init(PRIORS).innovations),
}


@pytest.mark.parametrize("kind", WHOLE)
@pytest.mark.parametrize("name", COUNTS)
def test_numpys_integers_are_integers(name, kind):
    value, go = COUNTS[name]
    assert_array_equal(go(WHOLE[kind](value)), go(value))


@pytest.mark.parametrize(
    "bad",
    [True, np.True_, np.array(True), 3.0, np.float32(3), np.array(3.0), [3], np.array([3]), "3"],
)
@pytest.mark.parametrize("name", COUNTS)
def test_what_is_no_integer_is_refused_by_name(name, bad):
    with pytest.raises(ValueError, match=rf"{name.split()[0]} must be an integer of at least"):
        COUNTS[name][1](bad)


@pytest.mark.parametrize("bad", ["yes", 1, None, np.ones(2, bool), 0.0])
@pytest.mark.parametrize("door", [run, quiet])
def test_a_flag_is_true_or_false(door, bad):
    with pytest.raises(ValueError, match="z_per_step must be True or False; found"):
        door(FILTERS["EKF"], PRIORS, Z, MODEL, 2, z_per_step=bad)


@pytest.mark.parametrize("yes", [True, np.True_, np.array(True)])
def test_numpys_bools_are_flags(yes):
    z = np.stack([Z, Z + 0.01])
    got = quiet(FILTERS["EKF"], PRIORS, z, MODEL, 2, z_per_step=yes).final.mean
    assert_array_equal(got, run(FILTERS["EKF"], PRIORS, z, MODEL, 2, z_per_step=yes).mean[-1])


LISTS = [
    [0.5, 1.0, 2.0],
    (0.5, 1, 2),
    [np.float32(0.5), 1.0, np.int64(2)],
    [np.array(0.5), np.array(1.0), 2],
    np.array([0.5, 1.0, 2.0], np.float32),
]


@pytest.mark.parametrize("engine", ["numpy", pytest.param("jax", marks=pytest.mark.slow)])
@pytest.mark.parametrize("values", LISTS, ids=range(len(LISTS)))
@pytest.mark.parametrize("option", ["bump", "alpha"])
def test_a_list_of_any_numbers_is_dealt_out(option, values, engine):
    """One value for each configuration, whatever the chunk."""

    def estimator(value):
        if option == "bump":
            return partial(FILTERS["B-EKF 1"], bump=value)
        return partial(FILTERS["UKF"], points=SigmaPoints(alpha=value))

    got = quiet(estimator(values), PRIORS, Z, MODEL, 2, chunk=2, engine=engine).final.mean
    alone = [
        run(estimator(v), Gaussian(mean, PRIORS.cov), Z, MODEL, 2).mean[-1]
        for v, mean in zip([0.5, 1.0, 2.0], PRIORS.mean, strict=True)
    ]
    assert_allclose(got, alone, rtol=1e-12)


def test_a_list_of_lists_is_a_grid():
    estimator = partial(FILTERS["B-EKF 1"], bump=[[0.5], [1.0]])
    got = quiet(estimator, PRIORS, Z, MODEL, 2, chunk=4).final.mean
    assert got.shape == (2, 3, 2)
    assert_allclose(got, run(estimator, PRIORS, Z, MODEL, 2).mean[-1], rtol=1e-12)


SYSTEM = ContinuousSystem(lambda x, u, w, t: -x + w, lambda x, v, t: x + v, [[1.0]], [[1.0]])


@pytest.mark.parametrize("name", ["rtol", "atol"])
def test_the_integrators_tolerances(name):
    def go(value):
        prior = Gaussian([1.0], [[2.0]])
        options = {name: value}
        return extended_kalman_bucy(SYSTEM, prior, lambda t: [0.5], [0, 1], **options).mean

    wanted = go(2.0**-20)
    for kind in REAL.values():
        assert_array_equal(go(kind(2.0**-20)), wanted)
    for bad in (True, np.True_, "1e-6", [1e-6], None, 0.0, -1.0):
        with pytest.raises(ValueError, match=f"{name} must be"):
            go(bad)


def test_a_number_is_kept_as_pythons():
    """So that it can be hashed, compared and compiled."""
    assert type(Orbit(step=np.array(2.0)).step) is float
    assert type(replace(AdaptiveNoise(), N=np.array(7)).N) is int
    assert validation.number("x", np.float32(0.5), above=0) == 0.5


class OfTheStatesType:
    """An h whose value is made as an array like its argument."""

    R = np.eye(1)

    def h(self, x):
        value = np.zeros_like(x[..., :1])
        value[..., 0] = x[..., 0] ** 2 / 10
        return value


@pytest.mark.parametrize("cov", [np.diag([50, 0]), np.array([[2, 2], [2, 2]]), np.diag([4, 3])])
@pytest.mark.parametrize("name", ["EKF", "mtSOF", "UKF", "UKFz"])
def test_a_prior_of_whole_numbers_is_one_of_real_ones(name, cov):
    """np.diag([50, 0]) has whole numbers: so had its root, 7 instead of 7.07."""
    for model in (OfTheStatesType(), Linear(np.eye(2)[:1], np.eye(1))):
        whole = FILTERS[name](Gaussian(np.array([5, 2]), cov), np.array([3]), model)
        real = FILTERS[name](Gaussian(np.array([5.0, 2.0]), 1.0 * cov), np.array([3.0]), model)
        assert_array_equal(whole.mean, real.mean)
        assert_array_equal(whole.cov, real.cov)


def test_moments_of_a_prior_of_whole_numbers():
    model, cov = Linear(np.eye(2), np.eye(2)), np.diag([50, 0])
    got, wanted = (unscented(Gaussian(np.zeros(2), P), model) for P in (cov, 1.0 * cov))
    assert_array_equal(got.P_zz, wanted.P_zz)
