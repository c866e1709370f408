"""What became of a filter on a problem that is known by heart."""

from dataclasses import replace

import numpy as np
import pytest

from navfilters import FILTERS, Gaussian
from navfilters.estimators import AdaptiveRobust, Filter
from navfilters.models import Linear
from navfilters.problems import Draw, Noisier, Outcome, Problem, evaluations, problems, treat
from navfilters.problems.problem import streams

H, R = np.array([[1.0, 0.5], [0.0, 1.0]]), np.diag([1.0, 4.0])
STEPS = 10


def drawn(runs, seed):
    rngs = streams(runs, seed)
    first = np.stack([rng.standard_normal(2) for rng in rngs])
    noise = np.stack([rng.standard_normal((STEPS, 2)) for rng in rngs], axis=1)
    return Draw(
        Gaussian(-3 * first, 9 * np.eye(2)),
        np.zeros((STEPS + 1, 1, 2)),
        np.sqrt(np.diag(R)) * noise,
    )


LINEAR = Problem("linear", drawn, Linear(H, R), STEPS, (0, 1), "m", STEPS)


def told(factor):
    return replace(LINEAR, model=Linear(H, factor * R))


def test_the_band_of_honesty_has_both_its_ends():
    nees = np.array([1.9, 2.0, 2.5, 3.0, 3.1, np.inf])
    none = np.zeros(6)
    found = Outcome(none, none, 1.0, none, nees, 2, (2.0, 3.0), none, none)
    assert found.honest.tolist() == [-1, 0, 0, 0, 1, 1]


def test_the_kalman_filter_is_honest_and_as_good_as_the_reference():
    found = treat(LINEAR, FILTERS["EKF"], 400)
    assert found.honest == 0
    assert float(found.ratio) == pytest.approx(1, abs=0.1)
    assert float(found.nis) == pytest.approx(1, abs=0.05)
    assert float(found.covered) == pytest.approx(0.95, abs=0.03)
    assert found.lost == 0
    P = np.linalg.inv(np.eye(2) / 9 + STEPS * H.T @ np.linalg.inv(R) @ H)
    assert found.reference == pytest.approx(np.sqrt(np.trace(P)), rel=1e-12)


@pytest.mark.parametrize(("factor", "verdict"), [(0.25, 1), (4.0, -1)])
def test_a_filter_that_is_told_another_noise_is_not_honest(factor, verdict):
    found = treat(LINEAR, FILTERS["EKF"], 400, believed=told(factor))
    assert found.honest == verdict
    assert found.reference == treat(LINEAR, FILTERS["EKF"], 400).reference


def test_settings_are_what_each_of_them_is_alone():
    bumps = np.array([0.5, 2.0])
    both = treat(LINEAR, FILTERS["B-EKF 1"].having(bump=bumps[:, None]), 30, settings=2)
    for i, bump in enumerate(bumps):
        one = treat(LINEAR, FILTERS["B-EKF 1"].having(bump=bump), 30)
        for name in ("rms", "median", "lost", "nees", "nis", "covered"):
            np.testing.assert_allclose(getattr(both, name)[i], getattr(one, name), rtol=1e-9)


def test_runs_without_a_number_are_lost_and_the_others_do_not_notice():
    def half(runs, seed):
        draw = drawn(runs, seed)
        z = draw.z.copy()
        z[3:, :5] = 1e200  # squares overflow
        return draw._replace(z=z)

    ill = replace(LINEAR, draw=half)
    found = treat(ill, Filter(rule=AdaptiveRobust()), 20)
    assert found.lost == 0.25
    assert np.isinf(found.rms)
    assert np.isfinite(found.median)


def test_runs_that_share_their_measurements_are_one_run_to_the_band():
    shared = replace(LINEAR, repeated=True)
    alone, many = treat(LINEAR, FILTERS["EKF"], 1), treat(shared, FILTERS["EKF"], 30)
    assert many.band == alone.band
    assert treat(LINEAR, FILTERS["EKF"], 30).band != alone.band


def test_only_what_is_tested_counts_for_honesty():
    first = replace(LINEAR, tested=(0,))
    found = treat(first, FILTERS["EKF"], 400)
    assert found.dof == 1
    assert float(found.honesty) == pytest.approx(1, abs=0.2)


def test_another_state_is_judged_in_the_problems_own():
    """The same filter, its state doubled."""
    double = replace(
        LINEAR,
        draw=lambda runs, seed: doubled(drawn(runs, seed)),
        model=Linear(H / 2, R),
        back=lambda x: x / 2,
    )
    plain, other = (
        treat(LINEAR, FILTERS["EKF"], 20),
        treat(LINEAR, FILTERS["EKF"], 20, believed=double),
    )
    for name in ("rms", "nees", "nis"):
        np.testing.assert_allclose(getattr(other, name), getattr(plain, name), rtol=1e-9)


def doubled(draw):
    prior = Gaussian(2 * draw.prior.mean, 4 * draw.prior.cov)
    return draw._replace(prior=prior, truth=2 * draw.truth)


def test_evaluations_are_counted():
    patients = problems()
    assert evaluations(patients["fix, noisy"], FILTERS["EKF"]) == 2  # h and its Jacobian
    assert evaluations(patients["fix, noisy"], FILTERS["UKF"]) == 5
    assert evaluations(patients["burns, A"], FILTERS["EKF"]) == 3  # and the motion


def test_noisier_dynamics_are_noisier_when_they_should_be():
    burns = problems()["burns, A"]
    timed = Noisier(burns.dynamics, 100.0, burns.burning)
    np.testing.assert_array_equal(timed.at(0).Q, burns.dynamics.Q)
    np.testing.assert_array_equal(timed.at(75).Q, 100 * burns.dynamics.Q)
    assert not hasattr(timed, "retract")
