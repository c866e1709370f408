"""Every filter against the sixty-digit computation: at the paper's baseline and away from it."""

import ast
import inspect
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from untraced import untraced

from navfilters import SigmaPoints, first_indefinite, run
from navfilters.models import RangeBearing
from navfilters.oracles import perea2007 as oracle
from navfilters.oracles import two_by_two
from navfilters.oracles.two_by_two import is_positive_definite
from navfilters.papers.perea2007 import FILTERS, Setup, isotropic, position_error

STEPS = [1, 2, 10, 100, 1000]
SETUPS = {
    "baseline": Setup(),
    # Second quadrant, 0.2 units of range noise and 4.3 across, the first estimate 86 away.
    "second quadrant": Setup((-40.0, 130.0), (-90.0, 60.0), 60.0, 0.04, 1e-3),
    # Fourth quadrant, 10 units of range noise and 16 across: neither dominates.
    "comparable noises": Setup((150.0, -60.0), (120.0, -20.0), 30.0, 100.0, 0.01),
}
POINTS = {
    "cholesky": {"alpha": 1.0, "beta": 2.0, "kappa": 1.0, "root": "cholesky"},
    "symmetric": {"alpha": 0.8, "beta": 2.0, "kappa": 3.3, "root": "symmetric"},
}
every_setup = pytest.mark.parametrize("setup", SETUPS.values(), ids=SETUPS)
every_form = pytest.mark.parametrize("form", ["short", "joseph"])


@cache  # both forms of a filter are the same one
@untraced()
def exact(name, setup, keep=tuple(STEPS), **options):
    """The oracle's entries from the same floats, but for z, which it computes from x_true."""
    R = (setup.range_variance, setup.bearing_variance)
    return oracle.history(
        name, x_true=setup.x_true, x0=setup.x0, sigma=setup.sigma, R=R, keep=keep, **options
    )


def errors(entries, setup):
    return np.array([float(oracle.position_error(entry, setup.x_true)) for entry in entries])


def assert_agrees(got, entries, setup, steps=STEPS):
    """States within 1e-6 of the position error, covariances within 1e-6 of their size."""
    error = errors(entries, setup)
    assert np.all(np.abs(position_error(got.mean[steps], setup.x_true) / error - 1) < 1e-6)
    for k, (_, x, (p11, p12, p22)), e in zip(steps, entries, error, strict=True):
        P = np.array([[p11, p12], [p12, p22]], float)
        assert np.abs(got.mean[k] - np.array(x, float)).max() < 1e-6 * e
        assert np.abs(got.cov[k] - P).max() < 1e-6 * np.abs(P).max()


@every_setup
@every_form
@pytest.mark.parametrize("name", ["EKF", "B-EKF 1", "B-EKF 2", "B-EKF 3", "B-EKF 4"])
@untraced()
def test_ekf_family(name, form, setup):
    got = run(replace(FILTERS[name], form=form), setup.prior, setup.z, setup.model)
    assert_agrees(got, exact(name, setup), setup)


@pytest.mark.parametrize("bump", [0.0, 0.5, 3.0])
def test_the_bump_of_eq_14(bump):
    setup = SETUPS["second quadrant"]
    got = run(FILTERS["B-EKF 1"].having(bump=bump), setup.prior, setup.z, setup.model)
    assert_agrees(got, exact("B-EKF 1", setup, bump=bump), setup)


@every_setup
@pytest.mark.parametrize("points", POINTS.values(), ids=POINTS)
@pytest.mark.parametrize("name", ["UKF", "B-UKF", "UKFz"])
@untraced()
def test_ukf_family(name, setup, points):
    estimator = FILTERS[name].having(points=SigmaPoints(**points))
    got = run(estimator, setup.prior, setup.z, setup.model)
    assert_agrees(got, exact(name, setup, **points), setup)


@pytest.mark.parametrize("alpha", [0.05, 1.5])
@pytest.mark.parametrize("root", ["cholesky", "symmetric"])
def test_narrow_and_wide_sigma_points(alpha, root):
    setup = SETUPS["second quadrant"]
    points = {"alpha": alpha, "beta": 0.0, "kappa": 0.5, "root": root}
    got = run(
        FILTERS["UKF"].having(points=SigmaPoints(**points)), setup.prior, setup.z, setup.model
    )
    assert_agrees(got, exact("UKF", setup, **points), setup)


# --- the second-order filters, whose P loses its definiteness -----------------------------------


def last_bits(rng, value, members=64, ulps=4):
    """Copies of value with every entry off by up to four units in the last place."""
    value = np.asarray(value, float)
    return value + rng.integers(-ulps, ulps + 1, (members, *value.shape)) * np.spacing(value)


def ensemble(name, setup):
    """Runs of 64 members that differ in the last bits of x0, P0, z and R.

    Every input is perturbed, not x0 alone: by the time B-mtSOF loses its definiteness it has
    forgotten x0, and 64 first estimates end in two or three different runs.
    """
    rng = np.random.default_rng(0)
    prior = isotropic(last_bits(rng, setup.x0), last_bits(rng, setup.sigma))
    variances = last_bits(rng, [setup.range_variance, setup.bearing_variance])
    model = RangeBearing(variances[:, :, None] * np.eye(2), wrap=False)
    return run(FILTERS[name], prior, last_bits(rng, setup.z), model)


@every_setup
@pytest.mark.parametrize("name", ["mtSOF", "B-mtSOF"])
@untraced()
def test_second_order_filters(name, setup):
    """To 1e-6 while P is definite; after that, inside what the last bits of the inputs allow.

    Rounding acts like a perturbation of the inputs' last bits, so that the exact value must lie
    within the ensemble, widened on each side by the ensemble's own width (64 draws do not reach
    the ends of their distribution). The width itself may not exceed a tenth of the value.
    """
    entries = exact(name, setup, keep=range(1001))
    definite = [is_positive_definite(p) for _, _, p in entries]
    lost = definite.index(False) if False in definite else 1001
    got = run(FILTERS[name], setup.prior, setup.z, setup.model)
    assert first_indefinite(got.cov) == (lost if lost <= 1000 else -1)

    before = [k for k in [*STEPS, lost - 1] if 0 < k < lost]
    assert_agrees(got, [entries[k] for k in before], setup, before)

    after = [k for k in [lost, *STEPS] if lost <= k <= 1000]
    members = ensemble(name, setup)
    assert_array_equal(first_indefinite(members.cov), first_indefinite(got.cov))
    error = errors([entries[k] for k in after], setup)
    runs = position_error(members.mean[after], setup.x_true)
    ours = position_error(got.mean[after], setup.x_true)
    low, high = runs.min(axis=1), runs.max(axis=1)
    width = high - low
    for value in (error, ours):
        assert np.all((low - width <= value) & (value <= high + width))
    assert np.all(width < 0.1 * error)


@every_form
@untraced()
def test_where_the_setups_lose_definiteness(form):
    """The claim of sections V and VI, and that the other two set-ups test the other cases."""
    filters = {name: replace(FILTERS[name], form=form) for name in ("mtSOF", "B-mtSOF")}
    first = {
        (name, label): first_indefinite(run(estimator, s.prior, s.z, s.model).cov)
        for name, estimator in filters.items()
        for label, s in SETUPS.items()
    }
    assert list(first.values()) == [1, 1, -1, 23, -1, -1]


# --- the oracle itself --------------------------------------------------------------------------


def test_the_oracle_is_independent():
    """It imports mpmath and nothing else: not one line of the package."""
    names = set()
    for module, wanted in (
        (oracle, ["mpmath", "navfilters.oracles.two_by_two"]),
        (two_by_two, ["mpmath"]),
    ):
        tree = ast.parse(inspect.getsource(module))
        imports = [node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)]
        assert sorted(node.module for node in imports) == wanted
        assert all(node.level == 0 for node in imports)
        names |= {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    assert not names & {"__import__", "importlib", "navfilters", "np", "numpy", "eval", "exec"}


@pytest.mark.parametrize("name", ["B-mtSOF", "UKFz"])
def test_sixty_digits_are_enough(name):
    """Ninety digits give the same twenty, also where float64 has none left."""
    setup = SETUPS["baseline"]
    sixty, ninety = (exact(name, setup, keep=(1000,), digits=digits) for digits in (60, 90))
    a, b = (oracle.position_error(entries[0], digits=90) for entries in (sixty, ninety))
    assert abs(a / b - 1) < 1e-20


@pytest.mark.parametrize("root", ["cholesky", "symmetric"])
def test_the_oracles_ukf_raises_where_ours_is_nan(root):
    """A negative central weight takes more from P than there is."""
    setup = Setup(steps=30)
    points = {"alpha": 1.0, "beta": -3.0, "kappa": 1.0, "root": root}
    estimator = FILTERS["UKF"].having(points=SigmaPoints(**points))
    got = run(estimator, setup.prior, setup.z, setup.model, steps=setup.steps)
    step = int(first_indefinite(got.cov))
    assert 0 < step < setup.steps
    assert np.isfinite(got.mean[: step + 1]).all()
    assert np.isnan(got.mean[step + 1 :]).all()
    with pytest.raises(ValueError, match=f"UKF: P is not positive definite after update {step}$"):
        exact("UKF", setup, **points)


def test_the_oracle_knows_the_same_ten_filters():
    assert set(oracle.NAMES) == set(FILTERS)
    with pytest.raises(ValueError, match="unknown filter 'KF'"):
        oracle.history("KF")
    with pytest.raises(ValueError, match="root is 'cholesky' or 'symmetric', not 'qr'"):
        oracle.history("UKF", root="qr", steps=1)
