"""Differences of a model's own are looked at before the first step, as its h is."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from polar_models import POLAR, PRIORS, Z, quiet

from navfilters import FILTERS, Gaussian, run
from navfilters.models import RangeBearing

ALONE = Gaussian(PRIORS.mean[0], PRIORS.cov)


def sensor(residual):
    return SimpleNamespace(R=POLAR.R, h=POLAR.h, jacobian=POLAR.jacobian, residual=residual)


def wrapped(y):
    return (y + np.pi) % (2 * np.pi) - np.pi


def as_in_a_filter_of_one_state(z, z_hat):
    y = z - z_hat
    y[1] = wrapped(y[1])  # of sigma points, and of a batch, the second one
    return y


def in_degrees(z, z_hat):
    y = z - z_hat
    y[1] = (y[1] + 180) % 360 - 180
    return y


def in_place(z, z_hat):
    z -= z_hat
    return z


RESIDUALS = {
    "the second member": (
        as_in_a_filter_of_one_state,
        r"model\.residual must give a state in a bat",
    ),
    "in degrees": (in_degrees, r"model\.residual must give a state in a batch what"),
    "in place": (in_place, r"model\.residual must not change its arguments"),
    "an axis less": (
        lambda z, z_hat: (z - z_hat)[..., 0],
        r"model\.residual must return shape \(.*2",
    ),
    "shapes alike": (
        lambda z, z_hat: np.array([z[0] - z_hat[0], 0.0]),
        r"model\.residual must retu",
    ),
}


@pytest.mark.parametrize("prior", [ALONE, PRIORS], ids=["one", "batch"])
@pytest.mark.parametrize(("residual", "message"), RESIDUALS.values(), ids=RESIDUALS)
@pytest.mark.parametrize("go", [run, quiet])
def test_a_residual_that_mixes_members_is_refused(go, residual, message, prior):
    """It was believed: a UKF with the y[1] of a filter of one state went elsewhere in silence."""
    z = Z.copy()
    with pytest.raises(ValueError, match=message):
        go(FILTERS["UKF"], prior, z, sensor(residual), 2)
    assert_array_equal(z, Z)


def test_a_residual_that_is_right_is_taken():
    def residual(z, z_hat):
        y = z - z_hat
        y[..., 1] = wrapped(y[..., 1])
        return y

    for prior in (ALONE, PRIORS):
        got = run(FILTERS["UKF"], prior, Z, sensor(residual), 2)
        np.testing.assert_allclose(got.mean, run(FILTERS["UKF"], prior, Z, POLAR, 2).mean)


def test_batch_axes_of_the_model_are_its_own():
    R = POLAR.R * np.arange(1.0, 6.0)[:, None, None]
    found = run(FILTERS["UKF"], ALONE, Z, RangeBearing(R), 2)
    assert found.mean.shape == (3, 5, 2)


def moves_in_place(x, dx):
    x += dx
    return x


def first_member_only(x, dx):
    return x + dx[:1]


def away(x, y):
    return x - y


@pytest.mark.parametrize("part", ["model", "dynamics"])
@pytest.mark.parametrize(
    ("retract", "difference", "message"),
    [
        (moves_in_place, away, r"retract must not change its arguments"),
        (first_member_only, away, r"retract must (give a state|return shape)"),
        (lambda x, dx: x + dx, lambda x, y: (x - y)[..., :1], r"difference must return shape"),
    ],
)
def test_a_state_of_its_own_is_looked_at_too(part, retract, difference, message):
    own = {"retract": retract, "difference": difference}
    model = SimpleNamespace(R=POLAR.R, h=POLAR.h, **(own if part == "model" else {}))
    moving = SimpleNamespace(Q=np.eye(2), f=lambda x: x, **(own if part == "dynamics" else {}))
    with pytest.raises(ValueError, match=f"{part}.{message}|model.{message}"):
        run(FILTERS["UKF"], ALONE, Z, model, 1, dynamics=moving)


def test_a_class_is_no_model():
    class Still:
        Q = np.eye(2)

        def f(self, x):
            return x

    class Sensor:
        R = POLAR.R
        h = staticmethod(POLAR.h)

    for go in (run, quiet):
        with pytest.raises(
            TypeError, match=r"model must be an object.*as Sensor\(\); found the cl"
        ):
            go(FILTERS["UKF"], ALONE, Z, Sensor, 1)
        with pytest.raises(TypeError, match=r"dynamics must be an object.*as Still\(\)"):
            go(FILTERS["UKF"], ALONE, Z, POLAR, 1, dynamics=Still)
