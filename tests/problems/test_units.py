"""Which cures give another result in other units of the state: over random scales."""

import numpy as np
import pytest

from navfilters import FILTERS, Gaussian, run
from navfilters.estimators import AdaptiveNoise, AdaptiveRobust, Filter
from navfilters.models import Linear, RangeBearing
from navfilters.problems import CURES, UnfitError, in_units, problems, static_fix

FIX = static_fix(True, 6)
OF_NORMS = {"B-EKF 2", "B-EKF 3", "B-EKF 4", "REKF"}
TIED = {"converted", "polar"}  # to the coordinates in which range and bearing are written


def applied(cure, problem):
    try:
        return cure.apply(problem, cure.value)
    except UnfitError:
        return pytest.skip("it does not act on the fix")


def end(problem, estimator, unit):
    """The last estimate, in the old units."""
    draw = problem.drawn(5)
    last = run(estimator, draw.prior, draw.z, problem.model, z_per_step=True)
    return last.mean[-1] * unit, last.cov[-1] * np.outer(unit, unit)


@pytest.mark.parametrize("cure", [c for c in CURES if c.name not in TIED], ids=lambda c: c.name)
def test_norms_of_the_state_change_with_its_units_and_nothing_else_does(cure):
    believed, estimator = applied(cure, FIX)
    mean, cov = end(believed, estimator, np.ones(2))
    for seed in range(3):
        unit = 10.0 ** np.random.default_rng(seed).uniform(-2, 2, 2)
        scaled = in_units(believed, unit)
        other, P = end(scaled, applied(cure, scaled)[1], unit)
        changed = not np.allclose(other, mean, rtol=1e-6, atol=1e-6)
        assert changed == (cure.name in OF_NORMS)
        if not changed:
            np.testing.assert_allclose(P, cov, rtol=1e-4, atol=1e-9)


def test_one_unit_for_all_components_changes_nothing():
    for name in ("B-EKF 2", "B-EKF 3", "B-EKF 4"):
        mean, _ = end(FIX, FILTERS[name], np.ones(2))
        unit = np.full(2, 1000.0)
        np.testing.assert_allclose(end(in_units(FIX, unit), FILTERS[name], unit)[0], mean, 1e-8)


def test_the_matrix_of_the_adaptive_filter_has_units():
    """Q is turned by exp(A M A^T / 2), of velocities alone, which need one unit."""
    rule, rng = AdaptiveNoise(N=3, k=1), np.random.default_rng(0)
    memory = rule.init(Gaussian(np.zeros(6), np.eye(6)))
    full = memory._replace(innovations=rng.standard_normal((4, 2)), count=np.array(4))
    Q = np.diag([1.0, 1, 1, 4, 4, 4])
    here = rule.process_noise(full, Q)[0]
    for unit, changes in (([1e3, 1e3, 1e3, 1, 1, 1], False), ([1, 1, 1, 0.5, 1, 1], True)):
        outer = np.outer(unit, unit)
        there = rule.process_noise(full, Q / outer)[0] * outer
        assert np.allclose(there, here, rtol=1e-9) != changes


def test_the_gate_of_traces_changes_with_the_units_of_the_measurement():
    """lambda adds variances of a range and of an angle."""
    rng = np.random.default_rng(0)
    H, z = rng.standard_normal((2, 2)), 20 * rng.standard_normal((5, 2))
    prior, ends = Gaussian(np.zeros(2), np.eye(2)), []
    for scale in (np.ones(2), np.array([1000.0, 1.0])):
        model = Linear(H * scale[:, None], np.diag(scale**2))
        filter_ = Filter(rule=AdaptiveRobust())
        ends.append(run(filter_, prior, z * scale, model, z_per_step=True).mean[-1])
    assert not np.allclose(*ends, rtol=1e-6)


def test_a_manifold_has_no_units_to_change():
    with pytest.raises(ValueError, match="must have a vector for its state"):
        in_units(problems()["three images"], np.ones(9))


def test_units_are_positive():
    with pytest.raises(ValueError, match="unit must be positive; found 0"):
        in_units(FIX, [1.0, 0.0])


def test_a_rescaled_model_is_the_same_sensor():
    model = in_units(FIX, [10.0, 0.1]).model
    x, plain = np.array([3.0, 400.0]), RangeBearing(FIX.model.R)
    np.testing.assert_allclose(model.h(x), plain.h(x * [10.0, 0.1]))
    step = 1e-4 * np.eye(2)
    by_differences = np.stack([(model.h(x + d) - model.h(x - d)) / 2e-4 for d in step], axis=-1)
    np.testing.assert_allclose(model.jacobian(x), by_differences, rtol=1e-5, atol=1e-9)
