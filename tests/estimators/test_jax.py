"""The same source under JAX: compiled updates agree with NumPy, and nobody needs JAX to import."""

import subprocess
import sys

import jax
import numpy as np
import pytest
from naive import covariances, quadratic
from numpy.testing import assert_allclose
from xla import AS_USERS_DO

from navfilters import FILTERS, Gaussian, SigmaPoints
from navfilters.models import Linear, RangeBearing

every_filter = pytest.mark.parametrize("name", FILTERS)


def options_of(name, root="cholesky"):
    """Away from every default."""
    values = {"bump": 0.7, "points": SigmaPoints(0.6, 1.0, 2.0, root)}
    return {key: values[key] for key in FILTERS[name].options}


def compiled(name, model, xla=None, **options):
    return jax.jit(lambda prior, z: FILTERS[name](prior, z, model, **options), compiler_options=xla)


def problem(count=6):
    rng = np.random.default_rng(0)
    angle = rng.uniform(-2.5, 2.5, count)
    x = rng.uniform(5, 50, (count, 1)) * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    model = RangeBearing(np.array([[0.5, 0.02], [0.02, 0.01]]))
    z = model.h(x) + rng.normal(size=(count, 2)) * [3.0, 0.1]
    return Gaussian(x, 4 * covariances(rng, (count,), 2)), z, model


def problem_of_three(count=6):
    rng = np.random.default_rng(1)
    prior = Gaussian(rng.normal(size=(count, 3)), 0.1 * covariances(rng, (count,), 3))
    return prior, rng.normal(size=(count, 3)), quadratic(rng, 3, 3)


def linear_problem():
    rng = np.random.default_rng(2)
    model = Linear(rng.normal(size=(2, 2)) + 2 * np.eye(2), covariances(rng, (), 2))
    return Gaussian(rng.normal(size=(6, 2)), covariances(rng, (6,), 2)), np.ones(2), model


def assert_agree(got, wanted, prior):
    """To 1e-12 of the prior's size, where the update started from."""
    assert isinstance(got.mean, jax.Array)
    assert got.mean.dtype == got.cov.dtype == np.float64
    size = np.abs(wanted.mean).max() + np.abs(prior.mean).max()
    assert_allclose(got.mean, wanted.mean, rtol=0, atol=1e-12 * size)
    assert_allclose(got.cov, wanted.cov, rtol=0, atol=1e-12 * np.abs(prior.cov).max())


@every_filter
def test_one_member(name):
    """With all of XLA's optimisations."""
    prior, z, model = problem()
    one = Gaussian(prior.mean[0], prior.cov[0])
    got = compiled(name, model, AS_USERS_DO, **options_of(name))(one, z[0])
    assert_agree(got, FILTERS[name](one, z[0], model, **options_of(name)), one)


@pytest.mark.parametrize(
    ("name", "make"),
    [(name, make) for name in FILTERS for make in (problem, problem_of_three)]
    + [("mtSOF", linear_problem), ("UKFz", linear_problem)],
)
def test_a_batch(name, make):
    """Two by two in closed form, three by three by elimination and eigenvalues, and h(x) = H x."""
    prior, z, model = make()
    options = options_of(name, "symmetric")
    got = compiled(name, model, **options)(prior, z)
    assert_agree(got, FILTERS[name](prior, z, model, **options), prior)


@pytest.mark.parametrize("name", ["B-EKF 3", "mtSOF", "B-UKF"])
@pytest.mark.parametrize("make", [problem, problem_of_three])
def test_a_nan_member_stays_alone(name, make):
    prior, z, model = make()
    bad = prior.cov.copy()
    bad[2] = np.nan
    update = compiled(name, model, **options_of(name, "symmetric"))
    got, healthy = update(Gaussian(prior.mean, bad), z), update(prior, z)
    others = np.array([0, 1, 3, 4, 5])
    for ours, wanted in zip(got, healthy, strict=True):
        assert np.isnan(ours[2]).all()
        assert np.isfinite(wanted).all()
        assert np.array_equal(ours[others], wanted[others])


def test_a_compiled_loop_over_steps():
    """A Gaussian is a pytree: lax.scan carries it, and ends where the plain loop ends."""
    prior, z, model = problem()
    update = FILTERS["B-EKF 1"]

    @jax.jit
    def last(prior):
        return jax.lax.scan(lambda s, _: (update(s, z, model), None), prior, length=20)[0]

    wanted = prior
    for _ in range(20):
        wanted = update(wanted, z, model)
    assert_agree(last(jax.tree.map(jax.numpy.asarray, prior)), wanted, prior)


def test_derivatives_by_jax_are_the_models():
    """Jacobian and Hessian of h by automatic differentiation, one point in each quadrant."""
    models = [
        (problem()[2], np.array([[3.0, 4.0], [-3.0, 4.0], [-3.0, -4.0], [3.0, -4.0]])),
        (quadratic(np.random.default_rng(0), 2, 3), np.array([[0.3, -0.2, 0.5]])),
    ]
    for model, points in models:
        first = jax.jacfwd(model.h)
        H, second = jax.jit(jax.vmap(lambda x, f=first: (f(x), jax.jacfwd(f)(x))))(points)
        assert_allclose(H, model.jacobian(points), atol=1e-14)
        assert_allclose(second, model.hessian(points), atol=1e-14)


@pytest.mark.parametrize(
    "module", ["navfilters", "navfilters.models", "navfilters.papers.perea2007.experiment"]
)
def test_import_needs_numpy_only(module):
    """In a fresh interpreter: neither JAX nor what only the book or the oracle needs."""
    optional = {"jax", "matplotlib", "mpmath", "IPython"}
    code = f"import sys, {module}; print(*sorted({optional} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def exact_problem():
    """Three members of which one knows a state, one a combination, and one nothing."""
    v = np.array([2.0, -0.3, 0.7])
    cov = np.stack([np.diag([2.0, 0.0, 1.0]), np.outer(v, v), np.eye(3), np.zeros((3, 3))])
    model = quadratic(np.random.default_rng(1), 3, 3)
    return Gaussian(np.ones((4, 3)) * 0.3, 0.1 * cov), np.zeros(3), model


@pytest.mark.parametrize("name", ["UKF", "B-UKF", "UKFz"])
@pytest.mark.parametrize("root", ["cholesky", "symmetric"])
def test_what_is_known_exactly(name, root):
    """Compiled as on the host, update after update, and NaN only where a member is indefinite."""
    prior, z, model = exact_problem()
    update = compiled(name, model, **options_of(name, root))
    got = wanted = prior
    for _ in range(3):
        got, wanted = update(got, z), FILTERS[name](wanted, z, model, **options_of(name, root))
        assert_agree(got, wanted, prior)
    assert np.isfinite(got.mean).all()
    bad = prior.cov.copy()
    bad[2, 0, 0] = -1.0
    finite = np.isfinite(update(Gaussian(prior.mean, bad), z).mean).all(axis=-1)
    assert finite.tolist() == [True, True, False, True]
