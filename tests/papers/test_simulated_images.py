"""Simulated measurements of radar images, and the numbers that are drawn for them."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from navfilters.papers.pogorelsky2020.experiment import CASES, Setup
from navfilters.papers.pogorelsky2020.noise_draws import misalignment, noise
from navfilters.papers.pogorelsky2020.open_loop import (
    SimulatedImages,
    monte_carlo,
    simulate_images,
)
from navfilters.papers.pogorelsky2020.true_flight import truth
from navfilters.space.frames import ellipsoid_intersection
from navfilters.space.pose import difference
from navfilters.space.quaternions import rotation_vector


def test_noise_depends_on_seed_and_run_only():
    long, short = noise([3, 5], 72, 1), noise(6, 5, 1)
    assert_array_equal(long.first[1], short.first[5])
    for a, b in zip(long[1:], short[1:], strict=True):
        assert_array_equal(a[0, :5], b[3])
    everything = np.concatenate([a.reshape(2, -1) for a in noise(2, 2000)], axis=1)
    assert_allclose(np.std(everything), 1, atol=0.02)
    assert abs(np.corrcoef(everything)[0, 1]) < 0.03


def test_simulated_images():
    """Pixel, range and speed scatter as D, 1 m and 0.54 m/s say, about the true antenna's beam."""
    setup, flight, drawn = Setup(), truth(Setup(), 5), noise(4000, 5)
    q = misalignment(setup, drawn.walk)
    seen = SimulatedImages(setup, flight, q, drawn)(3, None)
    model = replace(setup.geometry, T_e_b=flight.T_e_b[3])
    hit = ellipsoid_intersection(flight.x[3, :3], model.boresight(q[:, 3]))
    assert_allclose(np.cov((seen.r_f - hit).T), setup.geometry.D, atol=4)
    distance = np.linalg.norm(hit - flight.x[3, :3], axis=-1)
    assert_allclose(np.std(seen.slant_range - distance), 1, atol=0.05)
    assert_allclose(np.std(seen.speed), 0.54, atol=0.03)
    assert_allclose(np.mean(seen.speed), np.linalg.norm(flight.x[3, 3:]), atol=0.03)
    step = np.sqrt(3.4e-13 * 25 / 3)
    assert_allclose(np.std(rotation_vector(q[:, 3]), axis=0), np.sqrt(3) * step, rtol=0.05)
    assert_array_equal(misalignment(replace(setup, walk=False), drawn.walk)[:, 3], q[:, 0])


def test_simulated_images_are_those_of_the_runs():
    """And the truth of each of them."""
    setup, flight = CASES["TC-2"], truth(CASES["TC-2"], 5)
    images = simulate_images("TC-2", 3, 4, flight=flight)
    got = monte_carlo("TC-2", 2, 3, 4, flight=flight, measure=images)
    assert_array_equal(got.errors, monte_carlo("TC-2", 2, 3, 4, flight=flight).errors)
    drawn = noise(3, 5, 4)
    wanted = SimulatedImages(setup, flight, misalignment(setup, drawn.walk), drawn)(2, None)
    assert_array_equal(images(2, None).r_f, wanted.r_f)
    true = images.true_state(2)
    assert_array_equal(true.r, flight.x[2, :3])
    assert_array_equal(true.v, flight.x[2, 3:])
    assert_array_equal(true.q_mu, images.q_mu[:, 2])
    error = difference(true.x, images.true_state(1).x)
    assert_array_equal(error[:, :6], np.broadcast_to(flight.x[2] - flight.x[1], (3, 6)))
    assert ((np.abs(error[:, 6:]) > 0) & (np.abs(error[:, 6:]) < 1e-4)).all()
