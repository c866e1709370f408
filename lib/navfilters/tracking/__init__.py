"""A real satellite by its stations: files, sky, forces, measurements, a batch solution, filters."""

from navfilters.tracking.files import (
    Observations,
    Settings,
    read_coefficients,
    read_observations,
    read_settings,
)
from navfilters.tracking.forces import Forces, density
from navfilters.tracking.harmonics import Harmonics
from navfilters.tracking.least_squares import (
    DRAG,
    LEAK,
    LEAK_RATE,
    MOTION,
    OrbitProblem,
    Solution,
    solve,
)
from navfilters.tracking.orbit import orbit
from navfilters.tracking.sequential import Sequence, sequence, state_of
from navfilters.tracking.sky import Sky, geodetic, sky
from navfilters.tracking.stations import Sites, delay, observe, refraction, sites
from navfilters.tracking.trials import STARTS, Kept, Trial, trial
from navfilters.tracking.w3b import Flight, earth_field, flight

__all__ = [
    "DRAG",
    "LEAK",
    "LEAK_RATE",
    "MOTION",
    "STARTS",
    "Flight",
    "Forces",
    "Harmonics",
    "Kept",
    "Observations",
    "OrbitProblem",
    "Sequence",
    "Settings",
    "Sites",
    "Sky",
    "Solution",
    "Trial",
    "delay",
    "density",
    "earth_field",
    "flight",
    "geodetic",
    "observe",
    "orbit",
    "read_coefficients",
    "read_observations",
    "read_settings",
    "refraction",
    "sequence",
    "sites",
    "sky",
    "solve",
    "state_of",
    "trial",
]
