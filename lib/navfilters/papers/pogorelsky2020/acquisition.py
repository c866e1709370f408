"""An image acquired from where the spacecraft is."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from navfilters.numerics import validation
from navfilters.papers.pogorelsky2020.experiment import NOMINAL, Setup
from navfilters.papers.pogorelsky2020.imaging import FULL, Acquisition, Imaging, same_images
from navfilters.papers.pogorelsky2020.true_flight import truth
from navfilters.sar.ground.scene import View, draw_scene
from navfilters.sar.ground.terrain import LocalMap, sample_terrain, terrain_hit
from navfilters.sar.images.autofocusing import Climb, autofocus
from navfilters.sar.images.focuser import Focuser
from navfilters.sar.images.ground_image import to_ground
from navfilters.sar.matching.geolocation import Match, geolocate
from navfilters.sar.matching.reference import form_reference
from navfilters.sar.raw.flight import Flight, view_of
from navfilters.sar.raw.observation import observe
from navfilters.space.frames import ecef_to_geodetic, ellipsoid_intersection, geodetic_to_ecef


def acquire(setup: Setup, k: int, imaging: Imaging = FULL) -> Acquisition:
    """Simulate one image: scene, raw data, reference.

    Parameters
    ----------
    setup : Setup
    k : int
        From 1: the image after interval k.
    imaging : Imaging

    Returns
    -------
    Acquisition
        Simulated once for all set-ups that have the same truth, if it is one of the last three.

    References
    ----------
    pogorelsky2020, section "Closed-loop trajectory and SAR data".
    """
    return _acquire(same_images(setup), validation.whole_number("k", k, 1), imaging)


@lru_cache(maxsize=3)
def _acquire(setup: Setup, k: int, imaging: Imaging) -> Acquisition:
    known, orbit = truth(setup, k), setup.orbit
    x = known.x[k]
    beam = replace(setup.geometry, T_e_b=known.T_e_b[k]).boresight(NOMINAL)
    radar = imaging.radar
    distance = np.linalg.norm(ellipsoid_intersection(x[:3], beam) - x[:3])
    lit = radar.wavelength / radar.antenna * distance / np.linalg.norm(x[3:])
    span = float(lit + imaging.lines / radar.prf)
    flight = Flight.through(orbit.derivative, x, max(span, 1.0))
    place = ecef_to_geodetic(ellipsoid_intersection(x[:3], beam))
    terrain = sample_terrain(
        float(place[0]) + imaging.moved[0],
        float(place[1]) + imaging.moved[1],
        quarter_turns=(k - 1) // 2 % 4,
        mirrored=(k - 1) % 2 == 1,
    )
    latitude, longitude, _ = (
        float(a) for a in ecef_to_geodetic(terrain_hit(terrain.height, x[:3], beam))
    )
    scene = draw_scene(
        terrain,
        LocalMap(latitude, longitude),
        [imaging.seed, k, 0],
        half_width=imaging.half_width + 3000.0,  # relief and the reference's corners
    )
    r_f = geodetic_to_ecef(latitude, longitude, scene.height(0.0, 0.0))
    raw = observe(
        radar,
        flight,
        scene,
        lines=imaging.lines,
        samples=imaging.samples,
        speckle=[imaging.seed, k, 1],
    )
    focuser = Focuser(
        raw, lines=imaging.lines, samples=imaging.samples, bandwidth=imaging.bandwidth
    )
    view = view_of(flight, r_f)
    other = View(
        view.heading + np.deg2rad(imaging.heading),
        view.incidence + np.deg2rad(imaging.incidence),
        np.inf,
    )
    reference = form_reference(
        scene,
        other,
        half_width=imaging.half_width,
        pixel=imaging.pixel,
        speckle=[imaging.seed, k, 2],
        matcher=imaging.matcher,
    )
    return Acquisition.of(flight, orbit.acceleration, scene, focuser, reference)


def _locate(acquired: Acquisition, speed: float, imaging: Imaging) -> Match:
    image = acquired.focuser.image(acquired.effective(speed), acquired.slope)
    ground = to_ground(
        image,
        incidence=acquired.incidence,
        ground_speed=acquired.ground_speed,
        looks=imaging.looks,
        pixel=imaging.pixel,
    )
    return geolocate(ground, acquired.reference, relief=imaging.relief)


def measure_directly(
    acquired: Acquisition, start: float, imaging: Imaging = FULL
) -> tuple[Climb, Match | None]:
    """Focus and match one run's image, without the table.

    Parameters
    ----------
    acquired : Acquisition
    start : float
        In-track velocity that the run predicts, m/s.
    imaging : Imaging

    Returns
    -------
    climb : Climb
    match : Match or None
        None if the climb found no peak.
    """
    limits = (acquired.speed - imaging.reach, acquired.speed + imaging.reach)
    climb = autofocus(
        acquired.climber,
        start,
        acquired.effective,
        steps=imaging.steps,
        limits=limits,
        slope=acquired.slope,
    )
    return climb, (_locate(acquired, climb.speed, imaging) if climb.ended == "peak" else None)
