"""The benchmarks' two problems in motion, the same numbers for whoever takes part, and our way.

- *orbit*: xiong2009's angles between two stars and the Earth, every 100 s of a coasting spacecraft.
- *images*: pogorelsky2020's radar images, one every 8.3 s, and a multiplicative EKF of nine states.

Each step of a series is a prediction over the interval, in ten steps of Runge-Kutta, and an update.
Measurements are perfect and the same for all members, whose first estimates differ. Nothing here
imports a peer: what a peer is told of a problem are its methods, for the estimate x of one member
about a reference quaternion q, into which the multiplicative EKF folds what it has learnt.
"""

from dataclasses import dataclass, replace

import numpy as np

from navfilters import Filter, Gaussian, sweep
from navfilters.estimators.multiplicative import MekfState, mekf_update
from navfilters.numerics.runge_kutta import runge_kutta
from navfilters.papers import pogorelsky2020, xiong2009
from navfilters.papers.pogorelsky2020.experiment import NOMINAL
from navfilters.space.earth_fixed_orbit import EarthFixedOrbit
from navfilters.space.frames import ellipsoid_intersection
from navfilters.space.image_measurement import Measurement, SarGeometry
from navfilters.space.inertial_orbit import Orbit
from navfilters.space.quaternions import from_rotation_vector, normalized, product, rotation_vector
from navfilters.space.star_earth_sensor import StarEarthSensor
from navfilters.types import Array

LONGEST = 90
"""Steps of a series: as long as the beam of the images, held in its direction, meets the Earth."""


@dataclass(frozen=True, eq=False)
class Coasting:
    """The orbit's problem: navfilters' orbit and sensor, with noise at the end of each interval.

    A peer's process noise is one constant matrix per prediction. So is it here for all, and the
    library's sum over sub-steps, which depends on the path, is left out.

    Parameters
    ----------
    orbit : Orbit
    sensor : StarEarthSensor
    Q : array (6, 6)
        Covariance of the noise of an interval: m^2, m^2/s^2.
    first : Gaussian
        The true state at the start, (6,), and the covariance of all first estimates, (6, 6).
    z : array (LONGEST, 2)
        The angles after each interval, rad.
    """

    orbit: Orbit
    sensor: StarEarthSensor
    Q: Array
    first: Gaussian
    z: Array

    def move(self, x: Array) -> Array:
        """The state an interval later, (..., 6)."""
        for _ in range(self.orbit.substeps):
            x = runge_kutta(self.orbit.derivative, x, self.orbit.step)
        return x

    def transition(self, x: Array) -> tuple[Array, Array]:
        """The same and its Jacobian, (..., 6) and (..., 6, 6); ours asks for it too."""
        interval = self.orbit.interval(x)
        return interval.path[-1], interval.F

    def h(self, x: Array, q: Array, z: Array) -> Array:
        """Expected angles, (2,)."""
        return self.sensor.h(x)

    def jacobian(self, x: Array, q: Array, z: Array) -> Array:
        """H, (2, 6)."""
        return self.sensor.jacobian(x)

    def noise(self, x: Array, q: Array, z: Array) -> Array:
        """R, (2, 2)."""
        return self.sensor.R

    def measured(self, z: Array) -> Array:
        """What h is compared with, (2,)."""
        return z

    def fold(self, x: Array, q: Array) -> tuple[Array, Array]:
        """Nothing here has a reference."""
        return x, q

    def unfold(self, x: Array, q: Array) -> Array:
        """The final mean, (6,)."""
        return x

    def ours(self, prior: Gaussian, z: Array, steps: int, engine: str) -> Gaussian:
        """This library, through its public function, checks of the input included."""
        return swept(Filter(), prior, z, self.sensor, steps, engine, dynamics=self)


@dataclass(frozen=True, eq=False)
class Images:
    """The images' problem: navfilters' Earth-fixed orbit and geometry of an image.

    The body keeps its first attitude in Earth-fixed axes, so that one geometry serves all images.
    A measurement z (5,) is the pixel's position and the slant range, m, and the speed, m/s.

    A peer estimates x (9,): position, velocity and the misalignment as a small rotation vector from
    q, which is zero whenever h is asked for. Of a peer's one matrix of process noise per prediction
    see ``Q``; ours and C add theirs at each of the ten steps.

    Parameters
    ----------
    orbit : EarthFixedOrbit
    steps : int
        Of an interval.
    geometry : SarGeometry
    Q : array (9, 9)
        Covariance of the noise of an interval, as it has spread along the true first one.
    first : Gaussian
        As for ``Coasting``: (9,) and (9, 9), m, m/s and rad.
    z : array (LONGEST, 5)
    """

    orbit: EarthFixedOrbit
    steps: int
    geometry: SarGeometry
    Q: Array
    first: Gaussian
    z: Array

    @property
    def R(self) -> Array:
        """Covariance of the noise of z, (5, 5), whose size a sweep asks for."""
        R = np.zeros((5, 5))
        R[:3, :3], R[3:, 3:] = self.geometry.D, self.geometry.R[2:, 2:]
        return R

    def move(self, x: Array) -> Array:
        """The state an interval later, (..., 9)."""
        xp = x.__array_namespace__()
        return xp.concat([self.orbit.path(x[..., :6], self.steps)[-1], x[..., 6:]], axis=-1)

    def transition(self, x: Array) -> tuple[Array, Array]:
        """The same and its Jacobian, (..., 9) and (..., 9, 9)."""
        xp = x.__array_namespace__()
        path = self.orbit.path(x[..., :6], self.steps)
        first, *others = self.orbit.transitions(path)
        for F in others:
            first = F @ first
        return xp.concat([path[-1], x[..., 6:]], axis=-1), first

    def h(self, x: Array, q: Array, z: Array) -> Array:
        """Expected ratios, slant range and speed, (4,), for a rotation vector of zero.

        The rotation is taken to first order, which is exact for h and its derivative there; the
        library's own has a square root of zero, that cannot be differentiated.
        """
        xp = x.__array_namespace__()
        small = xp.concat([x[6:] / 2, xp.ones_like(x[:1])])
        state = MekfState(x[:3], x[3:6], product(normalized(small), q), None)
        return self.geometry.h(state, z[:3])

    def jacobian(self, x: Array, q: Array | None = None, z: Array | None = None) -> Array:
        """H, (..., 4, 9); without q and z that of the nominal beam, whose size a sweep asks for."""
        q = NOMINAL if q is None else q
        state = MekfState(x[..., :3], x[..., 3:6], q, None)
        r_f = self.pixel(x) if z is None else z[..., :3]
        return self.geometry.jacobian(state, r_f)

    def noise(self, x: Array, q: Array, z: Array) -> Array:
        """R + B, (4, 4)."""
        H_f = self.geometry.pixel_jacobian(MekfState(x[:3], x[3:6], q, None), z[:3])
        return self.geometry.R + H_f @ self.geometry.D @ H_f.mT

    def measured(self, z: Array) -> Array:
        """What h is compared with, (4,): the boresight meets the pixel."""
        xp = z.__array_namespace__()
        return xp.concat([xp.zeros_like(z[:2]), z[3:]])

    def fold(self, x: Array, q: Array) -> tuple[Array, Array]:
        """The estimate about its own attitude: the rotation vector goes into q."""
        xp = x.__array_namespace__()
        q = normalized(product(from_rotation_vector(x[6:]), q))
        return xp.concat([x[:6], xp.zeros_like(x[6:])]), q

    def unfold(self, x: Array, q: Array) -> Array:
        """The final mean with the whole misalignment, (9,)."""
        xp = x.__array_namespace__()
        return xp.concat([x[:6], rotation_vector(q)])

    def pixel(self, x: Array) -> Array:
        """Where the nominal beam from x (..., 6 or 9) meets the Earth, (..., 3)."""
        return ellipsoid_intersection(x[..., :3], self.geometry.boresight(NOMINAL))

    def ours(self, prior: Gaussian, z: Array, steps: int, engine: str) -> Gaussian:
        """This library's own functions in a sweep, checks of the input included."""
        model = self.orbit, self
        return swept(Multiplicative(self.steps), prior, z, model, steps, engine).estimate


class Navigation(MekfState):
    """The library's state of the multiplicative EKF, as a sweep wants it."""

    @property
    def estimate(self) -> Gaussian:
        """Mean (..., 9), the misalignment as a rotation vector, and covariance."""
        xp = self.r.__array_namespace__()
        mean = xp.concat([self.r, self.v, rotation_vector(self.q_mu)], axis=-1)
        return Gaussian(mean, self.P)


@dataclass(frozen=True)
class Multiplicative:
    """The library's multiplicative EKF as a filter with a memory.

    Parameters
    ----------
    steps : int
        Of an interval.
    """

    steps: int

    def init(self, prior: Gaussian) -> Navigation:
        """The state before any image; mean (..., 9), cov (..., 9, 9)."""
        x = prior.mean
        return Navigation(x[..., :3], x[..., 3:6], from_rotation_vector(x[..., 6:]), prior.cov)

    def step(self, state: Navigation, z: Array, orbit: EarthFixedOrbit, images: Images):
        """One interval and one image; z (..., 5)."""
        xp = z.__array_namespace__()
        x, P = orbit.propagate(xp.concat([state.r, state.v], axis=-1), state.P, self.steps)
        state = MekfState(x[..., :3], x[..., 3:], state.q_mu, P)
        image = Measurement(z[..., :3], z[..., 3], z[..., 4])
        return Navigation(*mekf_update(state, image, images.geometry).state)


def swept(estimator, prior, z, model, steps, engine, dynamics):
    """The last estimate of a sweep on one core."""
    options = {"engine": engine, "dynamics": dynamics, "z_per_step": True, "workers": 1}
    options["progress"] = False
    return sweep(estimator, prior, z[:steps], model, steps, **options).final


def priors(problem: Coasting | Images, members: int) -> Gaussian:
    """First estimates about the truth: mean (members, n), and one cov (n, n) for all."""
    mean, cov = problem.first
    drawn = np.random.default_rng(0).standard_normal((members, len(mean)))
    return Gaussian(mean + drawn * np.sqrt(np.diag(cov)), cov)


def coasting() -> Coasting:
    """The experiment of xiong2009 without burns, in sub-steps of 10 s."""
    setup = xiong2009.Setup(burns=())
    Q = setup.interval * setup.orbit().Q  # its sub-steps are of a second
    orbit = Orbit(setup.gravity, step=10.0, substeps=setup.interval // 10)
    x, angles = setup.x0, []
    for _ in range(LONGEST):
        x = orbit.interval(x).path[-1]
        angles.append(setup.sensor.h(x))
    first = Gaussian(setup.x0, setup.prior.cov)
    return Coasting(orbit, setup.sensor, Q, first, np.array(angles))


def images() -> Images:
    """Test case 2 of pogorelsky2020, which is not underweighted."""
    setup = pogorelsky2020.CASES["TC-2"]
    flight = pogorelsky2020.truth(setup, LONGEST)
    geometry = replace(setup.geometry, T_e_b=flight.T_e_b[0])
    spread = setup.orbit.propagate(flight.x[0], np.zeros((9, 9)), setup.steps)[1]
    first = Gaussian(np.concatenate([flight.x[0], np.zeros(3)]), setup.P0)
    problem = Images(setup.orbit, setup.steps, geometry, spread, first, np.zeros((0, 5)))
    x = flight.x[1:]
    pixel = problem.pixel(x)
    slant_range = np.linalg.norm(pixel - x[:, :3], axis=-1)
    speed = np.linalg.norm(x[:, 3:], axis=-1)
    z = np.concatenate([pixel, slant_range[:, None], speed[:, None]], axis=-1)
    return replace(problem, z=z)


def in_deviations(got: Gaussian, wanted: Gaussian) -> Array:
    """Largest difference of a mean's component, in the deviations wanted, (members,)."""
    sigma = np.sqrt(np.diagonal(wanted.cov, axis1=-2, axis2=-1))
    return np.max(np.abs(got.mean - wanted.mean) / sigma, axis=-1)
