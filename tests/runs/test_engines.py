"""The JAX engine gives NumPy's numbers, once per shape, and nobody needs JAX to import."""

from functools import partial

import jax
import numpy as np
import pytest
from moving import WITH_MEMORY, moving
from naive import covariances
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Filter, Gaussian, SigmaPoints, SweepError, first_indefinite, sweep
from navfilters.estimators.robust import Robust
from navfilters.models import RangeBearing
from navfilters.papers.perea2007.experiment import Setup
from navfilters.runs import compiled, records

pytestmark = pytest.mark.slow

BASE = Setup()
MODEL = BASE.model
quiet = partial(sweep, progress=False)
jitted = partial(quiet, engine="jax")


def priors(count, seed=0):
    rng = np.random.default_rng(seed)
    return Gaussian(rng.normal(BASE.x0, 10.0, (count, 2)), 2e3 * covariances(rng, (count,), 2))


def assert_same(got, wanted):
    for ours, theirs in zip(got, wanted, strict=True):
        assert_array_equal(ours, theirs)


def assert_close(got, wanted):
    """To 1e-9 of the largest element, in arrays of NumPy."""
    for ours, theirs in zip(got, wanted, strict=True):
        assert isinstance(ours, np.ndarray)
        assert ours.dtype == theirs.dtype
        assert_allclose(ours, theirs, rtol=0, atol=1e-9 * np.abs(theirs).max())


def largest_change(a, b):
    """Per member, relative to the largest element of its mean and of its covariance."""
    changes = []
    for x, y in zip(a, b, strict=True):
        axes = tuple(range(1, x.ndim))
        changes.append(np.max(np.abs(x - y), axis=axes) / np.max(np.abs(x), axis=axes))
    return np.max(changes, axis=0)


def last_bit_changes(prior, z):
    """The input with the last bit of its means, of its covariances, or of z changed."""
    yield Gaussian(np.nextafter(prior.mean, np.inf), prior.cov), z
    yield Gaussian(np.nextafter(prior.mean, -np.inf), prior.cov), z
    yield Gaussian(prior.mean, np.nextafter(prior.cov, np.inf)), z
    yield prior, np.nextafter(z, np.inf)


@pytest.mark.parametrize("name", FILTERS)
def test_engines_agree_where_the_result_is_not_a_matter_of_the_last_bit(name):
    """To 1e-6 where a last-bit change of the input moves the result by less than 1e-8."""
    prior, z, steps = priors(60), BASE.z, 30
    wanted = quiet(FILTERS[name], prior, z, MODEL, steps).final
    with np.errstate(all="ignore"):
        moved = [
            largest_change(quiet(FILTERS[name], p, y, MODEL, steps).final, wanted)
            for p, y in last_bit_changes(prior, z)
        ]
        settled = np.max(moved, axis=0) < 1e-8
        got = jitted(FILTERS[name], prior, z, MODEL, steps).final
        apart = largest_change(got, wanted)
    assert settled.sum() >= 15
    assert apart[settled].max() < 1e-6


def everything(state):
    distance = records.Distance(np.array(BASE.x_true))
    return records.estimate(state), records.definite(state), distance(state)


def test_everything_kept_agrees():
    rng = np.random.default_rng(3)
    z = BASE.z + rng.normal(size=(7, 1, 2)) * [5.0, 0.1]
    kept = partial(
        quiet,
        partial(
            FILTERS["B-UKF"], bump=rng.uniform(0, 1, 9), points=SigmaPoints(rng.uniform(0.5, 1, 9))
        ),
        priors(9),
        z,
        RangeBearing(MODEL.R * rng.uniform(10, 100, (9, 1, 1))),
        7,
        z_per_step=True,
        record=everything,
    )
    got, wanted = kept(engine="jax"), kept()
    assert got.record[1].dtype == bool
    assert_array_equal(got.record[1], wanted.record[1])
    assert_allclose(got.record[2], wanted.record[2], rtol=1e-10)
    for ours, theirs in zip(
        (*got.final, *got.record[0]), (*wanted.final, *wanted.record[0]), strict=True
    ):
        assert isinstance(ours, np.ndarray)
        assert ours.dtype == np.float64
        assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9 * np.abs(theirs).max())


@pytest.mark.parametrize("steps", [0, 1, 2])
def test_few_steps(steps):
    kept = partial(quiet, FILTERS["EKF"], priors(3), BASE.z, MODEL, steps, record=records.estimate)
    got, wanted = kept(engine="jax"), kept()
    assert got.record.mean.shape == (steps + 1, 3, 2)
    for ours, theirs in zip(
        (*got.final, *got.record), (*wanted.final, *wanted.record), strict=True
    ):
        assert_allclose(ours, theirs, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("name", WITH_MEMORY)
def test_filters_with_a_memory(name):
    """The AREKF's memory is None before its first step."""
    prior, z, sensor, dynamics, steps = moving()
    go = partial(quiet, WITH_MEMORY[name], prior, z, sensor, steps, dynamics=dynamics)
    got, wanted = (go(z_per_step=True, engine=engine).state for engine in ("jax", "numpy"))
    assert type(got) is type(wanted)
    assert_close(jax.tree.leaves(got), jax.tree.leaves(wanted))


@pytest.mark.usefixtures("compiled_as_users_do")
def test_members_depend_on_neither_chunk_nor_order_nor_workers():
    """Blocks are the same program in any chunk of at least one block."""
    count = compiled.BLOCK + 100
    go = partial(jitted, FILTERS["UKF"], z=BASE.z, model=MODEL, steps=20)
    wanted = go(priors=priors(count)).final
    for options in ({"chunk": 2 * compiled.BLOCK}, {"chunk": compiled.BLOCK, "workers": 2}):
        assert_same(go(priors=priors(count), **options).final, wanted)
    order = np.random.default_rng(1).permutation(count)
    got = go(priors=Gaussian(*(part[order] for part in priors(count)))).final
    assert_same(got, (part[order] for part in wanted))


def test_small_chunks_agree_but_for_the_last_bits():
    """One step from the same state; many steps carry the difference on."""
    wanted = jitted(FILTERS["B-EKF 1"], priors(20), BASE.z, MODEL, 1).final
    for chunk in (1, 7):
        got = jitted(FILTERS["B-EKF 1"], priors(20), BASE.z, MODEL, 1, chunk=chunk).final
        assert_allclose(got.mean, wanted.mean, rtol=1e-13)
        assert_allclose(got.cov, wanted.cov, rtol=0, atol=1e-13 * 1e4)


@pytest.mark.usefixtures("compiled_as_users_do")
@pytest.mark.parametrize("engine", ["numpy", "jax"])
def test_a_member_that_fails_is_nan_alone(engine):
    count, bad = compiled.BLOCK + 3, compiled.BLOCK + 1
    mean = priors(count).mean.copy()
    mean[bad] = 0.0  # no derivative
    go = partial(quiet, FILTERS["EKF"], z=BASE.z, model=MODEL, steps=4, engine=engine)
    got = go(priors=Gaussian(mean, priors(count).cov), record=records.definite)
    healthy = go(priors=priors(count)).final
    others = np.arange(count) != bad
    for ours, wanted in zip(got.final, healthy, strict=True):
        assert_array_equal(ours[others], wanted[others])
        assert np.isnan(ours[bad]).all()
    assert np.flatnonzero(first_indefinite(got.record) >= 0).tolist() == [bad]


def test_a_shape_is_compiled_once():
    """The last chunk is padded; other values of arrays, another sweep: the same program."""
    before = compiled._program.cache_info().misses
    for scale in (1.0, 2.0):
        model = RangeBearing(MODEL.R * scale)
        jitted(FILTERS["B-EKF 2"], priors(23, seed=int(scale)), BASE.z * scale, model, 3, chunk=10)
    assert compiled._program.cache_info().misses == before + 1


def test_the_users_precision_is_left_alone():
    with jax.enable_x64(False):
        jitted(FILTERS["EKF"], priors(3), BASE.z, MODEL, 2)
        assert jax.numpy.ones(1).dtype == np.float32


def test_what_does_not_compile_says_so():
    prior, z, sensor, dynamics, steps = moving()
    host_only = Filter(rule=Robust(9.0, on_violation="raise"))
    with pytest.raises(SweepError, match=r"configuration 0 to 5: TracerBoolConversionError"):
        jitted(host_only, prior, z, sensor, steps, dynamics=dynamics, z_per_step=True)
