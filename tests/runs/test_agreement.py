"""Run and sweep are one loop: for every filter and rule, with dynamics and without, chunked."""

from functools import partial

import numpy as np
import pytest
from moving import moving
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Filter, Gaussian, first_indefinite, run, sweep
from navfilters.estimators.adaptive import AdaptiveNoise
from navfilters.estimators.robust import AdaptiveRobust, Robust
from navfilters.models import Linear
from navfilters.papers.perea2007.experiment import FILTERS as PAPER
from navfilters.runs import records

engines = pytest.mark.parametrize("engine", ["numpy", pytest.param("jax", marks=pytest.mark.slow)])
quiet = partial(sweep, progress=False)
RULED = {
    f"{name}, {rule}": Filter(FILTERS[name].moments, FILTERS[name].variant, made)
    for name in ("EKF", "mtSOF", "UKF", "B-EKF 1")
    for rule, made in {
        "robust": Robust(np.linspace(3.0, 9.0, 6)),
        "adaptive robust": AdaptiveRobust(0.4),
        "adaptive": AdaptiveNoise(0.2, 1, 3, np.eye(3)[:, :2]),
    }.items()
}
ALL = {name: f for name, f in FILTERS.items() if name != "B-EKF 3"} | RULED  # needs m = n


def everything(state):
    return state.estimate, state.missed, state.innovation, state.S, state.memory


def leaves(record):
    if isinstance(record, tuple):
        return [leaf for part in record for leaf in leaves(part)]
    return [] if record is None else [record]


@engines
@pytest.mark.parametrize("driven", [False, True])
@pytest.mark.parametrize("name", ALL)
def test_run_and_sweep_agree(name, driven, engine):
    """To the last bit on the host; a tuple of tuples, and None that becomes an array."""
    if engine == "jax" and name not in {"UKF", "mtSOF", "EKF, adaptive robust", "EKF, adaptive"}:
        pytest.skip("compiles the same parts")
    prior, z, sensor, dynamics, _ = moving()
    z[4, 2], z[3, 1, 0] = np.nan, np.nan
    dynamics = dynamics if driven else None
    go = {"dynamics": dynamics, "z_per_step": True, "record": everything}
    with np.errstate(all="ignore"):
        wanted = leaves(run(ALL[name], prior, z, sensor, **go))
        got = quiet(ALL[name], prior, z, sensor, **go, engine=engine, chunk=4)
    assert len(leaves(got.record)) == len(wanted) >= 5
    for ours, theirs in zip(leaves(got.record), wanted, strict=True):
        theirs = np.broadcast_to(theirs, ours.shape)
        if engine == "numpy":
            assert_array_equal(ours, theirs)
        else:
            scale = np.nanmax(np.abs(theirs), initial=1.0)
            assert_allclose(ours, theirs, rtol=0, atol=1e-9 * scale)
    last = leaves((got.state.estimate, got.state.innovation, got.state.S))
    for ours, theirs in zip(last, [*got.record[0], got.record[2], got.record[3]], strict=True):
        assert_array_equal(ours, theirs[-1])


@engines
def test_an_innovation_before_the_first_step_is_nan(engine):
    prior, z, sensor, dynamics, _ = moving()
    go = {"dynamics": dynamics, "z_per_step": True, "record": lambda state: state.innovation}
    got = quiet(FILTERS["EKF"], prior, z, sensor, **go, engine=engine).record
    assert got.shape == (10, 6, 2)
    assert np.isnan(got[0]).all()
    assert np.isfinite(got[1:]).all()
    assert_allclose(got, run(FILTERS["EKF"], prior, z, sensor, **go), rtol=1e-9)


def test_records_come_from_other_processes_too():
    prior, z, sensor, dynamics, _ = moving()
    go = partial(quiet, ALL["EKF, adaptive robust"], prior, z, sensor, dynamics=dynamics)
    one, two = (go(z_per_step=True, record=everything, workers=w, chunk=2) for w in (1, 2))
    for ours, theirs in zip(leaves(two.record), leaves(one.record), strict=True):
        assert_array_equal(ours, theirs)


def test_z_may_measure_when_it_is_asked():
    """A function of the step and of the predicted state; the same numbers as those of an array."""
    prior, z, sensor, dynamics, steps = moving()
    asked = []

    def measure(k, state):
        asked.append((k, state.estimate.mean))
        return z[k]

    go = partial(run, ALL["UKF, robust"], prior, model=sensor, steps=steps, dynamics=dynamics)
    got, wanted = go(z=measure), go(z=z, z_per_step=True)
    assert_array_equal(got.mean, wanted.mean)
    assert [k for k, _ in asked] == [*range(steps)]
    first = ALL["UKF, robust"].init(prior)
    assert_array_equal(asked[0][1], ALL["UKF, robust"].predict(first, dynamics).estimate.mean)


# --- rounding: shared case 13 -------------------------------------------------------------------


@engines
def test_josephs_form_keeps_what_the_short_one_loses(engine):
    """A vague prior and two sharp sensors nearly parallel; exact, in closed form: 5.0e-5, 5.0e3."""
    model = Linear([[1.0, 1e-4], [1.0, -1e-4]], 1e-4 * np.eye(2))
    prior = Gaussian([0.0, 0.0], 1e6 * np.eye(2))

    def record(state):
        return records.definite(state), state.estimate.cov

    go = partial(quiet, priors=prior, z=[1.0, 1.0], model=model, steps=2, record=record)
    definite, cov = go(FILTERS["EKF"], engine=engine).record
    assert definite.dtype == bool
    assert first_indefinite(definite) == -1
    exact = 1 / (1e-6 + 2e4), 1 / (1e-6 + 2e-4)
    assert_allclose(np.diag(cov[1]), exact, rtol=1e-3)
    definite, cov = go(PAPER["EKF"], engine=engine).record
    assert abs(cov[1, 0, 0] - exact[0]) > 0.1 * exact[0]


def test_first_indefinite_of_whether_they_are():
    definite = np.array([[True, False, True], [True, True, False], [True, False, True]])
    assert first_indefinite(definite).tolist() == [-1, 0, 1]
    assert first_indefinite(np.array([True, False, True])) == 1


# --- combinations that make no sense ------------------------------------------------------------


class Silent:
    """A sensor's noise and nothing more."""

    R = np.eye(2)


class Restless:
    Q = np.eye(3)


def wrong():
    prior, z, sensor, dynamics, _ = moving()
    ekf = FILTERS["EKF"]
    return {
        "a function in a sweep": (
            lambda: sweep(ekf, prior, lambda k, state: z[0], sensor, 2),
            TypeError,
            "z must be an array in a sweep; run takes a function",
        ),
        "a function for a plain function": (
            lambda: run(lambda p, z, m: p, prior, lambda k, state: z[0], sensor, 2),
            None,
            None,
        ),
        "a function for a stranger": (
            lambda: run(Stranger(), prior, lambda k, state: z[0], sensor, 2),
            TypeError,
            "must have predict and update where z is a function.*Stranger",
        ),
        "dynamics without f": (
            lambda: run(ekf, prior, z[0], sensor, 2, dynamics=Restless()),
            ValueError,
            "dynamics must have Q and one of f, transition and propagate; found Restless",
        ),
        "dynamics without Q": (
            lambda: run(ekf, prior, z[0], sensor, 2, dynamics=sensor),
            ValueError,
            "dynamics must have Q and one of.*found Quadratic",
        ),
        "a pair of models": (
            lambda: run(ekf, prior, z[0], (dynamics, sensor), 2),
            ValueError,
            "model must have R, and h.*found tuple",
        ),
        "a sensor without h": (
            lambda: run(ekf, prior, z[0], Silent(), 2),
            ValueError,
            "model must have R, and h.*found Silent",
        ),
        "a sensor without h, in a sweep": (
            lambda: sweep(ekf, prior, z[0], Silent(), 2),
            ValueError,
            "model must have R, and h.*found Silent",
        ),
        "an unknown option": (
            lambda: run(partial(ekf, bumps=1.0), prior, z[0], sensor, 2),
            TypeError,
            r"unknown options \['bumps'\]; this filter has none",
        ),
        "a rule for a filter": (
            lambda: run(Robust(9.0), prior, z[0], sensor, 2),
            TypeError,
            "estimator must be a filter.*found Robust",
        ),
        "a record that is none": (
            lambda: run(ekf, prior, z[0], sensor, 2, record="mean"),
            TypeError,
            r"record must be callable as record\(state\); found 'mean'",
        ),
    }


class Stranger:
    def init(self, prior):
        return FILTERS["EKF"].init(prior)

    def step(self, state, z, sensor, dynamics, k):
        return FILTERS["EKF"].step(state, z, sensor, dynamics, k)


@pytest.mark.parametrize("case", wrong())
def test_a_wrong_combination_is_a_clear_error(case):
    go, error, message = wrong()[case]
    if error is None:
        go()
        return
    with pytest.raises(error, match=f"(?s){message}"):
        go()
