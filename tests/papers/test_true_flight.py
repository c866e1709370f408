"""The pass over Houston: its first state, its target, its attitude."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from navfilters.papers import pogorelsky2020
from navfilters.papers.pogorelsky2020.experiment import CASES, Setup
from navfilters.papers.pogorelsky2020.true_flight import _attitude, _circular, initial_state, truth
from navfilters.space.frames import ecef_to_geodetic, ellipsoid_intersection

R0 = np.array([-1108465.150, -6100044.949, 3397134.666])
V0 = np.array([-1003.9419331, 3801.3289491, 6498.2536689])


def boresight_hit(setup, k=0):
    flight = truth(setup, 5)
    model = replace(setup.geometry, T_e_b=flight.T_e_b[k])
    return ellipsoid_intersection(flight.x[k, :3], model.boresight(pogorelsky2020.NOMINAL))


def test_constants():
    for case, sigma_mu, beta in (("TC-1", 0.1, 0.2), ("TC-2", 0.01, 0.0)):
        setup = CASES[case]
        deviation = [1000] * 3 + [10] * 3 + [np.deg2rad(sigma_mu)] * 3
        assert_allclose(np.sqrt(np.diag(setup.P0)), deviation)
        assert_allclose(np.diag(setup.orbit.Q_psd), [3.5e-11] * 3 + [3.4e-13] * 3)
        assert_allclose(np.diag(setup.geometry.R), [0, 0, 1, 0.54**2])
        assert_allclose(np.linalg.eigvalsh(setup.geometry.D), [1, 4, 64])
        assert setup.underweighting == beta
        assert_allclose(setup.orbit.step, 0.8333, atol=1e-4)
        assert_allclose(setup.geometry.look, np.deg2rad(34.3))


def test_noise_is_given_by_its_deviations():
    setup = Setup(sigma_range=2.0, sigma_speed=3.0, pixel=(1.0, 2.0, 5.0))
    assert_allclose(np.diag(setup.geometry.R), [0, 0, 4, 9])
    assert_allclose(np.linalg.eigvalsh(setup.geometry.D), [1, 4, 25])


def test_the_first_state():
    """Circular at 691.5 km, 98.16 degrees, ascending, the beam on Houston."""
    x = initial_state()
    assert_allclose(x[:3], R0, atol=1e-3)
    assert_allclose(x[3:], V0, atol=1e-6)
    r, v = x[:3], x[3:] + 7.292115e-5 * np.array([-x[1], x[0], 0])
    assert_allclose(np.linalg.norm(r), 6378137 + 691.5e3)
    assert_allclose(np.linalg.norm(v), np.sqrt(3.986004418e14 / 7069637))
    assert abs(r @ v) < 1e-3
    h = np.cross(r, v)
    assert_allclose(np.rad2deg(np.arccos(h[2] / np.linalg.norm(h))), 98.16)
    hit = boresight_hit(Setup())
    assert_allclose(ecef_to_geodetic(hit), [29.76, -95.37, 0], atol=1e-7)
    assert_allclose(np.linalg.norm(hit - r), 866060, atol=1)


@pytest.mark.parametrize("attitude", ["earth-fixed", "inertial", "constant rate"])
@pytest.mark.parametrize("ascending", [True, False])
@pytest.mark.parametrize("look", [34.3, -34.3])
def test_every_pass_sees_the_target(look, ascending, attitude):
    setup = Setup(look=look, ascending=ascending, attitude=attitude)
    assert_allclose(ecef_to_geodetic(boresight_hit(setup)), [29.76, -95.37, 0], atol=1e-7)
    x = truth(setup, 1).x[0]
    assert (x[5] > 0) == ascending
    passes_west = ecef_to_geodetic(x[:3])[1] < -95.37
    assert passes_west == ((look > 0) == ascending)


def test_images_are_57_km_apart_and_reach_canada():
    flight = truth()
    assert flight.times.shape == (73,)
    assert_allclose(flight.times[[0, 3, 72]], [0, 25, 600])
    hits = [boresight_hit(Setup(), k) for k in (1, 2)]
    assert_allclose(np.linalg.norm(hits[1] - hits[0]), 57e3, atol=1e3)
    model = replace(Setup().geometry, T_e_b=flight.T_e_b[-1])
    last = ellipsoid_intersection(flight.x[-1, :3], model.boresight(pogorelsky2020.NOMINAL))
    assert 60 < ecef_to_geodetic(last)[0] < 75
    assert truth() is flight


def test_the_truth_is_not_the_printed_integration():
    printed = truth(Setup(integrator="printed"), 72)
    assert_array_equal(printed.x, truth().x)


def test_attitude_definitions():
    """Yaw by the Earth's rotation between two; a constant rate that leaves the first of them."""
    fixed, inertial, constant = (
        truth(Setup(attitude=a), 72) for a in ("earth-fixed", "inertial", "constant rate")
    )
    assert_array_equal(constant.x, fixed.x)
    for each in (fixed, inertial, constant):
        assert_allclose(
            each.T_e_b @ each.T_e_b.mT, np.broadcast_to(np.eye(3), (73, 3, 3)), atol=1e-14
        )
    assert_allclose(constant.T_e_b[[0, 5]], fixed.T_e_b[[0, 5]], atol=1e-12)
    turns = Rotation.from_matrix(constant.T_e_b[1:] @ constant.T_e_b[:-1].mT).as_rotvec()
    assert_allclose(turns, np.broadcast_to(turns[0], turns.shape), atol=1e-12)
    v = inertial.x[:, 3:] + 7.292115e-5 * np.cross([0, 0, 1], inertial.x[:, :3])
    assert_allclose((inertial.T_e_b @ v[..., None])[:, 1], 0, atol=1e-8)
    assert_allclose((fixed.T_e_b @ fixed.x[:, 3:, None])[:, 1], 0, atol=1e-8)


def test_the_target_is_met_by_another_solver():
    """Latitude and longitude of the hit, by differences of their own."""
    setup = Setup(inclination=80.0, look=20.0, target=(50.0, 10.0))

    def miss(angles):
        x = _circular(setup, *angles)
        model = replace(setup.geometry, T_e_b=_attitude(setup, x))
        hit = ellipsoid_intersection(x[:3], model.boresight(pogorelsky2020.NOMINAL))
        return np.array(ecef_to_geodetic(hit)[:2]) - setup.target

    found = root(miss, [0.9, -0.1], method="lm", options={"xtol": 1e-14})
    assert_allclose(initial_state(setup)[:3], _circular(setup, *found.x)[:3], atol=1e-2)
