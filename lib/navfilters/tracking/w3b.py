"""Eutelsat W3B in its transfer orbit, 2 November 2010, while it was losing propellant."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from navfilters.numerics.extras import needed
from navfilters.tracking.files import (
    Observations,
    Settings,
    read_coefficients,
    read_observations,
    read_settings,
)
from navfilters.tracking.forces import Forces
from navfilters.tracking.harmonics import Harmonics
from navfilters.tracking.least_squares import MOTION, OrbitProblem
from navfilters.tracking.sky import sky
from navfilters.tracking.stations import sites

FOLDER = Path(__file__).parent / "data" / "w3b"
"""Measurements, settings and gravity, with their licence and notice."""

MASS = 5370.0
"""kg; the settings file has it in a comment."""


ANGLES = ("azimuth", "elevation")


@dataclass(frozen=True, eq=False)
class Flight:
    """What the files say.

    Parameters
    ----------
    settings : Settings
    observations : Observations
    problem : OrbitProblem
        With gravity to the wanted degree, Sun, Moon and light.
    start : array (n,)
        The file's first state, in the axes of the sky; its drag; no leak; its biases, that of the
        transponder included in each range's.
    to_mean_equator : array (3, 3)
        From the axes of the sky to the mean equator and equinox of J2000, which the settings use.
    """

    settings: Settings
    observations: Observations
    problem: OrbitProblem
    start: np.ndarray
    to_mean_equator: np.ndarray


def earth_field(degree: int) -> Harmonics:
    """EGM96.

    Parameters
    ----------
    degree : int
        The last, with all orders; the file goes to 21.

    Returns
    -------
    Harmonics
    """
    return Harmonics(*read_coefficients(FOLDER / "EGM96-truncated-21x21", degree))


def flight(degree: int = 8) -> Flight:
    """The flight as its files have it.

    Parameters
    ----------
    degree : int
        Of the gravity field, with all orders; the file goes to 21.

    Returns
    -------
    Flight

    Raises
    ------
    ImportError
        astropy is not installed.
    ValueError
        A file that cannot be read.
    """
    erfa = needed("erfa", "navfilters[flight]", "a real orbit")
    settings = read_settings(FOLDER / "od_test_W3.in")
    epoch = settings.date("orbit.date")
    station = "ground.station."
    names = tuple(
        settings.text(station + "name", i) for i in range(settings.count(station + "name"))
    )
    observations = read_observations(FOLDER / "W3B.aer", names, epoch)
    places = np.stack(
        [
            np.radians(settings.numbers(station + "latitude")),
            np.radians(settings.numbers(station + "longitude")),
            settings.numbers(station + "altitude"),
        ],
        axis=-1,
    )
    above = sky(epoch, observations.time[-1])
    light = settings.number("solar.radiation.pressure.cr") * settings.number(
        "solar.radiation.pressure.area"
    )
    problem = OrbitProblem(
        Forces(earth_field(degree), above, radiation=light / MASS),
        observations,
        sites(places, observations.station, observations.time, above),
        np.array(
            [
                settings.number(station + "range.sigma", 0),
                *np.radians([settings.number(station + f"{a}.sigma", 0) for a in ANGLES]),
            ]
        ),
    )
    to_mean_equator = erfa.bp06(2451545.0, 0.0)[0]
    start = np.zeros(problem.size)
    start[:6] = [
        settings.number(f"orbit.cartesian.{c}") for c in ("px", "py", "pz", "vx", "vy", "vz")
    ]
    start[:6] = (start[:6].reshape(2, 3) @ to_mean_equator).ravel()
    start[6] = settings.number("drag.cd") * settings.number("drag.area") / MASS
    biases = [settings.numbers(station + "range.bias") + settings.number("onboard.range.bias")]
    biases += [np.radians(settings.numbers(station + f"{angle}.bias")) for angle in ANGLES]
    start[MOTION:] = np.stack(biases, axis=-1).ravel()
    return Flight(settings, observations, problem, start, to_mean_equator)
