"""How much a filter learns that is not so, by adding sharp ranges in directions that turn."""

from typing import Any

import numpy as np

from navfilters.types import Array


def false_information(
    r: Any, sigma: Any, sigma_r: Any, sigma_theta: Any, updates: Any, first: Any = 1
) -> Array:
    """Root of the ratio of false to true information about the bearing, kappa.

    A sharp range tells something false about the bearing as soon as it is linearised in several
    directions. This is how much, in the mean, if the estimates go where the measurements lead.

    Parameters
    ----------
    r : array (...)
        Distance from the sensor, units.
    sigma : array (...)
        Deviation of the first estimate across the line of sight, units; may be infinite.
    sigma_r, sigma_theta : array (...)
        Deviations of the noises, units and rad.
    updates : int array (...)
        n.
    first : int array (...)
        The update after which the range is believed.

    Returns
    -------
    array (...)
        kappa^2 = s_n^2 sum_k (s_k^2 - s_n^2) / (r sigma_r)^2, k from ``first`` to n - 1, where
        1 / s_k^2 = 1 / sigma^2 + k / (r sigma_theta)^2.
    """
    given = (r, sigma, sigma_r, sigma_theta, updates, first)
    r, sigma, sigma_r, sigma_theta, n, first = np.broadcast_arrays(*given)
    k = np.arange(int(np.max(n))).reshape(-1, *(1,) * n.ndim)
    across, from_start = (r * sigma_theta) ** 2, 1.0 / np.asarray(sigma, float) ** 2
    with np.errstate(divide="ignore"):  # without a prior there is no s_0
        s2 = 1 / (from_start + k / across)
    end = 1 / (from_start + n / across)
    moved = np.where((first <= k) & (k < n), s2 - end, 0.0)
    return np.sqrt(end * np.sum(moved, axis=0)) / (r * sigma_r)
