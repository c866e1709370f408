"""The lecture on the extended Kalman filter: a shaken pendulum."""

from navfilters.papers.lecture16.pendulum import Setup, band_limited_noise, discretised, sampled

__all__ = [
    "Setup",
    "band_limited_noise",
    "discretised",
    "sampled",
]
