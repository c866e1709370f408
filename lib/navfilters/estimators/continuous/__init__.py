"""Kalman-Bucy filters: the EKF of the protocol in the limit of small steps."""

from navfilters.estimators.continuous.integration import Trajectory
from navfilters.estimators.continuous.kalman_bucy import (
    extended_kalman_bucy,
    linearized_kalman_bucy,
)
from navfilters.estimators.continuous.reference import reference_residual
from navfilters.estimators.continuous.system import ContinuousSystem, Reference, Signal

__all__ = [
    "ContinuousSystem",
    "Reference",
    "Signal",
    "Trajectory",
    "extended_kalman_bucy",
    "linearized_kalman_bucy",
    "reference_residual",
]
