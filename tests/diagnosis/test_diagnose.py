"""A right filter passes, a wrong one is named for what is wrong with it."""

import json
from dataclasses import replace

import numpy as np
import pytest
from logs import kalman_log, kalman_logs
from numpy.testing import assert_allclose
from scipy import stats

from navfilters.diagnosis import Log, diagnose
from navfilters.runs import nis


def test_right_filters_pass_as_often_as_is_said():
    """Of 120 right filters with gaps 6 may fail; 14 or more would be an accident of one in 500."""
    failed = sum(not diagnose(log).consistent for log in kalman_logs(range(120), 150, gaps=0.2))
    assert failed <= 14


def test_the_sum_is_that_of_the_library():
    log = kalman_log()
    found = diagnose(log)
    assert_allclose(found.nis, nis(log.innovation, log.S), rtol=1e-12)
    assert found.ratio == pytest.approx(np.mean(nis(log.innovation, log.S)) / 2)
    band = stats.chi2(2 * len(log.time)).interval(1 - 0.05 / 7)
    assert_allclose([found.low, found.high], np.array(band) / (2 * len(log.time)))


@pytest.mark.parametrize(("told_r", "way"), [(0.25, "too sure"), (4.0, "not sure enough")])
def test_wrong_noise_is_found_and_the_factor_is_right(told_r, way):
    found = diagnose(kalman_log(told_r=told_r))
    assert any(way in finding for finding in found.findings)
    fitting = kalman_log()
    for i, channel in enumerate(found.channels):
        y = kalman_log(told_r=told_r).innovation[:, i]
        S = kalman_log(told_r=told_r).S[:, i, i]
        assert channel.scale == pytest.approx(np.mean(y**2 / S))
        assert channel.low < channel.scale < channel.high
        assert not channel.low < 1 < channel.high
    assert all(c.low < 1 < c.high for c in diagnose(fitting).channels)


def test_the_scale_makes_it_consistent():
    """One channel alone: S times the factor has a mean NIS of one."""
    log = kalman_log(told_r=0.25)
    one = Log(log.time, log.innovation[:, :1], log.S[:, :1, :1])
    scale = diagnose(one).channels[0].scale
    assert diagnose(replace(one, S=scale * one.S)).ratio == pytest.approx(1.0)


def test_a_bias_is_found_in_its_channel():
    log = kalman_log()
    shifted = log.innovation + np.array([0.4, 0.0]) * np.sqrt(log.S[:, [0, 1], [0, 1]])
    found = diagnose(replace(log, innovation=shifted))
    assert [c.biased for c in found.channels] == [True, False]
    assert found.channels[0].bias == pytest.approx(diagnose(log).channels[0].bias + 0.4)
    assert any("channel 1 is biased" in finding for finding in found.findings)


def test_too_little_process_noise_is_coloured():
    found = diagnose(kalman_log(told_q=0.01))
    assert found.channels[0].coloured
    assert found.channels[0].correlation > 0.1


@pytest.mark.parametrize("late", [150, 250])
def test_when_it_stopped_being_right(late):
    found = diagnose(kalman_log(3, told_r=0.1, late=late), window=25)
    assert late - 25 < found.stopped <= late + 26
    assert diagnose(kalman_log(3), window=25).stopped is None


def test_too_careful_first_and_too_sure_later():
    """Below its band from the start, above it from the fault on: both moments are told."""
    log, late = kalman_log(3, told_r=4.0, told_q=4.0), slice(250, None)
    S = log.S.copy()
    S[late] /= 60
    found = diagnose(replace(log, S=S), window=25)
    assert found.stopped == 1.0
    assert 225 < found.above <= 276
    sides = [f for f in found.findings if "window" in f]
    assert sides[0].endswith("begins at time 1, below it")
    assert sides[1].endswith(f"too sure, begins at time {found.above:g}")


@pytest.mark.parametrize(
    ("begin", "step", "said"),
    [
        (0.0660264, 0.04, "0.07"),
        (-1e-9, 0.04, "0"),
        (1.7e9 + 0.25, 1.0, "1700000000.2"),
        (1234567.8, 1e3, "1234568"),
    ],
)
def test_a_time_has_as_many_digits_as_a_log_of_its_span_can_tell(begin, step, said):
    log = kalman_log(3, told_r=4.0, told_q=4.0)
    found = diagnose(replace(log, time=begin + step * np.arange(len(log.time))), window=25)
    assert f"begins at time {said}, below it" in next(f for f in found.findings if "window" in f)


def test_an_echo_is_found_at_its_lag():
    log = kalman_log()
    y = log.innovation.copy()
    y[3:, 0] += y[:-3, 0]
    found = diagnose(replace(log, innovation=y)).channels[0]
    assert found.coloured
    assert found.lag == 3
    assert 0.3 < found.at_lag < 0.7


def test_errors_beside_their_covariance():
    right, wrong = diagnose(kalman_log()), diagnose(kalman_log(told_r=0.1, told_q=0.1))
    assert right.nees_low < right.nees_ratio < right.nees_high
    assert any("larger than claimed" in finding for finding in wrong.findings)
    careful = diagnose(kalman_log(told_r=20.0, told_q=20.0))
    assert any("smaller than claimed" in finding for finding in careful.findings)


def test_what_was_not_measured_does_not_count():
    log = kalman_log(1)
    half = log.innovation.copy()
    half[::2, 1] = np.nan
    half[5] = np.nan
    found = diagnose(replace(log, innovation=half))
    assert found.dof[4] == 1
    assert found.dof[5] == 0
    assert np.isnan(found.nis[5])
    assert found.nis[4] == pytest.approx(half[4, 0] ** 2 / log.S[4, 0, 0])
    assert [c.count for c in found.channels] == [399, 199]


def test_angles_wrap():
    log = kalman_log(2)
    turned = log.innovation.copy()
    turned[::3, 1] += 2 * np.pi
    turned[1::3, 1] -= 2 * np.pi
    turned = replace(log, innovation=turned)
    assert not diagnose(turned).consistent
    got, wanted = diagnose(turned, angles={2: 2 * np.pi}), diagnose(log)
    assert_allclose(got.nis, wanted.nis, rtol=1e-9)


def test_an_indefinite_S_is_a_finding():
    log = kalman_log()
    S = log.S.copy()
    S[7] = [[1.0, 2.0], [2.0, 1.0]]
    found = diagnose(replace(log, S=S))
    assert found.indefinite == 1
    assert "not positive definite at 1" in found.findings[0]


def test_a_singular_S_is_a_finding_whatever_its_rounding():
    """An eigenvalue a little above zero had no Cholesky factor, and ended the diagnosis."""
    rng = np.random.default_rng(0)
    for _ in range(50):
        v = rng.normal(size=3)
        S = np.tile(np.eye(3), (20, 1, 1))
        S[7] = np.outer(v, v)
        assert diagnose(Log(np.arange(20.0), rng.normal(size=(20, 3)), S)).indefinite == 1


def test_a_bias_of_few_updates_is_that_of_student():
    """Of right filters with four updates as many are called biased as the test allows."""
    rng, tail = np.random.default_rng(1), 0.05 / 4 / 2
    for y in rng.normal(size=(200, 4, 1)) + rng.normal(size=(200, 1, 1)):
        found = diagnose(Log(np.arange(4.0), y, np.ones((4, 1, 1))))
        wanted = stats.ttest_1samp(y[:, 0], 0.0).pvalue < 2 * tail
        assert found.channels[0].biased == wanted


def test_units_change_nothing():
    log, D = kalman_log(told_r=0.5), np.diag([1e3, 1e-6])
    scaled = Log(log.time, log.innovation @ D, D @ log.S @ D)
    one, other = diagnose(Log(log.time, log.innovation, log.S)), diagnose(scaled)
    assert_allclose(other.nis, one.nis, rtol=1e-9)
    assert [c.scale for c in other.channels] == pytest.approx([c.scale for c in one.channels])


def test_a_summary_is_json():
    text = json.dumps(diagnose(kalman_log()).summary())
    assert json.loads(text)["findings"] == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"angles": {3: 1.0}}, r"angles must name channels 1 to 2; found 3"),
        ({"angles": {1: 0.0}}, r"positive periods; found 0"),
        ({"window": 5}, r"window.*10"),
        ({"confidence": 1.0}, r"confidence must be between 0 and 1; found 1"),
    ],
)
def test_bad_options_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        diagnose(kalman_log(steps=20), **options)


def test_a_log_without_measurements_is_refused():
    log = kalman_log(steps=20)
    with pytest.raises(ValueError, match="at least one innovation"):
        diagnose(replace(log, innovation=np.full((20, 2), np.nan)))


@pytest.mark.parametrize("steps", [1, 2, 11])
def test_short_logs(steps):
    found = diagnose(kalman_log(steps=steps))
    assert np.isfinite(found.ratio)
    assert len(found.windows) == 1
