"""The flight that a PALSAR product recorded."""

from dataclasses import replace

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.polynomial import polyvander

from navfilters.papers.pogorelsky2020.closed_loop import UPDATES
from navfilters.papers.pogorelsky2020.experiment import Setup
from navfilters.papers.pogorelsky2020.imaging import Imaging
from navfilters.sar.palsar.product import Product
from navfilters.sar.raw.flight import Flight
from navfilters.types import Array

MISSING = 0.1
"""A patch in which more than this share of the lines is missing is not used."""


def flight_through(product: Product, epoch: float) -> Flight:
    """The polynomial through the six state vectors that are nearest, and through their velocities.

    Parameters
    ----------
    product : Product
    epoch : float
        UTC seconds of the product's day; the flight's own time starts there.

    Returns
    -------
    Flight
        Of degree 11. Through vectors of a low orbit 60 s apart it is good to 10 micrometres and
        1 micrometre a second; a cubic through two of them, to 0.3 m.
    """
    vectors = product.state_vectors
    near = np.argsort(np.abs(vectors.times - epoch))[:6]
    times = vectors.times[near] - epoch
    scale = np.abs(times).max()
    degree = 2 * len(near) - 1
    values = polyvander(times / scale, degree)
    slopes = np.zeros_like(values)
    slopes[:, 1:] = values[:, :-1] * np.arange(1, degree + 1) / scale
    middle = vectors.positions[near[0]]  # the polynomial's digits are for what changes
    rows = np.concatenate([vectors.positions[near] - middle, vectors.velocities[near]])
    solved = np.linalg.solve(np.concatenate([values, slopes]), rows)
    solved[0] += middle
    x, y, z = (Polynomial(solved[:, i], domain=[-scale, scale]) for i in range(3))
    return Flight((x, y, z))


def first_lines(missing: Array, window: int, step: int, most: int = UPDATES) -> Array:
    """Where patches start: as many as fit, with the fewest missing lines, nearest to the middle.

    Parameters
    ----------
    missing : array (lines,) of bool
    window : int
        Lines that each patch needs.
    step : int
        Lines between the starts.
    most : int
        Patches.

    Returns
    -------
    ndarray (n,) of int
        At least one.

    Raises
    ------
    ValueError
        Too few lines for a single patch, missing ones counted.
    """
    before = np.concatenate([[0], np.cumsum(missing)])
    for n in range(most, 0, -1):
        free = len(missing) - window - (n - 1) * step
        if free < 0:
            continue
        starts = np.arange(free + 1)[:, None] + step * np.arange(n)
        lost = (before[starts + window] - before[starts]).max(axis=1)
        best = np.lexsort([np.abs(starts[:, 0] - free / 2), lost])[0]
        if lost[best] <= MISSING * window:
            return starts[best]
    raise ValueError(
        f"product must have {window} lines in a row, at most {100 * MISSING:.0f} % of them "
        f"missing, to focus a patch; found {len(missing)} lines, {before[-1]} of them missing"
    )


def fitted(imaging: Imaging, product: Product) -> Imaging:
    """Images of the same ground and resolution cell, whatever the product's sampling rate.

    Parameters
    ----------
    imaging : Imaging
        For its radar's sampling rate.
    product : Product

    Returns
    -------
    Imaging
        The same for that rate. At 16 MHz (a band of 14 MHz, as in FBD) a sample is twice as long as
        at 32 MHz: half as many samples, and half as many looks in range.

    Raises
    ------
    ValueError
        A rate at which no whole number of looks makes the same cell.
    """
    rate = imaging.radar.sampling
    azimuth, looks = imaging.looks
    fewer = product.sampling_rate / rate
    if abs(fewer - 1) < 1e-3:
        return imaging
    if round(looks * fewer) < 1 or abs(round(looks * fewer) / (looks * fewer) - 1) > 0.1:
        raise ValueError(
            f"product must be sampled such that {looks} looks in range at {1e-6 * rate:g} MHz are "
            f"a whole number; found {1e-6 * product.sampling_rate:g} MHz in {product.leader}"
        )
    return replace(
        imaging,
        radar=replace(
            imaging.radar,
            sampling=product.sampling_rate,
            bandwidth=abs(product.chirp_rate) * product.pulse_length,
        ),
        looks=(azimuth, round(looks * fewer)),
        samples=round(imaging.samples * fewer),
    )


def lines_between(product: Product, setup: Setup) -> int:
    """The filter's interval.

    Parameters
    ----------
    product : Product
    setup : Setup

    Returns
    -------
    int
        Lines.
    """
    return round(setup.interval * product.prf)
