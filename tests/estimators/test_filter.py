"""The ten filters: equations and options."""

from dataclasses import replace
from itertools import product

import naive
import numpy as np
import pytest
from naive import covariances, each, quadratic
from numpy.testing import assert_allclose, assert_array_equal
from ten_filters import BUMPS, GRID, every_filter, nonlinear, norm, size

from navfilters import (
    FILTERS,
    Filter,
    Gaussian,
    Moments,
    SigmaPoints,
    kalman_update,
    linearized,
)
from navfilters.estimators.options import keywords
from navfilters.estimators.variants import (
    bump_circular,
    bump_equivalent,
    bump_linear,
    bump_predicted,
    bump_state,
    expect_at_mean,
    unchanged,
)
from navfilters.models import Linear, RangeBearing


def test_the_grid_covers_every_option():
    """A new option, or a filter with one, cannot escape the linear limit."""
    assert {option for f in FILTERS.values() for option in f.options} == set(GRID)


@every_filter
def test_options_are_those_of_the_paper(name):
    bump = ["bump"] if name in {"B-EKF 1", "B-mtSOF", "B-UKF"} else []
    points = ["points"] if name in {"UKF", "B-UKF", "UKFz"} else []
    assert sorted(FILTERS[name].options) == bump + points


@every_filter
def test_an_unknown_option_is_refused(name):
    model = RangeBearing(np.eye(2))
    prior = Gaussian(np.array([3.0, 4.0]), np.eye(2))
    with pytest.raises(TypeError, match=r"\['bumps'\]; this filter has"):
        FILTERS[name](prior, np.zeros(2), model, bumps=1.0)
    if not FILTERS[name].options:
        with pytest.raises(TypeError, match=r"\['bump'\]; this filter has none"):
            FILTERS[name](prior, np.zeros(2), model, bump=1.0)


@pytest.mark.parametrize(("m", "n"), [(1, 2), (2, 3), (3, 2)])
def test_b_ekf_3_needs_an_invertible_measurement(m, n):
    prior = Gaussian(np.zeros(n), np.eye(n))
    model = Linear(np.ones((m, n)), np.eye(m))
    found = f"as many components as the state has; found {m} measurements of {n} states"
    with pytest.raises(ValueError, match=found):
        FILTERS["B-EKF 3"](prior, np.zeros(m), model)


def test_the_update_is_the_plain_loop():
    """Eqs. (5)-(7), for moments that belong to no model."""
    rng = np.random.default_rng(0)
    for n, m in product([1, 2, 3, 4], [1, 2, 3, 4]):
        prior = Gaussian(rng.normal(size=n), 10 * covariances(rng, (), n))
        moments = Moments(rng.normal(size=m), covariances(rng, (), m), rng.normal(size=(n, m)))
        z = rng.normal(size=m)
        got, wanted = kalman_update(prior, z, moments), naive.update(*prior, z, *moments[:3])
        assert_allclose(got.mean, wanted[0], rtol=1e-11, atol=1e-11)
        assert_allclose(got.cov, wanted[1], rtol=1e-11, atol=1e-11)


def test_both_forms_are_one_covariance():
    """To rounding, scaled by the condition of P_zz; the mean, bit for bit."""
    rng = np.random.default_rng(3)
    for n, m, vague in product([1, 2, 3, 5], [1, 2, 3, 5], [1.0, 1e6]):
        prior = Gaussian(rng.normal(size=(4, n)), vague * covariances(rng, (4,), n))
        model = Linear(rng.normal(size=(m, n)), covariances(rng, (), m))
        z, moments = rng.normal(size=m), linearized(prior, model)
        joseph, short = (
            kalman_update(prior, z, moments, form=form) for form in ("joseph", "short")
        )
        assert_array_equal(joseph.mean, short.mean)
        bound = 1e-14 * np.linalg.cond(moments.P_zz) * size(prior.cov)
        assert (np.abs(joseph.cov - short.cov).max(axis=(-2, -1)) < bound).all()
        assert_array_equal(joseph.cov, joseph.cov.mT)


def test_without_an_h_both_forms_are_the_same_line():
    prior, z, model = nonlinear()
    for name in ("UKF", "B-UKF", "UKFz"):
        short = replace(FILTERS[name], form="short")
        for ours, theirs in zip(
            FILTERS[name](prior, z, model), short(prior, z, model), strict=True
        ):
            assert_array_equal(ours, theirs)


def test_an_unknown_form_is_refused():
    message = r"form must be one of \['joseph', 'short', 'sqrt'\]; found 'UD'"
    with pytest.raises(ValueError, match=message):
        Filter(form="UD")


def noise_bumped(model, x, P, moments, bump=1.0):
    H = model.jacobian(x)
    return moments[0], moments[1] + bump * H @ P @ H.T, moments[2]


def noise_circular(model, x, P, moments):
    H = model.jacobian(x)
    return moments[0], moments[1] + norm(P) * H @ H.T, moments[2]


def noise_equivalent(model, x, P, moments):
    H = model.jacobian(x)
    J = np.linalg.inv(H)
    return moments[0], moments[1] - model.R + norm(J @ model.R @ J.T) * H @ H.T, moments[2]


def noise_predicted(model, x, P, moments, bump=1.0):
    return moments[0], model.R + (1 + bump) * (moments[1] - model.R), moments[2]


def expected_at_mean(model, x, P, moments):
    return model.h(x), *moments[1:]


VARIANTS = {
    "unchanged": (unchanged, lambda model, x, P, moments: moments),
    "bump_linear, Eq. (14)": (bump_linear, noise_bumped),
    "bump_circular, Eq. (15)": (bump_circular, noise_circular),
    "bump_equivalent, Eq. (16)": (bump_equivalent, noise_equivalent),
    "bump_predicted, VI.A.1": (bump_predicted, noise_predicted),
    "expect_at_mean, VI.A.2": (expect_at_mean, expected_at_mean),
}


@pytest.mark.parametrize(("variant", "plain"), VARIANTS.values(), ids=VARIANTS)
def test_a_variant_is_its_printed_equation(variant, plain):
    """Given any moments with P_xz = P H^T it changes what the equation names, and only that."""
    prior, _, model = nonlinear()
    z_hat, P_zz, P_xz = each(naive.second_order, *prior, model)
    for bump in [{}] if "bump" not in keywords(variant) else [{}, *bumps()]:
        with_H = Moments(z_hat, P_zz, P_xz, model.jacobian(prior.mean), model.R)
        _, joseph = variant(prior, model, with_H, **bump)
        same, got = variant(prior, model, Moments(z_hat, P_zz, P_xz), **bump)
        assert got.H is got.R is None
        assert_allclose(joseph.P_zz - joseph.R, P_zz - model.R, rtol=1e-11, atol=1e-12)
        assert_array_equal(joseph.P_zz, got.P_zz)
        assert same is prior
        for i, (x, P) in enumerate(zip(*prior, strict=True)):
            wanted = plain(model, x, P, (z_hat[i], P_zz[i], P_xz[i]), **bump)
            for ours, theirs in zip(got[:3], wanted, strict=True):
                assert_allclose(ours[i], theirs, rtol=1e-11, atol=1e-12)


def bumps():
    return [{"bump": bump} for bump in BUMPS]


def test_bump_state_is_eq_17():
    """P_new = |P| I, with the moments that belong to it; only z_hat survives."""
    prior, _, model = nonlinear()
    z_hat, P_zz, P_xz = each(naive.second_order, *prior, model)
    changed, got = bump_state(prior, model, Moments(z_hat, P_zz, P_xz))
    assert_array_equal(changed.mean, prior.mean)
    for i, (x, P) in enumerate(zip(*prior, strict=True)):
        H, P_new = model.jacobian(x), norm(P) * np.eye(2)
        assert_allclose(changed.cov[i], P_new, rtol=1e-13)
        assert_array_equal(got.z_hat[i], z_hat[i])
        assert_allclose(got.P_zz[i], model.R + H @ P_new @ H.T, rtol=1e-12)
        assert_allclose(got.P_xz[i], P_new @ H.T, rtol=1e-12)


def plain_filter(name, x, P, z, model, *, bump=1.0, root="cholesky"):
    """One update by one filter, from the paper's text."""
    if name == "B-EKF 4":
        P = norm(P) * np.eye(len(x))
    if "SOF" in name:
        moments = naive.second_order(x, P, model)
    elif "UKF" in name:
        moments = naive.unscented(x, P, model, root=root)
    else:
        moments = naive.linearized(x, P, model)
    if name in {"B-EKF 1", "B-mtSOF"}:
        moments = noise_bumped(model, x, P, moments, bump)
    elif name == "B-EKF 2":
        moments = noise_circular(model, x, P, moments)
    elif name == "B-EKF 3":
        moments = noise_equivalent(model, x, P, moments)
    elif name == "B-UKF":
        moments = noise_predicted(model, x, P, moments, bump)
    elif name == "UKFz":
        moments = expected_at_mean(model, x, P, moments)
    elif name not in {"EKF", "B-EKF 4", "mtSOF", "UKF"}:
        raise NotImplementedError(name)
    return naive.update(x, P, z, *moments)


@every_filter
@pytest.mark.parametrize("bump", BUMPS)
@pytest.mark.parametrize("root", ["cholesky", "symmetric"])
def test_a_filter_is_its_equations(name, bump, root):
    prior, z, model = nonlinear()
    given_options = {"bump": bump, "points": SigmaPoints(root=root)}
    options = {key: given_options[key] for key in FILTERS[name].options}
    got = FILTERS[name](prior, z, model, **options)
    for i, (x, P) in enumerate(zip(*prior, strict=True)):
        mean, cov = plain_filter(name, x, P, z[i], model, bump=bump, root=root)
        assert_allclose(got.mean[i], mean, rtol=1e-12, atol=1e-12)
        assert_allclose(got.cov[i], cov, rtol=0, atol=1e-13 * size(P) * 10)


SIZES = [(name, n, m) for name in FILTERS for n in (1, 3) for m in (1, 3)]


@pytest.mark.parametrize(
    ("name", "n", "m"), [(name, n, m) for name, n, m in SIZES if name != "B-EKF 3" or n == m]
)
def test_a_filter_is_its_equations_for_any_size(name, n, m):
    """A curved model with as many components and states as one likes."""
    rng = np.random.default_rng(n + m)
    model = quadratic(rng, m, n)
    prior = Gaussian(rng.normal(size=(5, n)), 0.01 * covariances(rng, (5,), n))
    z = model.h(prior.mean) + 0.1 * rng.normal(size=(5, m))
    got = FILTERS[name](prior, z, model)
    for i, (x, P) in enumerate(zip(*prior, strict=True)):
        mean, cov = plain_filter(name, x, P, z[i], model)
        assert_allclose(got.mean[i], mean, rtol=1e-11, atol=1e-11)
        assert_allclose(got.cov[i], cov, rtol=0, atol=1e-11 * size(P))


@pytest.mark.parametrize(
    ("bumped", "bare"), [("B-EKF 1", "EKF"), ("B-mtSOF", "mtSOF"), ("B-UKF", "UKF")]
)
def test_no_bump_is_the_bare_filter(bumped, bare):
    got, wanted = (
        FILTERS[name](*nonlinear(), **options)
        for name, options in [(bumped, {"bump": 0.0}), (bare, {})]
    )
    assert_array_equal(got.mean, wanted.mean)
    assert_array_equal(got.cov, wanted.cov)
