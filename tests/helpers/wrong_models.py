"""Models with one function that is wrong, each in its own way."""

import numpy as np

from navfilters import Gaussian
from navfilters.models import RangeBearing

RIGHT = RangeBearing(np.diag([0.04, 1e-4]))
Z = np.array([50.2, 0.92])
PRIORS = Gaussian(np.array([[28.0, 41.0], [31.0, 38.0], [33.0, 42.0]]), 4 * np.eye(2))
ALONE = Gaussian(PRIORS.mean[0], PRIORS.cov)
PAIR = Gaussian(PRIORS.mean[:2], PRIORS.cov)  # as many members as measurements
BATCHES = {"one": ALONE, "as many as measurements": PAIR, "three": PRIORS}


class Model:
    """The right one, but for what is given."""

    def __init__(self, **changed):
        self.__dict__.update({"R": RIGHT.R, "h": RIGHT.h, "jacobian": RIGHT.jacobian})
        self.__dict__.update({"hessian": RIGHT.hessian} | changed)


def mixed_norm(x):
    return np.stack([np.linalg.norm(x) + 0 * x[..., 0], np.arctan2(x[..., 1], x[..., 0])], -1)


WRONG = {
    "h: components first": {"h": lambda x: np.moveaxis(RIGHT.h(x), -1, 0)},
    "h: one of two": {"h": lambda x: RIGHT.h(x)[..., :1]},
    "h: no axis for the component": {"h": lambda x: RIGHT.h(x)[..., 0]},
    "h: one too many": {"h": lambda x: np.concatenate([RIGHT.h(x), x[..., :1]], -1)},
    "h: columns": {"h": lambda x: RIGHT.h(x)[..., None]},
    "h: of the first member": {"h": lambda x: RIGHT.h(x.reshape(-1, 2)[0])},
    "h: norm of the whole batch": {"h": mixed_norm},
    "h: a list": {"h": lambda x: [*RIGHT.h(x), [1.0]]},
    "h: complex": {"h": lambda x: RIGHT.h(x) + 0j},
    "h: single precision": {"h": lambda x: RIGHT.h(x).astype(np.float32)},
    "h: in place": {"h": lambda x: np.subtract(x, 1.0, out=x)},
    "h: fails": {"h": lambda x: x @ np.ones(3)},
    "jacobian: transposed axes": {"jacobian": lambda x: np.moveaxis(RIGHT.jacobian(x), -1, 0)},
    "jacobian: a row": {"jacobian": lambda x: RIGHT.jacobian(x)[..., :1, :]},
    "jacobian: a gradient": {"jacobian": lambda x: RIGHT.jacobian(x)[..., 0, :]},
    "jacobian: a row too many": {"jacobian": lambda x: np.ones((*x.shape[:-1], 3, 2))},
    "jacobian: of the first member": {"jacobian": lambda x: RIGHT.jacobian(x.reshape(-1, 2)[0])},
    "jacobian: of the mean": {"jacobian": lambda x: RIGHT.jacobian(np.mean(x.reshape(-1, 2), 0))},
    "hessian: one of two": {"hessian": lambda x: RIGHT.hessian(x)[..., :1, :, :]},
    "hessian: no components": {"hessian": lambda x: RIGHT.hessian(x)[..., 0, :, :]},
    "hessian: of the first": {"hessian": lambda x: RIGHT.hessian(x.reshape(-1, 2)[0])},
    "R: deviations": {"R": np.array([0.2, 0.01])},
    "R: a number": {"R": 0.04},
    "R: of three": {"R": np.eye(3)},
    "R: a row": {"R": np.array([[0.04, 1e-4]])},
    "R: asymmetric": {"R": np.array([[1.0, 0.5], [0.0, 1.0]])},
    "R: negative": {"R": np.diag([-1.0, 1.0])},
    "R: of four members": {"R": np.stack([RIGHT.R] * 4)},
    "R: NaN": {"R": np.diag([np.nan, 1.0])},
}
