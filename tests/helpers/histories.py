"""Shared by tests of loop."""

import numpy as np

from navfilters import FILTERS, run
from navfilters.papers.perea2007.experiment import Setup, isotropic

BASE = Setup()
MODEL = BASE.model
EKF = FILTERS["EKF"]


def history(name="EKF", **changes):
    """The baseline of the paper with some arguments of run replaced."""
    arguments = {"prior": BASE.prior, "z": BASE.z, "model": MODEL, "steps": 5} | changes
    return run(FILTERS[name], **arguments)


PRIORS = isotropic(np.array([[20.0, 80.0], [60.0, -30.0], [-40.0, 10.0]]), [50.0, 60.0, 40.0])
NOISES = MODEL.R * np.array([1.0, 10.0, 1e3])[:, None, None]
