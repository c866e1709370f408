"""The set-up of section 5, its true flight and its noise."""

from dataclasses import replace

import numpy as np
import pytest
from geopotential import potential
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.papers.xiong2009 import (
    ESTIMATORS,
    VARIANTS,
    Setup,
    cramer_rao_bound,
    measurements,
    noise,
    position_errors,
    rms_error,
    together,
    truth,
)
from navfilters.space import EARTH, Orbit, perigee_apogee

SHORT = Setup(duration=2000, window=500, burns=((700, 900),), thrust=0.45)


READ_AGAIN = """\
EKF    0.2771 2.4096 1.2367 2.7175 6
REKF   0.1382 1.4027 0.7055 1.5762 6
AEKF   1.9091 1.2786 0.6441 2.3863 4
AREKF  126.1731 143.1503 69.5699 203.1050 0
"""


def test_table_1_as_it_was_read_a_second_time():
    """sigma x, y, z and p in m, and the power of ten behind the row, from the text.

    Each p is x, y and z together to the last digit printed, but the EKF's, which is 0.19 % less:
    so the text has it.
    """
    for line in READ_AGAIN.splitlines():
        name, *printed, power = line.split()
        wanted = np.array(printed, float) * 10.0 ** int(power)
        assert_allclose(ESTIMATORS[name].paper, wanted, rtol=1e-12)
        less = 1.865e-3 if name == "EKF" else 0.0
        assert_allclose(np.linalg.norm(wanted[:3]) / wanted[3] - 1, less, atol=1e-5)
    assert np.isnan(ESTIMATORS["EKF with thrust"].paper).all()


def test_the_adaptive_filters_numbers_as_they_were_read_a_second_time():
    """Under Eq. (44): a, the lags of Eq. (45) and the window; Eq. (47)'s alpha."""
    noise_rule, robust = (ESTIMATORS[name].filter.rule for name in ("AEKF", "AREKF"))
    assert (noise_rule.a, noise_rule.k, noise_rule.N) == (1.5, 2, 15)
    assert robust.alpha == 0.2


def test_constants_of_section_5():
    setup = Setup()
    assert_allclose(setup.x0[:3], [6878137, 0, 0])
    assert_allclose(np.arctan2(setup.x0[5], setup.x0[4]), np.deg2rad(27))
    assert_allclose(setup.prior.mean, setup.x0 - ([5000] * 3 + [10] * 3))
    assert_array_equal(setup.prior.cov, np.diag([25e6] * 3 + [100] * 3))
    assert_allclose(setup.orbit().Q, np.diag([4e-10] * 3 + [4e-8] * 3))
    assert setup.orbit().substeps == 100
    arcseconds = {name: v.sigma * 648000 / np.pi for name, v in VARIANTS.items()}
    assert_allclose([arcseconds[v] for v in "ABCD"], [72.17, 5, 72.17, 24.06], atol=0.01)
    assert_allclose(VARIANTS["C"].orbit().Q[5, 5], (13 * 2e-4) ** 2)


def test_the_thrust_reaches_the_perigee():
    """2000 km when the last burn ends, by 0.45280 m/s^2; the apogee is then at 2682 km."""
    flight = truth()
    assert_allclose(flight.thrust.magnitude, 0.45280, atol=5e-6)
    low, high = perigee_apogee(flight.states[12068])
    assert_allclose(low, 2000e3, atol=1e-3)
    assert_allclose(high, 2682e3, atol=1e3)
    assert flight.states.shape == (20001, 6)
    assert truth(VARIANTS["B"]) is flight  # computed once


def test_the_truth_is_the_runge_kutta_path():
    """A second integrator at 1 s agrees to 1e-4 m through both burns."""
    flight = truth()
    path = Orbit(EARTH, flight.thrust, substeps=12200).path(flight.states[0])
    error = np.abs(path - flight.states[1:12201])
    assert error[:, :3].max() < 1e-4
    assert error[:, 3:].max() < 1e-7


def test_without_burns_energy_and_momentum_are_kept():
    flight = truth(Setup(burns=()))
    r, v = flight.states[:, :3], flight.states[:, 3:]
    energy = np.sum(v * v, axis=1) / 2 - potential(r)
    momentum = r[:, 0] * v[:, 1] - r[:, 1] * v[:, 0]
    assert flight.thrust.magnitude == 0
    assert_allclose(energy, energy[0], rtol=1e-11)
    assert_allclose(momentum, momentum[0], rtol=1e-11)


def test_noise_is_the_seeds_own():
    v = noise([5, 3])
    assert v.shape == (200, 2, 2)
    assert_array_equal(v[:, 1], np.random.default_rng(3).standard_normal((200, 2)))
    assert_array_equal(noise([3])[:, 0], v[:, 1])


def test_measurements_are_the_angles_with_the_noise_of_each_reading():
    setup = replace(together(), duration=2000, window=500, burns=(), thrust=0.0)
    z = measurements(setup, [5, 3])
    assert z.shape == (20, 4, 2, 2)
    angles = setup.sensor.h(truth(setup).states[100::100])
    for i, name in enumerate("ABCD"):
        sigma = VARIANTS[name].sigma
        assert_allclose((z[:, i] - angles[:, None]) / sigma, noise([5, 3], setup), atol=1e-9)


def test_readings_together_are_the_readings():
    both = together("CD")
    for i, name in enumerate("CD"):
        one = VARIANTS[name]
        assert_array_equal(both.sensor.R[i, 0], one.sensor.R)
        assert_array_equal(both.orbit().Q[i, 0], one.orbit().Q)


REFUSED = {
    "filter": (lambda: rms_error("UKF"), r"filter_name must be one of .*'AREKF'.*found 'UKF'"),
    "variant": (lambda: rms_error("EKF", "E"), r"variant must be .*'A', 'B', 'C', 'D'\]; found"),
    "reading": (lambda: together("AX"), "variant must be one of .*found 'X'"),
    "no seeds": (lambda: rms_error("EKF", seeds=[]), "seeds must be .*found none"),
    "negative seed": (lambda: rms_error("EKF", seeds=[-1]), "seeds must be integers .*found"),
    "half a seed": (lambda: position_errors("EKF", seeds=[0.5]), "seeds must be integers"),
    "seeds: a number": (lambda: rms_error("EKF", seeds=3), "seeds must be integers .*found 3"),
    "bound's thrust": (lambda: cramer_rao_bound(thrust="no"), "thrust must be one of.*found 'no'"),
    "acceleration": (lambda: cramer_rao_bound(acceleration=-1.0), "acceleration must be .*-1"),
    "interval": (lambda: Setup(interval=300), "interval must divide duration; found 300"),
    "step": (lambda: Setup(step=2.0), "step must be a second or .*found 2"),
    "window": (lambda: Setup(window=30000), "window must be .*found 30000"),
    "perigee": (lambda: truth(replace(SHORT, thrust=None)), "perigee must be reached"),
    "thrust": (
        lambda: truth(replace(SHORT, thrust=-1.0)),
        "magnitude must be at least 0; found -1",
    ),
    "burns": (lambda: truth(Setup(burns=((0, 30000),))), "burns must be within"),
}


def test_a_burn_may_last_from_the_first_second_to_the_last():
    """Thrust is along the velocity, and its work what the energy gains; J2 adds a thousandth."""
    flown = truth(replace(SHORT, burns=((0, 2000),)))
    assert flown.thrust.magnitude == 0.45
    r, v = (np.linalg.norm(flown.states[:, part], axis=1) for part in (slice(3), slice(3, 6)))
    energy = v**2 / 2 - EARTH.mu / r
    assert_allclose(energy[-1] - energy[0], 0.45 * np.trapezoid(v), rtol=1e-2)


@pytest.mark.parametrize(("call", "message"), REFUSED.values(), ids=REFUSED)
def test_bad_input_is_refused_by_name(call, message):
    with pytest.raises(ValueError, match=message):
        call()
