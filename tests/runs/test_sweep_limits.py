"""Filters with a memory in a sweep, its sizes, and every input that is refused."""

import tracemalloc
from functools import partial

import numpy as np
import pytest
from moving import WITH_MEMORY, moving
from sweeps import BASE, EKF, MODEL, assert_same, priors, quiet

from navfilters import FILTERS, Gaussian, SigmaPoints
from navfilters.models import Linear, RangeBearing
from navfilters.runs import records
from navfilters.runs.problems import CACHED, SENT, Problem


@pytest.mark.parametrize("name", WITH_MEMORY)
def test_filters_with_a_memory_go_step_by_step(name):
    """The final state has the counters; the record is of the estimates."""
    prior, z, sensor, dynamics, steps = moving()
    options = {"dynamics": dynamics, "z_per_step": True, "record": records.estimate, "chunk": 4}
    got = quiet(WITH_MEMORY[name], prior, z, sensor, steps, **options)
    state, states = WITH_MEMORY[name].init(prior), [prior]
    for k in range(steps):
        state = WITH_MEMORY[name].step(state, z[k], sensor, dynamics, k)
        states.append(state.estimate)
    assert type(got.state) is type(state)
    assert type(got.state.memory) is type(state.memory)
    assert_same(got.final, state.estimate)
    assert_same(got.state.memory or (), state.memory or ())
    assert_same(got.state[3:], state[3:])
    assert_same(got.record, map(np.stack, zip(*states, strict=True)))


def test_a_filter_with_a_memory_and_no_steps():
    prior, _, sensor, dynamics, _ = moving()
    got = quiet(WITH_MEMORY["AREKF"], prior, np.zeros(2), sensor, 0, dynamics=dynamics)
    assert_same(got.final, prior)
    assert got.state.innovation is got.state.S is got.state.memory.P_y_bar is None
    assert got.state.memory.robust.tolist() == got.state.missed.tolist() == [0] * 6


def size_of(count, n=2, steps=1, series_bytes=0):
    prior = Gaussian(np.ones((count, n)), np.eye(n))
    model = Linear(np.eye(n), np.eye(n))
    return Problem.of(EKF, prior, np.ones(n), model, None, None, 1, False).size(steps, series_bytes)


def test_chunks_are_equal_and_fit_the_cache():
    most = CACHED // 4
    assert [size_of(count) for count in (1, 100, most)] == [1, 100, most]
    assert size_of(most + 2) == most // 2 + 1
    assert size_of(10**6, n=8) == pytest.approx(CACHED // 64, rel=0.01)
    assert size_of(10**4, series_bytes=SENT // 50) == 50
    assert size_of(10, series_bytes=2 * SENT) == 1


def test_long_sweeps_have_chunks_for_several_workers():
    assert size_of(10**5, steps=1000) == pytest.approx(10**5 / 8, rel=0.01)
    assert size_of(10**4, steps=1000) == 10**4
    assert size_of(10**4, steps=1001) == 2000  # not 1250, which costs a quarter more
    assert size_of(10**6, steps=1000) == pytest.approx(CACHED // 4, rel=0.02)


def test_a_series_that_is_given_counts_too():
    z = np.broadcast_to(BASE.z, (1000, 11, 2))
    problem = Problem.of(EKF, priors(), z, MODEL, None, None, 1000, True)
    assert problem.size(1000, SENT // 2 - 1000) == 1
    assert problem.size(1000, 0) == 11


def peak(count, **options):
    """Bytes allocated at one time during a sweep, without its input."""
    many = Gaussian(np.tile(BASE.x0, (count, 1)), np.tile(np.eye(2), (count, 1, 1)))
    tracemalloc.start()
    quiet(EKF, many, BASE.z, MODEL, record=records.definite, **options)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return most


def test_memory_per_configuration_is_small_and_does_not_grow_with_the_steps():
    """A million of them: 24 doubles each for the result and the check of the input, 0.2 GB."""
    peak(10, steps=1)  # imports
    small, large = (peak(count, steps=2, chunk=500) for count in (4000, 40000))
    assert (large - small) / 36000 < 24 * 8
    assert peak(4000, steps=20, chunk=500) < 1.2 * small


class Slots:
    """Range and bearing, in an object without attributes of its own to look into."""

    __slots__ = ("R",)

    def __init__(self, R):
        self.R = R

    def h(self, x):
        return MODEL.h(x)

    def jacobian(self, x):
        return MODEL.jacobian(x)


REFUSED = {
    "priors: a tuple": ({"priors": ([0.0, 0.0], np.eye(2))}, "priors must be a Gaussian.*tuple"),
    "priors: indefinite": (
        {"priors": Gaussian([1.0, 2.0], -np.eye(2))},
        r"priors.cov.*eigenvalue -1",
    ),
    "priors: three components": (
        {"priors": Gaussian(np.ones(3), np.eye(3))},
        r"priors.mean.*\(3,\)",
    ),
    "priors: none": (
        {"priors": Gaussian(np.ones((0, 2)), np.eye(2))},
        r"priors.*at least one configuration; found.*\(0,\)",
    ),
    "z: infinite": ({"z": [1.0, np.inf]}, "z must be finite, or NaN.*inf at index"),
    "z: too few": (
        {"z": np.ones((4, 2)), "z_per_step": True},
        r"z must have.*5 steps; found \(4, 2\)",
    ),
    "z: other batch": ({"z": np.ones((3, 2))}, r"broadcast; found.*priors.mean \(11,\).*z \(3,\)"),
    "model: other batch": (
        {"model": RangeBearing(np.stack([np.eye(2)] * 3))},
        r"broadcast; found.*model.R \(3,\)",
    ),
    "model: opaque batch": (
        {"model": Slots(np.stack([np.eye(2)] * 11))},
        "model must be a dataclass if it has batch axes.*Slots",
    ),
    "option: other batch": (
        {"estimator": partial(FILTERS["B-EKF 1"], bump=np.ones(3))},
        r"broadcast; found.*estimator.variant.bump \(3,\)",
    ),
    "option: other batch, inside": (
        {"estimator": partial(FILTERS["UKF"], points=SigmaPoints([0.5, 0.7, 1.0]))},
        r"broadcast; found.*estimator.moments.points.alpha \(3,\)",
    ),
    "steps": ({"steps": -1}, "steps must be an integer of at least 0; found -1"),
    "engine": ({"engine": "torch"}, "engine must be 'numpy' or 'jax'; found 'torch'"),
    "truth: other batch": (
        {"record": records.Distance(np.ones((3, 2)))},
        r"broadcast; found.*record.truth \(3,\)",
    ),
    "workers": ({"workers": 0}, "workers must be an integer of at least 1; found 0"),
    "chunk": ({"chunk": 1.5}, "chunk must be an integer of at least 1; found 1.5"),
    "dynamics: the sensor": (
        {"dynamics": MODEL},
        "dynamics must have Q and one of f, transition and propagate; found RangeBearing",
    ),
    "model: the dynamics": ({"model": moving()[3]}, "model must have R, and h.*found Swing"),
}


def never(prior, z, model):
    raise AssertionError("the estimator was called before its inputs were checked")


@pytest.mark.parametrize(("changes", "message"), REFUSED.values(), ids=REFUSED)
def test_bad_input_is_refused_before_any_step(changes, message):
    arguments = {"estimator": never, "priors": priors(), "z": BASE.z, "model": MODEL, "steps": 5}
    with pytest.raises(ValueError, match=f"(?s){message}"):
        quiet(**arguments | changes)


def test_an_estimator_that_is_none_is_refused():
    with pytest.raises(TypeError, match=r"estimator must be a filter.*init and step.*found 'EKF'"):
        quiet("EKF", priors(), BASE.z, MODEL, 5)


@pytest.mark.parametrize(
    "estimator",
    [
        lambda prior, z, model: Gaussian(prior.mean[0], prior.cov),
        lambda prior, z, model: Gaussian(np.float64(1.0), np.float64(1.0)),
    ],
)
def test_a_result_without_its_configurations_is_refused(estimator):
    with pytest.raises(ValueError, match=r"estimator must return arrays whose first axis"):
        quiet(estimator, priors(), BASE.z, MODEL, 5)


def test_an_option_that_the_filter_lacks_is_refused():
    with pytest.raises(TypeError, match=r"unknown options \['bump'\]; this filter has none"):
        quiet(partial(EKF, bump=1.0), priors(), BASE.z, MODEL)
