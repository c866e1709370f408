"""The ten filters: equations, options, the linear limit, and the promises about covariances."""

from dataclasses import replace
from functools import partial
from itertools import product
from operator import itemgetter

import naive
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from naive import covariances, each, quadratic
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import (
    FILTERS,
    Filter,
    Gaussian,
    Moments,
    SigmaPoints,
    kalman_update,
    linearized,
    run,
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

# Every option of every filter, at every value that the tests run.
ALPHAS = np.array([1e-3, 0.1, 0.5, 1.0, 2.0])
BETAS = np.array([0.0, 1.0, 2.0, 3.0])
KAPPAS = np.array([-0.5, 0.0, 1.0, 3.3, 10.0])
BUMPS = np.array([0.0, 0.5, 1.0, 3.0])
MESH = [axis.ravel() for axis in np.meshgrid(ALPHAS, BETAS, KAPPAS, indexing="ij")]
GRID = {
    "bump": {str(bump): bump for bump in BUMPS},
    "points": {
        f"{root}, {which}": SigmaPoints(*arrays, root)
        for root in ("cholesky", "symmetric")
        for which, arrays in {
            "every alpha, beta, kappa": [axis[:, None] for axis in MESH],
            "default kappa": [ALPHAS[:, None], 2.0, None],
        }.items()
    },
}


def settings_of(name):
    """Every combination of the grid's values for one filter, as (label, options)."""
    grids = [
        [(f"{key}={label}", (key, value)) for label, value in GRID[key].items()]
        for key in FILTERS[name].options
    ]
    return [
        ("; ".join(label for label, _ in combination), dict(pair for _, pair in combination))
        for combination in product(*grids)
    ]


CASES = [
    pytest.param(name, options, id=f"{name} {label}".strip())
    for name in FILTERS
    for label, options in settings_of(name)
]
every_setting = pytest.mark.parametrize(("name", "options"), CASES)
every_filter = pytest.mark.parametrize("name", FILTERS)

EKF_FAMILY = ["EKF", "B-EKF 1", "B-EKF 2", "B-EKF 3", "B-EKF 4"]
ekf_family = pytest.mark.parametrize("name", EKF_FAMILY)


def norm(A):
    return np.linalg.norm(A, 2)


def size(A):
    """What an absolute rounding error is small against."""
    return np.abs(A).max()


# --- options ------------------------------------------------------------------------------------


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


# --- the linear limit ---------------------------------------------------------------------------

# What the textbook's Kalman filter is given in place of (P, R).
LIMIT = {
    "EKF": lambda P, H, R: (P, R),
    "B-EKF 1": lambda P, H, R, bump: (P, R + bump * H @ P @ H.T),
    "B-EKF 2": lambda P, H, R: (P, R + norm(P) * H @ H.T),
    "B-EKF 3": lambda P, H, R: (P, norm(np.linalg.inv(H) @ R @ np.linalg.inv(H).T) * H @ H.T),
    "B-EKF 4": lambda P, H, R: (norm(P) * np.eye(len(P)), R),
    "mtSOF": lambda P, H, R: (P, R),
    "B-mtSOF": lambda P, H, R, bump: (P, R + bump * H @ P @ H.T),
    "UKF": lambda P, H, R: (P, R),
    "B-UKF": lambda P, H, R, bump: (P, R + bump * H @ P @ H.T),
    "UKFz": lambda P, H, R: (P, R),
}


def linear_problems(n, m, count=4):
    rng = np.random.default_rng(10 * n + m)
    H = rng.normal(size=(count, m, n)) + 2 * np.eye(m, n)
    prior = Gaussian(rng.normal(size=(count, n)), covariances(rng, (count,), n))
    return prior, 3 * rng.normal(size=(count, m)), Linear(H, covariances(rng, (count,), m))


def largest_weight(options, n):
    if "points" not in options:
        return 1.0
    return np.max([np.max(np.abs(w)) for w in options["points"].weights(n)[1:]])


@every_setting
@pytest.mark.parametrize("n", [1, 2, 3, 4])
@pytest.mark.parametrize("m", [1, 2, 3])
def test_on_a_linear_model_it_is_its_kalman_filter(name, options, n, m):
    """An independent Kalman filter with the stated P and R, and Filter.linear_limit, agree with it.

    The tolerance is 1e-15 max|W| for the sigma points' weights, plus 1e-12 for everything else.
    """
    if name == "B-EKF 3" and m != n:
        with pytest.raises(ValueError, match="B-EKF 3 inverts"):
            FILTERS[name](*linear_problems(n, m))
        return
    prior, z, model = linear_problems(n, m)
    bump = {key: value for key, value in options.items() if key == "bump"}
    got = FILTERS[name](prior, z, model, **options)
    stated = FILTERS[name].linear_limit(prior, z, model, **options)
    tolerance = 1e-12 + 1e-15 * largest_weight(options, n)
    for i, (x, P) in enumerate(zip(*prior, strict=True)):
        H, R = model.H[i], model.R[i]
        P_stated, R_stated = LIMIT[name](P, H, R, **bump)
        mean, cov = naive.kalman(x, P_stated, z[i], H, R_stated)
        scale = size(cov)
        assert_allclose(stated.cov[i], cov, rtol=0, atol=1e-11 * scale)
        assert_allclose(stated.mean[i], mean, rtol=0, atol=1e-11 * (1 + size(mean)))
        assert size(got.cov[..., i, :, :] - cov) < tolerance * size(P)
        assert size(got.mean[..., i, :] - mean) < tolerance * (size(x) + size(mean))


# --- equations ----------------------------------------------------------------------------------


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


def nonlinear(count=6, seed=0):
    """Priors in all directions, correlated noise, residuals of several deviations."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(-2.5, 2.5, count)
    x = rng.uniform(5, 50, (count, 1)) * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    model = RangeBearing(np.array([[0.5, 0.02], [0.02, 0.01]]))
    z = model.h(x) + rng.normal(size=(count, 2)) * [3.0, 0.1]
    return Gaussian(x, 4 * covariances(rng, (count,), 2)), z, model


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


# --- batches ------------------------------------------------------------------------------------


def scalar_settings(name, count):
    """One scalar setting per member, and the same as arrays over the batch."""
    rng = np.random.default_rng(5)
    drawn = {
        key: rng.uniform(low, high, count)
        for key, low, high in [("bump", 0, 3), ("alpha", 0.1, 2), ("beta", 0, 3), ("kappa", -1, 3)]
    }

    def options(pick):
        values = {key: pick(value) for key, value in drawn.items()}
        whole = {"bump": values.pop("bump"), "points": SigmaPoints(**values)}
        return {key: whole[key] for key in FILTERS[name].options}

    return options(lambda value: value), [options(itemgetter(i)) for i in range(count)]


@every_filter
def test_a_batch_is_its_members_alone(name):
    """Options given as arrays over the batch included."""
    prior, z, model = nonlinear()
    together, alone = scalar_settings(name, len(z))
    got = FILTERS[name](prior, z, model, **together)
    for i, options in enumerate(alone):
        wanted = FILTERS[name](Gaussian(prior.mean[i], prior.cov[i]), z[i], model, **options)
        assert_allclose(got.mean[i], wanted.mean, rtol=1e-13)
        assert_allclose(got.cov[i], wanted.cov, rtol=0, atol=1e-13 * size(prior.cov[i]))


@every_filter
def test_batch_axes_broadcast(name):
    """Priors (6,), measurements (4, 1), noises (3, 1, 1): twenty-four members three times."""
    prior, z, model = nonlinear()
    z = z[:4, None, :]
    noises = model.R * np.array([1.0, 2.0, 0.5])[:, None, None, None, None]
    got = FILTERS[name](prior, z, RangeBearing(noises))
    cov = np.broadcast_to(got.cov, (3, 4, 6, 2, 2))
    for r, j, i in np.ndindex(3, 4, 6):
        alone = Gaussian(prior.mean[i], prior.cov[i])
        wanted = FILTERS[name](alone, z[j, 0], RangeBearing(noises[r, 0, 0]))
        assert_allclose(got.mean[r, j, i], wanted.mean, rtol=1e-12)
        assert_allclose(cov[r, j, i], wanted.cov, rtol=0, atol=1e-13 * size(alone.cov))


def three_dimensional(count=6):
    rng = np.random.default_rng(8)
    model = quadratic(rng, 3, 3)
    prior = Gaussian(rng.normal(size=(count, 3)), covariances(rng, (count,), 3))
    return prior, rng.normal(size=(count, 3)), model


@every_filter
@pytest.mark.parametrize("root", ["cholesky", "symmetric"])
@pytest.mark.parametrize("problem", [nonlinear, three_dimensional])
def test_a_member_without_covariance_stays_alone(name, root, problem):
    """The others do not notice, to the last bit; the member itself is NaN in every entry."""
    prior, z, model = problem()
    options = {"points": SigmaPoints(root=root)} if "points" in FILTERS[name].options else {}
    healthy = FILTERS[name](prior, z, model, **options)
    bad = prior.cov.copy()
    bad[2] = np.nan
    with np.errstate(all="ignore"):
        got = FILTERS[name](Gaussian(prior.mean, bad), z, model, **options)
    for ours, wanted in zip(got, healthy, strict=True):
        others = [0, 1, 3, 4, 5]
        assert_array_equal(ours[others], wanted[others])
        assert np.isnan(ours[2]).all()
        assert np.isfinite(wanted).all()


@every_filter
def test_a_member_at_the_origin_stays_alone(name):
    """Range and bearing have no derivatives there: what needs them is NaN, the unscented go on."""
    prior, z, model = nonlinear()
    mean = prior.mean.copy()
    mean[2] = 0.0
    healthy = FILTERS[name](prior, z, model)
    with np.errstate(all="ignore"):
        got = FILTERS[name](Gaussian(mean, prior.cov), z, model)
    for ours, wanted in zip(got, healthy, strict=True):
        others = [0, 1, 3, 4, 5]
        assert_array_equal(ours[others], wanted[others])
        assert np.isfinite(ours[2]).all() == ("UKF" in name)


@pytest.mark.parametrize("name", ["UKF", "B-UKF", "UKFz"])
@pytest.mark.parametrize("root", ["cholesky", "symmetric"])
def test_an_indefinite_prior_stops_the_unscented_alone(name, root):
    prior, z, model = nonlinear()
    bad = prior.cov.copy()
    bad[2] = np.diag([1.0, -1.0])
    options = {"points": SigmaPoints(root=root)}
    healthy = FILTERS[name](prior, z, model, **options)
    got = FILTERS[name](Gaussian(prior.mean, bad), z, model, **options)
    for ours, wanted in zip(got, healthy, strict=True):
        assert_array_equal(ours[[0, 1, 3, 4, 5]], wanted[[0, 1, 3, 4, 5]])
        assert np.isnan(ours[2]).all()


@pytest.mark.parametrize("name", [name for name in FILTERS if "UKF" not in name])
def test_an_indefinite_prior_does_not_stop_the_others(name):
    """As the paper's filters went on: the update needs no root of P."""
    prior, z, model = nonlinear()
    indefinite = Gaussian(prior.mean, np.broadcast_to(np.diag([1.0, -1e-3]), prior.cov.shape))
    got = FILTERS[name](indefinite, z, model)
    assert np.isfinite(got.mean).all()
    assert np.isfinite(got.cov).all()


# --- covariances, for any range-bearing problem -------------------------------------------------


@st.composite
def range_bearing_problems(draw):
    """Any place, prior deviations of 0.1 to 100 % of the range, noise from 1 % of those, any z."""
    angle = st.floats(-np.pi, np.pi)
    r, a = draw(st.floats(1.0, 1e3)), draw(angle)
    x = r * np.array([np.cos(a), np.sin(a)])
    deviations = r * np.array([draw(st.floats(1e-3, 1.0)) for _ in range(2)])
    turn = draw(angle)
    V = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    P = (V * deviations**2) @ V.T
    least = deviations.min()
    range_deviation = least * draw(st.floats(1e-2, 10.0))
    bearing_deviation = least / r * draw(st.floats(1e-2, 10.0))
    off = draw(st.floats(-0.9, 0.9)) * range_deviation * bearing_deviation
    R = np.array([[range_deviation**2, off], [off, bearing_deviation**2]])
    z = np.array([r * draw(st.floats(0.1, 3.0)), draw(angle)])
    return Gaussian(x, (P + P.T) / 2), z, RangeBearing(R)


@every_filter
@given(range_bearing_problems())
def test_the_covariance_stays_symmetric_exactly(name, problem):
    _, P = FILTERS[name](*problem)
    assert_array_equal(P, P.T)


@ekf_family
@given(range_bearing_problems())
def test_an_update_never_adds_uncertainty(name, problem):
    """P+ <= P in the Loewner order; for B-EKF 4, which forgets P first, P+ <= |P| I."""
    prior = problem[0]
    before = norm(prior.cov) * np.eye(2) if name == "B-EKF 4" else prior.cov
    after = FILTERS[name](*problem).cov
    assert np.linalg.eigvalsh(before - after).min() >= -1e-13 * norm(before)


@ekf_family
@given(range_bearing_problems())
def test_the_ekf_family_keeps_its_covariance_positive_definite(name, problem):
    after = FILTERS[name](*problem).cov
    assert np.linalg.eigvalsh(after).min() > 0


@pytest.mark.parametrize("name", ["B-EKF 1", "B-EKF 2", "B-mtSOF", "B-UKF"])
@given(range_bearing_problems())
def test_a_bump_leaves_more_uncertainty(name, problem):
    """R_new >= R, so that P+ of the bumped filter is not below that of the bare one."""
    bare = {"B-EKF 1": "EKF", "B-EKF 2": "EKF", "B-mtSOF": "mtSOF", "B-UKF": "UKF"}[name]
    prior, _, model = problem
    P_zz = FILTERS[bare].moments(prior, model).P_zz
    if np.linalg.eigvalsh(P_zz).min() > 1e-6 * norm(P_zz):
        more = FILTERS[name](*problem).cov - FILTERS[bare](*problem).cov
        assert np.linalg.eigvalsh(more).min() >= -1e-9 * norm(prior.cov)


@pytest.mark.parametrize("name", ["B-EKF 1", "B-mtSOF", "B-UKF"])
@pytest.mark.parametrize("bump", [-0.5, np.nan, np.array([1.0, -1.0])])
def test_a_negative_bump_is_refused(name, bump):
    prior = Gaussian(np.array([20.0, 80.0]), 100.0 * np.eye(2))
    model = RangeBearing(np.diag([1.0, 0.01]))
    with pytest.raises(ValueError, match=r"bump must be at least 0; found (-|nan)"):
        FILTERS[name](prior, np.array([80.0, 1.0]), model, bump=bump)


# --- what is known exactly ----------------------------------------------------------------------

UNSCENTED = ["UKF", "B-UKF", "UKFz"]


def exact_priors():
    """Covariances without full rank: zero rows, known combinations, nothing unknown at all."""
    rng = np.random.default_rng(5)
    v = np.array([3.0, -0.7, 1.1])
    B = rng.normal(size=(3, 2))
    units = np.array([1.0, 1e2, 1e-3])
    return {
        "one state": np.diag([2.0, 0.0, 1.0]),
        "the first state": np.array([[0.0, 0.0, 0.0], [0.0, 2.0, 0.3], [0.0, 0.3, 1.0]]),
        "all states": np.zeros((3, 3)),
        "a sum": np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 4.0]]),
        "all but a direction": np.outer(v, v),
        "all but a plane": B @ B.T,
        "all but a direction, vague": 1e6 * np.outer(v, v),
        "all but a plane, in other units": np.outer(units, units) * (B @ B.T),
    }


def sensor_of_three():
    H = np.array([[1.0, 0.5, -0.2], [0.3, 1.0, 0.8]])
    return Linear(H, [[0.2, 0.05], [0.05, 0.1]])


@pytest.mark.parametrize("name", UNSCENTED)
@pytest.mark.parametrize("root", ["cholesky", "symmetric"])
@pytest.mark.parametrize("case", exact_priors())
def test_on_a_line_what_is_exact_costs_nothing(name, root, case):
    """The unscented filters are the Kalman filter in the coordinates of what is not known."""
    P = exact_priors()[case]
    model, z, x = sensor_of_three(), np.array([4.0, -1.0]), np.array([3.0, -1.0, 2.0])
    got = run(partial(FILTERS[name], points=SigmaPoints(root=root)), Gaussian(x, P), z, model, 5)
    d = unit(P)
    w, V = np.linalg.eigh(P / np.outer(d, d))
    B = d[:, None] * V[:, w > 1e-12] * np.sqrt(w[w > 1e-12])
    weight = np.linalg.inv(model.R)
    information, pulled = np.eye(B.shape[1]), np.zeros(B.shape[1])
    for _ in range(5):
        G = model.H @ B
        noise = model.R
        if name == "B-UKF":
            noise = noise + G @ np.linalg.inv(information) @ G.T
        weight = np.linalg.inv(noise)
        information = information + G.T @ weight @ G
        pulled = pulled + G.T @ weight @ (z - model.H @ x)
    wanted = x + B @ np.linalg.solve(information, pulled)
    cov = B @ np.linalg.inv(information) @ B.T
    size = np.sqrt(np.diagonal(P))
    tolerance = 1e-9 if "vague" in case or "units" in case else 1e-12
    assert (np.abs(got.mean[-1] - wanted) <= tolerance * size + 1e-14).all()
    assert (np.abs(got.cov[-1] - cov) <= tolerance * np.outer(size, size)).all()
    ekf = run(FILTERS["EKF"], Gaussian(x, P), z, model, 5)
    if name != "B-UKF":
        assert (np.abs(got.mean[-1] - ekf.mean[-1]) <= 1e-5 * size + 1e-12).all()


def unit(P):
    deviation = np.sqrt(np.diagonal(P))
    return np.where(deviation > 0, deviation, 1.0)


@pytest.mark.parametrize("name", UNSCENTED)
@pytest.mark.parametrize("root", ["cholesky", "symmetric"])
def test_members_that_know_something_do_not_disturb_the_others(name, root):
    prior, z = Gaussian(np.ones((8, 3)), np.stack([*exact_priors().values()])), np.ones(2)
    definite = np.eye(3) + np.arange(8)[:, None, None]
    mixed = np.where((np.arange(8) % 2 == 0)[:, None, None], definite, prior.cov)
    update = partial(FILTERS[name], points=SigmaPoints(root=root))
    got = run(update, Gaussian(prior.mean, mixed), z, sensor_of_three(), 4)
    plain = run(update, Gaussian(prior.mean, definite), z, sensor_of_three(), 4)
    exact = run(update, prior, z, sensor_of_three(), 4)
    assert_array_equal(got.mean[:, ::2], plain.mean[:, ::2])
    assert_array_equal(got.cov[:, ::2], plain.cov[:, ::2])
    assert_allclose(got.mean[:, 1::2], exact.mean[:, 1::2], rtol=1e-12)


@pytest.mark.parametrize("name", UNSCENTED)
@pytest.mark.parametrize("angle", [0.0, 0.3, 1.0, np.pi / 2, 2.0])
def test_along_a_line_the_filter_stays_on_it(name, angle):
    """A vague prior along a line, a sharp sensor and three hundred curved updates."""
    model = RangeBearing(np.diag([2.5e-5, 6e-3]))
    v = np.array([np.cos(angle), np.sin(angle)])
    across = np.array([-v[1], v[0]])
    start = np.array([120.0, 80.0])
    prior = Gaussian(start, 1e4 * np.outer(v, v))
    got = run(FILTERS[name], prior, model.h(start + 10 * v), model, 300)
    assert np.isfinite(got.mean).all()
    assert_allclose((got.mean - start) @ across, 0.0, atol=1e-9)
    variance = np.einsum("i,kij,j->k", across, got.cov, across)
    along = np.einsum("i,kij,j->k", v, got.cov, v)
    assert (np.abs(variance) <= 1e-13 * along).all()
    assert (along > 0).all()


@pytest.mark.parametrize("name", UNSCENTED)
def test_an_exact_state_is_the_limit_of_a_nearly_exact_one(name):
    """On a curved model, with the state that is known first and last."""
    model = RangeBearing(np.diag([0.5, 0.01]))
    z = model.h(np.array([30.0, 40.0]))
    for i in (0, 1):
        P = np.diag([20.0, 20.0])
        P[i, i] = 0
        exact = FILTERS[name](Gaussian(np.array([32.0, 37.0]), P), z, model)
        P[i, i] = 1e-9
        nearly = FILTERS[name](Gaussian(np.array([32.0, 37.0]), P), z, model)
        assert_allclose(exact.mean, nearly.mean, rtol=1e-9)
        assert_allclose(exact.cov, nearly.cov, atol=1e-8)


@pytest.mark.parametrize("name", UNSCENTED)
def test_what_is_indefinite_is_still_nan(name):
    prior = Gaussian(np.ones((2, 3)), np.stack([np.eye(3), np.diag([1.0, -1e-6, 1.0])]))
    with np.errstate(all="ignore"):
        got = FILTERS[name](prior, np.ones(2), sensor_of_three())
    assert np.isfinite(got.mean[0]).all()
    assert np.isnan(got.mean[1]).all()
