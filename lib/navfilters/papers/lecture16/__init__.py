"""The lecture on the extended Kalman filter: a shaken pendulum."""

from navfilters.papers.lecture16.noise import band_limited_noise
from navfilters.papers.lecture16.pendulum import Setup, experiments
from navfilters.papers.lecture16.sampling import discretised, sampled

__all__ = [
    "Setup",
    "band_limited_noise",
    "discretised",
    "experiments",
    "sampled",
]
