"""Every input that a run refuses, before any update."""

from functools import partial

import numpy as np
import pytest
from histories import BASE, EKF, MODEL, NOISES, PRIORS, history
from numpy.testing import assert_allclose

from navfilters import FILTERS, Filter, Gaussian, SigmaPoints, run
from navfilters.models import Linear, RangeBearing


def never(prior, z, model):
    raise AssertionError("the estimator was called before its inputs were checked")


def covariance(*rows):
    return Gaussian([20.0, 80.0], rows)


REFUSED = {
    # prior
    "prior: a tuple": ({"prior": ([0.0, 0.0], np.eye(2))}, "prior", "tuple", "Gaussian"),
    "prior: None": ({"prior": None}, "prior", "NoneType", "Gaussian"),
    "prior: an array": ({"prior": np.zeros(2)}, "prior", "ndarray", "Gaussian"),
    # mean
    "mean: a number": ({"prior": Gaussian(1.0, np.eye(2))}, "prior.mean", r"\(\)", r"\.\.\., n"),
    "mean: empty": ({"prior": Gaussian([], np.eye(2))}, "prior.mean", r"\(0,\)", r"\.\.\., n"),
    "mean: ragged": (
        {"prior": Gaussian([[1.0, 2.0], [3.0]], np.eye(2))},
        "prior.mean",
        "list",
        "real numbers",
    ),
    "mean: NaN": (
        {"prior": Gaussian([1.0, np.nan], np.eye(2))},
        "prior.mean",
        r"nan at index \(1,\)",
        "finite",
    ),
    "mean: infinite": (
        {"prior": Gaussian([-np.inf, 1.0], np.eye(2))},
        "prior.mean",
        r"-inf at index \(0,\)",
        "finite",
    ),
    "mean: complex": (
        {"prior": Gaussian([1j, 1.0], np.eye(2))},
        "prior.mean",
        "complex128",
        "real numbers",
    ),
    "mean: strings": (
        {"prior": Gaussian(["a", "b"], np.eye(2))},
        "prior.mean",
        "<U1",
        "real numbers",
    ),
    "mean: booleans": (
        {"prior": Gaussian([True, False], np.eye(2))},
        "prior.mean",
        "bool",
        "real numbers",
    ),
    "mean: None": ({"prior": Gaussian(None, np.eye(2))}, "prior.mean", "object", "real numbers"),
    "mean: one component": (
        {"prior": Gaussian([1.0], np.eye(1))},
        "prior.mean",
        r"\(1,\)",
        "a state of the model",
    ),
    "mean: three components": (
        {"prior": Gaussian([1.0, 2.0, 3.0], np.eye(3))},
        "prior.mean",
        r"\(3,\)",
        r"\.\.\., 2",
    ),
    "mean: not the linear model's": (
        {"prior": Gaussian([1.0, 2.0, 3.0], np.eye(3)), "model": Linear(np.eye(2), np.eye(2))},
        "prior.mean",
        r"\(3,\)",
        r"\.\.\., 2",
    ),
    # cov
    "cov: a vector": ({"prior": covariance(1.0, 2.0)}, "prior.cov", r"\(2,\)", r"\.\.\., n, n"),
    "cov: not square": (
        {"prior": covariance([1.0, 0.0, 0.0], [0.0, 1.0, 0.0])},
        "prior.cov",
        r"\(2, 3\)",
        r"\.\.\., 2, 2",
    ),
    "cov: another size": (
        {"prior": Gaussian([20.0, 80.0], np.eye(3))},
        "prior.cov",
        r"\(3, 3\)",
        r"\.\.\., 2, 2",
    ),
    "cov: NaN": (
        {"prior": covariance([1.0, 0.0], [0.0, np.nan])},
        "prior.cov",
        r"nan at index \(1, 1\)",
        "finite",
    ),
    "cov: infinite": (
        {"prior": covariance([np.inf, 0.0], [0.0, 1.0])},
        "prior.cov",
        r"inf at index \(0, 0\)",
        "finite",
    ),
    "cov: complex": ({"prior": covariance([1j, 0], [0, 1])}, "prior.cov", "complex128", "real"),
    "cov: asymmetric": (
        {"prior": covariance([2.0, 0.5], [0.0, 2.0])},
        "prior.cov",
        "difference of 0.5",
        "symmetric",
    ),
    "cov: indefinite": (
        {"prior": covariance([1.0, 2.0], [2.0, 1.0])},
        "prior.cov",
        r"eigenvalue (of )?-1",
        "positive semidefinite",
    ),
    "cov: negative": (
        {"prior": covariance([-1.0, 0.0], [0.0, 1.0])},
        "prior.cov",
        r"eigenvalue (of )?-1",
        "positive semidefinite",
    ),
    "cov: one bad member": (
        {"prior": Gaussian(np.ones((2, 2)), np.stack([np.eye(2), -np.eye(2)]))},
        "prior.cov",
        r"eigenvalue (of )?-1",
        "positive semidefinite",
    ),
    "cov: indefinite in small units": (
        {"prior": covariance([1e-20, 2e-10], [2e-10, 1.0])},
        "prior.cov",
        r"eigenvalue (of )?-",
        "positive semidefinite",
    ),
    # z
    "z: a number": ({"z": 1.0}, "z", r"\(\)", r"\.\.\., m"),
    "z: three components": ({"z": [1.0, 2.0, 3.0]}, "z", r"\(3,\)", "m = 2 as in model.R"),
    "z: one component": ({"z": np.ones((2, 1))}, "z", r"\(2, 1\)", "m = 2 as in model.R"),
    "z: infinite": (
        {"z": [[1.0, 2.0], [np.inf, 0]]},
        "z",
        r"inf at index \(1, 0\)",
        "NaN where it was not",
    ),
    "z: complex": ({"z": [1.0, 1j]}, "z", "complex128", "real numbers"),
    "z: strings": ({"z": ["1.0", "2.0"]}, "z", "<U3", "real numbers"),
    "z: ragged": ({"z": [[1.0, 2.0], [3.0]]}, "z", "list", "real numbers"),
    "z: None": ({"z": None}, "z", "object", "real numbers"),
    # z_per_step
    "z_per_step: too few": (
        {"z": np.ones((4, 2)), "z_per_step": True},
        "z",
        r"\(4, 2\)",
        r"steps, \.\.\., m.* 5 steps",
    ),
    "z_per_step: too many": (
        {"z": np.ones((6, 3, 2)), "z_per_step": True},
        "z",
        r"\(6, 3, 2\)",
        r"steps, \.\.\., m.* 5 steps",
    ),
    "z_per_step: steps last": (
        {"z": np.ones((3, 5, 2)), "z_per_step": True},
        "z",
        r"\(3, 5, 2\)",
        r"steps, \.\.\., m.* 5 steps",
    ),
    "z_per_step: one measurement": (
        {"z": np.ones(2), "z_per_step": True},
        "z",
        r"\(2,\)",
        r"steps, \.\.\., m",
    ),
    "z_per_step: wrong m": (
        {"z": np.ones((5, 3)), "z_per_step": True},
        "z",
        r"\(5, 3\)",
        "m = 2 as in model.R",
    ),
    # steps
    "steps: negative": ({"steps": -1}, "steps", "-1", "integer of at least 0"),
    "steps: a float": ({"steps": 5.0}, "steps", "5.0", "integer of at least 0"),
    "steps: a bool": ({"steps": True}, "steps", "True", "integer of at least 0"),
    "steps: a numpy bool": ({"steps": np.True_}, "steps", "True", "integer of at least 0"),
    "steps: a string": ({"steps": "5"}, "steps", "'5'", "integer of at least 0"),
    # batch axes
    "batch: prior against z": (
        {"prior": PRIORS, "z": np.ones((2, 2))},
        r"prior.mean \(3,\).*z \(2,\)",
        "prior.mean",
        "must broadcast",
    ),
    "batch: prior against R": (
        {"prior": PRIORS, "model": RangeBearing(NOISES[:2])},
        r"prior.mean \(3,\).*model.R \(2,\)",
        "model.R",
        "must broadcast",
    ),
    "batch: mean against cov": (
        {"prior": Gaussian(np.ones((3, 2)), np.stack([np.eye(2)] * 2))},
        r"prior.mean \(3,\).*prior.cov \(2,\)",
        "prior.cov",
        "must broadcast",
    ),
    "batch: varying z against prior": (
        {"prior": PRIORS, "z": np.ones((5, 2, 2)), "z_per_step": True},
        r"prior.mean \(3,\).*z \(2,\)",
        "z",
        "must broadcast",
    ),
    "batch: prior against H": (
        {"prior": PRIORS, "model": Linear(np.ones((2, 2, 2)), np.eye(2))},
        r"prior.mean \(3,\).*model.R \(2,\)",
        "model.R",
        "must broadcast",
    ),
}


@pytest.mark.parametrize(("changes", "argument", "found", "needed"), REFUSED.values(), ids=REFUSED)
def test_bad_input_is_refused_before_any_update(changes, argument, found, needed):
    """A ValueError names the argument, what was found and what is needed."""
    arguments = {"prior": BASE.prior, "z": BASE.z, "model": MODEL, "steps": 5} | changes
    with pytest.raises(ValueError, match=argument) as error:
        run(never, **arguments)
    assert error.match(f"found.*{found}")
    assert error.match(needed)


@pytest.mark.parametrize("estimator", ["EKF", None, {"name": "EKF"}, Filter])
def test_an_estimator_that_cannot_be_called_is_refused(estimator):
    with pytest.raises(TypeError, match=r"estimator must be a filter.*FILTERS.*callable.*found"):
        run(estimator, BASE.prior, BASE.z, MODEL)


def test_an_option_that_the_filter_lacks_is_refused():
    with pytest.raises(TypeError, match="unknown options"):
        run(partial(EKF, bump=1.0), BASE.prior, BASE.z, MODEL)


@pytest.mark.parametrize("cov", [np.zeros((2, 2)), np.ones((2, 2)), np.diag([0.0, 1.0])])
def test_a_semidefinite_prior_is_taken(cov):
    """Nothing is learnt about what is already known exactly."""
    got = history(prior=Gaussian([20.0, 80.0], cov), steps=1)
    null = np.linalg.eigh(cov)[1][:, 0]
    assert_allclose(null @ (got.mean[1] - got.mean[0]), 0.0, atol=1e-10)


def test_an_option_without_a_name_is_refused():
    """It was left out: the filter ran with its own sigma points."""
    with pytest.raises(TypeError, match=r"by name, as points=SigmaPoints\(\); found SigmaPoints"):
        run(partial(FILTERS["UKF"], SigmaPoints(0.5)), PRIORS, BASE.z, MODEL, 1)
