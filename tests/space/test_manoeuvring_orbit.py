"""An orbit with the thrust in the state, or in the noise."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from navfilters.papers.xiong2009 import Setup, truth
from navfilters.space import ManoeuvringOrbit, manoeuvring

SETUP = Setup()
START = SETUP.x0
ARCS = ((30.0, 70.0),)
EXTRA = {"none": [], "strength": [0.4], "vector": [0.1, -0.3, 0.2]}


def started(thrust):
    return np.concatenate([START, EXTRA[thrust]])


def written_out(t, x, thrust, memory):
    """Eq. (36) and the thrust, in plain terms."""
    mu, radius, j2 = 3.986004418e14, 6378137.0, 1.08262668e-3
    r = np.linalg.norm(x[:3])
    bracket = 1 + 1.5 * j2 * (radius / r) ** 2 * (np.array([1, 1, 3]) - 5 * x[2] ** 2 / r**2)
    a = -mu * x[:3] / r**3 * bracket
    if 30 <= t < 70 and thrust == "strength":
        a = a + x[6] * x[3:6] / np.linalg.norm(x[3:6])
    if 30 <= t < 70 and thrust == "vector":
        a = a + x[6:]
    return np.concatenate([x[3:6], a, -x[6:] / memory])


def flown(x, thrust, memory):
    """By SciPy, arc by arc."""
    for a, b in ((0, 30), (30, 70), (70, 100)):
        x = solve_ivp(
            written_out, (a, b), x, args=(thrust, memory), method="DOP853", rtol=1e-12, atol=1e-9,
            max_step=b - a, t_eval=[b - 1e-9],
        ).y[:, -1]  # fmt: skip
    return x


@pytest.mark.parametrize("thrust", ["none", "strength", "vector"])
@pytest.mark.parametrize("memory", [np.inf, 200.0])
def test_the_path_is_that_of_another_integrator(thrust, memory):
    orbit = manoeuvring(SETUP.orbit(), thrust, arcs=ARCS, memory=memory)
    x = started(thrust)
    wanted = flown(x, thrust, memory)
    assert_allclose(orbit.f(x)[:6], wanted[:6], rtol=0, atol=0.02)
    assert_allclose(orbit.f(x)[6:], wanted[6:], rtol=1e-6)
    assert_allclose(orbit.transition(x)[0], orbit.f(x), rtol=1e-14)


@pytest.mark.parametrize("thrust", ["none", "strength", "vector"])
def test_F_is_the_derivative_of_f(thrust):
    orbit = manoeuvring(SETUP.orbit(), thrust, arcs=ARCS, memory=300.0)
    x = started(thrust)
    _, F = orbit.transition(x)
    sizes = np.array([100.0] * 3 + [0.1] * 3 + [1e-3] * 3)[: x.size]
    for j, h in enumerate(sizes):
        step = h * np.eye(x.size)[j]
        wanted = (orbit.f(x + step) - orbit.f(x - step)) / (2 * h)
        assert_allclose(F[:, j], wanted, rtol=2e-4, atol=1e-3 * np.abs(wanted).max())


def test_without_thrust_it_is_the_orbit_second_by_second():
    orbit = SETUP.orbit()
    x, F, W = manoeuvring(orbit).propagate(START, orbit.Q)
    x_1, F_1, W_1 = orbit.propagate(START, orbit.Q)
    assert_allclose(x, x_1, rtol=0, atol=0.01)
    size = np.repeat([1.0, 0.01], 3)  # of a metre, and of a metre in 100 s
    assert_allclose(F / size[:, None] * size, F_1 / size[:, None] * size, rtol=0, atol=1e-4)
    assert_allclose(np.diag(W), np.diag(W_1), rtol=1e-3)


def test_noise_in_the_arcs_is_that_of_their_seconds():
    """Velocity noise of the 40 seconds of fire, carried to the end along straight lines."""
    orbit = manoeuvring(replace(SETUP.orbit(), Q=np.zeros((6, 6))), arcs=ARCS, q_v=2.0)
    W = orbit.propagate(START, orbit.Q)[2]
    left = np.arange(30, 70)  # seconds from each of them to the end
    wanted = 4 * np.array([[np.sum(left**2), np.sum(left)], [np.sum(left), 40]])
    assert_allclose(W[:2, :2].diagonal(), wanted[0, 0], rtol=0.01)
    assert_allclose([W[1, 4], W[4, 4]], wanted[1], rtol=0.01)
    later = orbit.at(1)
    assert_allclose(later.propagate(START, later.Q)[2], 0, atol=0)


def test_a_smaller_step_changes_nothing_that_matters():
    coarse = manoeuvring(SETUP.orbit(), "strength", arcs=truth().thrust.arcs)
    x = np.append(truth().states[7200], truth().thrust.magnitude)
    far, F, W = coarse.at(72).propagate(x, coarse.Q)
    fine = replace(coarse, step=1).at(72)
    x_1, F_1, W_1 = fine.propagate(x, fine.Q)
    assert_allclose(far, x_1, rtol=0, atol=0.01)
    assert_allclose(far[:6], truth().states[7300], rtol=0, atol=0.01)
    size = np.array([1.0] * 3 + [0.01] * 3 + [1e-4])  # in 100 s each is worth a metre
    assert_allclose(F / size[:, None] * size, F_1 / size[:, None] * size, rtol=0, atol=1e-4)
    assert_allclose(np.diag(W), np.diag(W_1), rtol=1e-3)


def test_a_batch_is_its_members():
    q = np.array([0.1, 1.0])[:, None]
    orbit = manoeuvring(SETUP.orbit(), "vector", arcs=ARCS, q_a=q)
    x = started("vector") + np.arange(3.0)[:, None]
    together = orbit.propagate(x, orbit.Q)
    for i in range(2):
        one = manoeuvring(SETUP.orbit(), "vector", arcs=ARCS, q_a=q[i, 0])
        for whole, part in zip(together, one.propagate(x[1], one.Q), strict=True):
            whole = whole if whole.ndim < part.ndim + 2 else whole[i]
            assert_allclose(whole[1], part, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"thrust": "up"}, r"thrust must be one of .*found 'up'"),
        ({"arcs": ((5.5, 9.0),)}, "arcs must begin and end in whole seconds"),
        ({"arcs": ((9.0, 5.0),)}, "arcs must be"),
        ({"memory": 0.0}, "memory must be a positive number of seconds; found 0.0"),
        ({"Q": np.eye(7)}, r"Q must have shape .*6, 6"),
        ({"step": 0}, "step must be"),
    ],
)
def test_bad_input_is_named(change, message):
    with pytest.raises(ValueError, match=message):
        ManoeuvringOrbit(**({"Q": np.eye(6)} | change))


def test_an_orbit_of_other_sub_steps_is_refused():
    with pytest.raises(ValueError, match=r"orbit.step must be 1 s; found 0.5"):
        manoeuvring(replace(SETUP.orbit(), step=0.5))


def test_by_default_all_sub_steps_are_as_long():
    orbit = ManoeuvringOrbit(np.eye(6))
    assert orbit.interval % orbit.step == 0
