"""Space: frames, quaternions, gravity, orbits and what is measured in them."""

from navfilters.space.earth_fixed_navigation import EarthFixedNavigation
from navfilters.space.earth_fixed_orbit import EARTH_RATE, EarthFixedOrbit
from navfilters.space.frames import (
    FLATTENING,
    SEMI_MAJOR,
    antenna_axes,
    body_axes,
    east_north_up,
    ecef_to_geodetic,
    ellipsoid_intersection,
    enu_covariance,
    geodetic_to_ecef,
)
from navfilters.space.gravity import EARTH, Gravity
from navfilters.space.image_measurement import Measurement, SarGeometry
from navfilters.space.image_sensor import Pixel, SarPass
from navfilters.space.inertial_orbit import INTEGRATORS, Orbit
from navfilters.space.manoeuvring_orbit import ManoeuvringOrbit, manoeuvring
from navfilters.space.navigation_state import NavigationState
from navfilters.space.osculating_ellipse import perigee_apogee
from navfilters.space.pose import difference, retract
from navfilters.space.quaternions import (
    conjugate,
    cross_matrix,
    from_rotation_vector,
    matrix,
    normalized,
    product,
    rotation_vector,
)
from navfilters.space.star_earth_sensor import StarEarthSensor
from navfilters.space.thrust import COASTING, Thrust
from navfilters.space.zero_doppler import TimedMeasurement, ZeroDoppler

__all__ = [
    "COASTING",
    "EARTH",
    "EARTH_RATE",
    "FLATTENING",
    "INTEGRATORS",
    "SEMI_MAJOR",
    "EarthFixedNavigation",
    "EarthFixedOrbit",
    "Gravity",
    "ManoeuvringOrbit",
    "Measurement",
    "NavigationState",
    "Orbit",
    "Pixel",
    "SarGeometry",
    "SarPass",
    "StarEarthSensor",
    "Thrust",
    "TimedMeasurement",
    "ZeroDoppler",
    "antenna_axes",
    "body_axes",
    "conjugate",
    "cross_matrix",
    "difference",
    "east_north_up",
    "ecef_to_geodetic",
    "ellipsoid_intersection",
    "enu_covariance",
    "from_rotation_vector",
    "geodetic_to_ecef",
    "manoeuvring",
    "matrix",
    "normalized",
    "perigee_apogee",
    "product",
    "retract",
    "rotation_vector",
]
