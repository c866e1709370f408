"""States with a quaternion in run and sweep, on both engines; and what is refused of them."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navfilters import FILTERS, Filter, Gaussian, run, sweep
from navfilters.estimators.variants import Underweighting
from navfilters.papers.pogorelsky2020 import CASES, NOMINAL, simulate_images, truth
from navfilters.runs import records
from navfilters.space.image_sensor import SarPass
from navfilters.space.pose import difference, retract
from navfilters.space.quaternions import normalized

engines = pytest.mark.parametrize("engine", ["numpy", pytest.param("jax", marks=pytest.mark.slow)])
MEKF = Filter(variant=Underweighting(0.5, 2))
STEPS, COUNT = 4, 5


def flown(size=0.3):
    """A pass over Houston, estimates about its start, and an image after each interval."""
    setup = replace(CASES["TC-1"], steps=3)
    flight = truth(setup, STEPS)
    error = np.sqrt(np.diag(setup.P0)) * np.random.default_rng(1).normal(size=(COUNT, 9))
    first = np.concatenate([flight.x[0], NOMINAL])
    prior = Gaussian(retract(first, -size * error), size**2 * setup.P0)
    images = simulate_images(setup, COUNT, flight=flight)
    z = np.stack([images(k, None).z for k in range(1, STEPS + 1)])
    return prior, z, SarPass(setup.geometry, flight.T_e_b[1:]), setup.dynamics


def assert_close(got, wanted, atol):
    """In deviations, and as correlations."""
    sigma = np.sqrt(np.diagonal(wanted.cov, axis1=-2, axis2=-1))
    off = difference(got.mean, wanted.mean) / sigma
    assert_allclose(off, 0, atol=atol)
    pair = sigma[..., :, None] * sigma[..., None, :]
    assert_allclose(got.cov / pair, wanted.cov / pair, rtol=0, atol=atol)


@pytest.mark.parametrize("name", [name for name in FILTERS if name != "B-EKF 3"])
def test_a_call_is_one_update(name):
    """Of an image, with the attitude of the first; a lost one leaves its member as it was."""
    prior, z, images, _ = flown()
    z[0, 2, :3] = np.nan
    prior = Gaussian(prior.mean, np.broadcast_to(prior.cov, (COUNT, 9, 9)))
    with np.errstate(invalid="ignore"):  # of the image that is lost
        got = FILTERS[name](prior, z[0], images)
        wanted = FILTERS[name].update(FILTERS[name].init(prior), z[0], images, 0).estimate
    assert_array_equal(got.mean, wanted.mean)
    assert_array_equal(got.cov, wanted.cov)
    assert_array_equal(got.mean[2], prior.mean[2])
    assert np.all(np.delete(got.mean, 2, 0)[:, :3] != np.delete(prior.mean, 2, 0)[:, :3])


@engines
def test_the_multiplicative_ekf_is_swept_as_it_is_run(engine):
    """Each image with its own attitude, the first two underweighted; one of them is not matched."""
    prior, z, images, dynamics = flown()
    z[1, 2, :3] = np.nan
    wanted = run(MEKF, prior, z, images, dynamics=dynamics, z_per_step=True)
    got = sweep(
        MEKF,
        prior,
        z,
        images,
        dynamics=dynamics,
        z_per_step=True,
        record=records.estimate,
        engine=engine,
        chunk=2,
        progress=False,
    )
    assert got.record.mean.shape == (STEPS + 1, COUNT, 10)
    assert_close(got.record, wanted, 1e-7)
    assert_close(got.final, Gaussian(*(part[-1] for part in wanted)), 1e-7)
    assert_array_equal(got.state.missed, [0, 0, 1, 0, 0])
    spread = np.linalg.eigvalsh(got.final.cov[:, :3, :3])
    assert (spread[:, 0] < 10**2).all()  # the images did tell something
    assert (spread[:, 2] > 100**2).all()  # and not everything


@pytest.mark.parametrize("name", ["UKF", "mtSOF"])
@engines
def test_other_moments_are_swept_as_they_are_run(name, engine):
    prior, z, images, dynamics = flown()
    options = {"dynamics": dynamics, "z_per_step": True}
    wanted = run(FILTERS[name], prior, z, images, **options)
    got = sweep(FILTERS[name], prior, z, images, **options, engine=engine, progress=False).final
    assert_close(got, Gaussian(*(part[-1] for part in wanted)), 1e-6)


class Seen:
    """Four components of the error of a state of ten."""

    def __init__(self, H=np.eye(4, 9), R=np.eye(4)):
        self.H, self.R = H, R

    def h(self, x):
        return x[..., :4] * 1.0

    def jacobian(self, x):
        return self.H

    retract, difference = staticmethod(retract), staticmethod(difference)


STATE = Gaussian(np.concatenate([np.ones(6), normalized(np.ones(4))]), np.eye(9))
REFUSED = {
    "P: size": ({"prior": STATE._replace(cov=np.eye(6))}, "prior must hold a state"),
    "P: sign": ({"prior": STATE._replace(cov=-np.eye(9))}, "prior.cov must be symmetric positive"),
    "x: size": ({"prior": STATE._replace(mean=np.ones(9))}, "prior must hold a state"),
    "x: mask": (
        {"prior": STATE._replace(mean=np.ma.masked_less(STATE.mean, 0.6))},
        "prior.mean must have no mask",
    ),
    "H: columns": ({"model": Seen(H=np.eye(4, 10))}, r"prior.cov must have shape .*10, 10\)"),
    "H: rows": ({"model": Seen(H=np.ones((1, 9)))}, r"model.jacobian must return shape .*4, 9"),
    "R: a row": ({"model": Seen(R=np.ones(4))}, r"model.R must be an array .*found shape"),
    "R: a number": ({"model": Seen(R=0.1)}, "model.R must be an array"),
}


@pytest.mark.parametrize(("changes", "message"), REFUSED.values(), ids=REFUSED)
@pytest.mark.parametrize("go", [run, partial(sweep, progress=False)], ids=["run", "sweep"])
def test_what_is_wrong_is_named(go, changes, message):
    message = message.replace("prior", "priors?")
    given = {"prior": STATE, "model": Seen()}
    go(MEKF, given["prior"], np.zeros(4), given["model"], 1)
    given |= changes
    with pytest.raises(ValueError, match=message):
        go(MEKF, given["prior"], np.zeros(4), given["model"], 1)


IMAGE = {
    "a component too few": np.zeros(4),
    "infinite": np.array([0, 0, 0, np.inf, 0]),
}


@pytest.mark.parametrize("z", IMAGE.values(), ids=IMAGE)
def test_an_image_that_is_none_is_refused(z):
    prior, _, images, _ = flown()
    with pytest.raises(ValueError, match="z must "):
        run(MEKF, prior, z, images, 1)
