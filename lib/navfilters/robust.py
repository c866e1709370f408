"""The EKF and its robust and adaptive relatives: covariance rules in front of the same update.

    P = F P F^T + Q   --rule-->   Sigma   --linearized, kalman_update-->   estimate

A filter is a frozen set of tuning parameters with ``init(prior) -> state`` and
``step(state, z, dynamics, sensor) -> state``; the state is a named tuple of the estimate, the
filter's memory and its counters. Everything is batched over members, and every tuning parameter
that is a real number may be an array (...), one value per member. Parameters are checked when a
filter is made; of priors, models and measurements only the kind and the trailing axes are: a member
that fails is NaN, alone.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, Protocol

import numpy as np

from navfilters import validation
from navfilters.filters import kalman_update
from navfilters.linalg import is_positive_definite, right_divide
from navfilters.moments import linearized
from navfilters.types import Array, Gaussian, MeasurementModel


class Dynamics(Protocol):
    """x_t = f(x_{t-1}) + w with w ~ N(0, Q).

    Dynamics that adds Q at each of several sub-steps has one more method, ``accumulate(Q, x)``: the
    noise (..., n, n) of the whole transition from x, given that of one sub-step.
    """

    @property
    def Q(self) -> Array:
        """Process noise covariance, (..., n, n): of a transition, or of one of its sub-steps."""

    def transition(self, x: Array) -> tuple[Array, Array]:
        """f(x), (..., n), and its Jacobian F = df/dx, (..., n, n)."""


def predict(estimate: Gaussian, dynamics: Dynamics) -> Gaussian:
    """The state one transition later.

    x_{t|t-1} = f(x),   P_{t|t-1} = F P F^T + Q

    Parameters
    ----------
    estimate : Gaussian
        mean (..., n), cov (..., n, n).
    dynamics : Dynamics

    Returns
    -------
    Gaussian

    References
    ----------
    xiong2009, Eqs. (3) and (4).
    """
    x, F = _moved(estimate, dynamics)
    return Gaussian(x, _spread(estimate, F, dynamics, _noise(estimate, dynamics)))


def _moved(estimate: Gaussian, dynamics: Dynamics) -> tuple[Array, Array]:
    """The transition, of arrays with the axes that it must have."""
    x, F = dynamics.transition(estimate.mean)
    n = estimate.mean.shape[-1]
    validation.core("f(x) of dynamics.transition", x, (n,))
    return x, validation.core("F of dynamics.transition", F, (n, n))


def _noise(estimate: Gaussian, dynamics: Dynamics) -> Array:
    """Q, if it is a matrix: a vector or a number would be added to every row."""
    Q = validation.given("dynamics.Q", dynamics.Q)
    return validation.core("dynamics.Q", Q, estimate.mean.shape[-1:] * 2)


def _spread(estimate: Gaussian, F: Array, dynamics: Dynamics, Q: Array) -> Array:
    """Eq. (4), its rounding made symmetric."""
    accumulate = getattr(dynamics, "accumulate", None)
    if accumulate is not None:
        Q = accumulate(Q, estimate.mean)
        validation.core("dynamics.accumulate", Q, estimate.mean.shape[-1:] * 2)
    P = F @ estimate.cov @ F.mT + Q
    return (P + P.mT) / 2


def _update(prior: Gaussian, z: Array, sensor: MeasurementModel) -> Gaussian:
    """Eqs. (6)-(9). Eq. (9) is P - K P_xz^T by the inversion lemma, and needs no inverse."""
    return kalman_update(prior, z, linearized(prior, sensor))


class KalmanState(NamedTuple):
    """What the EKF remembers.

    Parameters
    ----------
    estimate : Gaussian
        mean (..., n), cov (..., n, n), after the last update.
    """

    estimate: Gaussian


@dataclass(frozen=True)
class ExtendedKalman:
    """The extended Kalman filter, Sigma = P.

    References
    ----------
    xiong2009, section 5: Eqs. (3), (4), (6)-(9) with Sigma_{t|t-1} = P_{t|t-1}.
    """

    def init(self, prior: Gaussian) -> KalmanState:
        """The state before any measurement.

        Parameters
        ----------
        prior : Gaussian
            mean (..., n), cov (..., n, n).

        Returns
        -------
        KalmanState
        """
        return KalmanState(_given(prior))

    def step(
        self, state: KalmanState, z: Array, dynamics: Dynamics, sensor: MeasurementModel
    ) -> KalmanState:
        """One prediction and one update.

        Parameters
        ----------
        state : KalmanState
        z : array (..., m)
            The measurement.
        dynamics : Dynamics
        sensor : MeasurementModel

        Returns
        -------
        KalmanState
        """
        return KalmanState(_update(predict(state.estimate, dynamics), z, sensor))


class RobustState(NamedTuple):
    """What the REKF remembers.

    Parameters
    ----------
    estimate : Gaussian
        mean (..., n), cov (..., n, n), after the last update.
    violations : int array (...)
        Steps so far at which gamma violated Eq. (23).
    """

    estimate: Gaussian
    violations: Array


@dataclass(frozen=True, eq=False)
class RobustEKF:
    """The robust (H-infinity) extended Kalman filter with L = I.

    Sigma = (P^-1 - gamma^-2 I)^-1,   if gamma > sqrt(max eig P)

    Parameters
    ----------
    gamma : float or array (...)
        Attenuation level, positive, in the state's units; as it grows the filter becomes the EKF,
        and at infinity it is the EKF.
    on_violation : {"skip", "nan", "raise"}
        What happens to a member whose gamma violates Eq. (23) at a step: Eq. (5) is not applied
        there (Sigma = P), the member ends, or the whole step is refused (on the host only).
        Violations are counted in the state.

    Raises
    ------
    ValueError
        A gamma that is not positive or an unknown on_violation; from ``step``, with "raise", when
        gamma violates Eq. (23), naming the smallest admissible gamma at that step.

    Notes
    -----
    Computed as P + P (gamma^2 I - P)^-1 P, which is the same matrix and keeps P's digits when gamma
    is large; Eq. (23) is tested by a Cholesky factor of gamma^2 I - P. The text finds gamma = 8000
    large enough for the whole of its run; that depends on the run. L = I adds a variance in square
    metres to one in square metres per square second: gamma is one number for both.

    References
    ----------
    xiong2009, Eqs. (3)-(9), (23).
    """

    gamma: Array = 8000.0
    on_violation: Literal["skip", "nan", "raise"] = "skip"

    def __post_init__(self) -> None:
        if not (validation.real_array("gamma", self.gamma, "", finite=False) > 0).all():
            raise ValueError(f"gamma must be positive; found {self.gamma}")
        if self.on_violation not in ("skip", "nan", "raise"):
            raise ValueError(
                f"on_violation must be 'skip', 'nan' or 'raise'; found {self.on_violation!r}"
            )

    def init(self, prior: Gaussian) -> RobustState:
        """The state before any measurement; as :meth:`ExtendedKalman.init`."""
        prior = _given(prior)
        return RobustState(prior, _zeros(prior))

    def step(
        self, state: RobustState, z: Array, dynamics: Dynamics, sensor: MeasurementModel
    ) -> RobustState:
        """One prediction, Eq. (5) where Eq. (23) allows it, and one update.

        As :meth:`ExtendedKalman.step`.
        """
        prior = predict(state.estimate, dynamics)
        Sigma, violated = self._enlarge(prior.cov)
        estimate = _update(Gaussian(prior.mean, Sigma), z, sensor)
        return RobustState(estimate, _count(state.violations, violated, estimate))

    def _enlarge(self, P: Array) -> tuple[Array, Array]:
        """Eq. (5), and where Eq. (23) forbids it."""
        xp = P.__array_namespace__()
        weight = xp.asarray(self.gamma, dtype=P.dtype)[..., None, None] ** -2
        rest = xp.eye(P.shape[-1]) - weight * P
        violated = _finite(rest) & ~is_positive_definite(rest)
        if self.on_violation == "raise" and xp.any(violated):
            largest = np.linalg.eigvalsh(np.asarray(P)[np.asarray(violated)])[..., -1]
            needed = np.sqrt(np.max(largest))
            raise ValueError(
                "gamma must exceed sqrt(max eig P_{t|t-1}), Eq. (23): the smallest admissible "
                f"gamma at this step is {needed:.6g}; found {np.min(self.gamma):.6g}"
            )
        forbidden = violated[..., None, None]
        added = right_divide(weight * P, xp.where(forbidden, xp.eye(P.shape[-1]), rest)) @ P
        otherwise = P if self.on_violation == "skip" else xp.nan
        return xp.where(forbidden, otherwise, P + (added + added.mT) / 2), violated


class AdaptiveState(NamedTuple):
    """What the AEKF remembers.

    Parameters
    ----------
    estimate : Gaussian
        mean (..., n), cov (..., n, n), after the last update.
    innovations : array (..., N + k, m)
        The last innovations, the newest at the end; zeros before the first.
    count : int array (...)
        Innovations so far.
    factor : array (..., n, n)
        E of the last step; the identity at first and without ``memory``.
    """

    estimate: Gaussian
    innovations: Array
    count: Array
    factor: Array


def _paper_directions() -> np.ndarray:
    """The pattern of Eq. (44): each star's direction, in the velocity components."""
    half = 0.5**0.5
    return np.array([[0, 0], [0, 0], [0, 0], [half, 0], [0, 1], [half, 0]])


@dataclass(frozen=True, eq=False)
class AdaptiveEKF:
    """The extended Kalman filter that tunes Q by the autocorrelation of its innovations.

    Sigma = F P F^T + E Q_0 E^T,   E = expm(A M A^T / 2),   M = (C_1 + ... + C_k) C_0^-1,
    C_i = (N - 1)^-1 sum of y_j y_{j-i}^T over the last N innovations y_j

    Parameters
    ----------
    a : float or array (...)
        Factor of the coefficient matrix, A = a * directions.
    k : int
        Number of autocorrelations, at least 1.
    N : int
        Window of each, at least 2.
    directions : array (..., n, m)
        Where each innovation drives the process noise; the paper's for a state of position and
        velocity and two stars.
    current : bool
        Whether the newest y_j is that of the step itself, which is known before Q because it
        depends on the predicted mean alone, instead of that of the step before.
    memory : bool
        Whether each step multiplies the last one's E, instead of the identity: Q is an integrator.
    cap : float or array (...)
        With ``memory``, the largest tr(E Q_0 E^T) / tr Q_0; E is scaled down to it. The text has
        none.

    Raises
    ------
    ValueError
        Values that are not finite, or a k or N that is too small or not an integer.

    Notes
    -----
    The printed formulas cannot be computed, and this is a reading of them, *memoryless and
    congruent*. (A.17) with B = A^T of (44) is A M A, an (n, m) matrix on both sides of an (m, m):
    A M A^T is meant. (45) has H M H^T with H (m, n): H^T M H is meant, and since H is about 1e-7
    rad/m its exponent is below 1e-12 and nothing is tuned; A, which (44) defines for this, takes
    its place. Q_t = Q_{t-1} expm(...) is not symmetric, and as a product over the steps it
    explodes unless it is capped (``memory``, ``cap``): by default Q_0 is enlarged afresh at each
    step, by the half exponent from both sides, which is Q_0 expm(A M A^T) when the two commute and
    M is symmetric, and always a covariance. (46) is
    printed for i = 1, 2 and holds for C_0 too. It ends with y_t, and whether Q_t enters the
    prediction of t or of t + 1 is open: a prediction is made before the measurement, so the second
    is the default, and ``current`` is the first. Until N + k innovations exist, Q is Q_0. The k
    "in (A.16)" of section 5 is the one in (A.17).

    Autocorrelations that are negative on the whole *shrink* Q; this feedback has no floor.

    References
    ----------
    xiong2009, Eqs. (A.16), (A.17), (44)-(46).
    """

    a: Array = 1.5
    k: int = 2
    N: int = 15
    directions: Array = field(default_factory=_paper_directions, metadata={"axes": 2})
    current: bool = False
    memory: bool = False
    cap: Array = np.inf

    def __post_init__(self) -> None:
        validation.real_array("a", self.a, "")
        if not (np.asarray(self.cap) > 0).all():
            raise ValueError(f"cap must be positive; found {self.cap}")
        checked = {
            "k": validation.whole_number("k", self.k, 1),
            "N": validation.whole_number("N", self.N, 2),
            "directions": validation.real_array("directions", self.directions, "n, m"),
            "current": validation.flag("current", self.current),
            "memory": validation.flag("memory", self.memory),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    def init(self, prior: Gaussian) -> AdaptiveState:
        """The state before any measurement; as :meth:`ExtendedKalman.init`."""
        prior = _given(prior)
        xp = prior.mean.__array_namespace__()
        count = _zeros(prior)
        window = (*count.shape, self.N + self.k, np.shape(self.directions)[-1])
        n = prior.mean.shape[-1]
        return AdaptiveState(
            prior, xp.zeros(window), count, xp.zeros((*count.shape, n, n)) + xp.eye(n)
        )

    def step(
        self, state: AdaptiveState, z: Array, dynamics: Dynamics, sensor: MeasurementModel
    ) -> AdaptiveState:
        """One prediction with the tuned Q and one update; as :meth:`ExtendedKalman.step`."""
        x, F = _moved(state.estimate, dynamics)
        xp = x.__array_namespace__()
        z = validation.given("z", z)
        y = (z - validation.core("sensor.h", sensor.h(x), z.shape[-1:]))[..., None, :]
        past = xp.broadcast_to(state.innovations, (*y.shape[:-2], *state.innovations.shape[-2:]))
        window = xp.concat([past[..., 1:, :], y], axis=-2)
        count = xp.broadcast_to(state.count + 1, y.shape[:-2])
        used, exist = (window, count) if self.current else (past, count - 1)
        E = self._factor(used, (exist >= self.N + self.k)[..., None, None])
        noise = _noise(state.estimate, dynamics)
        if self.memory:
            E = E @ state.factor
            growth = xp.linalg.trace(E @ noise @ E.mT) / xp.linalg.trace(noise)
            kept = xp.asarray(self.cap) / growth
            E = xp.sqrt(xp.where(kept < 1, kept, 1.0))[..., None, None] * E
        prior = Gaussian(x, _spread(state.estimate, F, dynamics, E @ noise @ E.mT))
        estimate = _update(prior, z, sensor)
        factor = E if self.memory else state.factor
        factor = xp.broadcast_to(factor, (*estimate.mean.shape[:-1], *E.shape[-2:]))
        return AdaptiveState(estimate, window, count, factor)

    def _factor(self, window: Array, full: Array) -> Array:
        """E of the class docstring, the identity for members whose window is not full."""
        xp = window.__array_namespace__()
        newest = window[..., self.k :, :].mT
        C = [
            newest @ window[..., self.k - i : self.k - i + self.N, :] / (self.N - 1)
            for i in range(self.k + 1)
        ]
        M = right_divide(sum(C[1:]), xp.where(full, C[0], xp.eye(C[0].shape[-1])))
        A = xp.asarray(self.a)[..., None, None] * xp.asarray(self.directions)
        return _expm(xp.where(full, A @ M @ A.mT / 2, 0.0))


class AdaptiveRobustState(NamedTuple):
    """What the AREKF remembers.

    Parameters
    ----------
    estimate : Gaussian
        mean (..., n), cov (..., n, n), after the last update.
    P_y_bar : array (..., m, m) or None
        Estimated covariance of the innovations, Eq. (27); None before the first.
    robust : int array (...)
        Steps so far in the robust branch of Eq. (26).
    clipped : int array (...)
        How many of those had a lambda below 1, which was taken as 1.
    """

    estimate: Gaussian
    P_y_bar: Array | None
    robust: Array
    clipped: Array


def trace_ratio(P_y_bar: Array, P_y: Array) -> Array:
    """lambda = tr P_y_bar / tr P_y, the estimated spread of the innovations over the predicted one.

    Parameters
    ----------
    P_y_bar, P_y : array (..., m, m)

    Returns
    -------
    array (...)

    References
    ----------
    xiong2009, Eq. (47).
    """
    xp = P_y.__array_namespace__()
    return xp.linalg.trace(P_y_bar) / xp.linalg.trace(P_y)


@dataclass(frozen=True, eq=False)
class AdaptiveRobustEKF:
    """The extended Kalman filter that enlarges P only where its innovations are too large.

    Sigma = P   if P_y - alpha P_y_bar is positive definite, else lambda P,
    P_y = H P H^T + R,   P_y_bar <- (rho P_y_bar + y y^T) / (rho + 1)

    Parameters
    ----------
    alpha : float or array (...)
        Threshold, at least 0: the innovations may spread 1 / alpha times as far, in variance, as
        predicted. At 0 the filter is the EKF.
    rho : float or array (...)
        Forgetting factor of P_y_bar, at least 0.
    lam : callable or float or array (...)
        (P_y_bar, P_y) -> lambda (...), or a fixed lambda.

    Raises
    ------
    ValueError
        A negative or non-finite parameter.

    Notes
    -----
    With the L of Eq. (24), Eq. (5) is (P^-1 - P^-1 + P^-1 / lambda)^-1 = lambda P: gamma cancels.
    Below 1 the root in (24) is imaginary, so lambda is max(1, lam), counted. Eq. (8) defines P_y
    from the Sigma that (26) has yet to choose; P_{t|t-1} is meant. The text after (38) compares
    P_y_bar with P_y_bar / alpha, and remark 3 with alpha P_y; (26) itself says P_y / alpha. As (27)
    is printed the weights of the past and of the newest are nearly equal: "rho = 0.98" remembers
    about two innovations.

    References
    ----------
    xiong2009, Eqs. (24)-(27), (47).
    """

    alpha: Array = 0.2
    rho: Array = 0.98
    lam: Callable[[Array, Array], Array] | Array = trace_ratio

    def __post_init__(self) -> None:
        for name in ("alpha", "rho") if callable(self.lam) else ("alpha", "rho", "lam"):
            value = validation.real_array(name, getattr(self, name), "")
            if (value < 0).any():
                raise ValueError(f"{name} must be at least 0; found {value.min()}")

    def init(self, prior: Gaussian) -> AdaptiveRobustState:
        """The state before any measurement; as :meth:`ExtendedKalman.init`."""
        prior = _given(prior)
        return AdaptiveRobustState(prior, None, _zeros(prior), _zeros(prior))

    def step(
        self, state: AdaptiveRobustState, z: Array, dynamics: Dynamics, sensor: MeasurementModel
    ) -> AdaptiveRobustState:
        """One prediction, Eq. (26), and one update; as :meth:`ExtendedKalman.step`."""
        prior = predict(state.estimate, dynamics)
        z_hat, P_y, _ = linearized(prior, sensor)
        xp = P_y.__array_namespace__()
        z = validation.given("z", z)
        y = z - validation.core("sensor.h", z_hat, z.shape[-1:])
        P_y_bar = y[..., :, None] * y[..., None, :]
        if state.P_y_bar is not None:
            rho = xp.asarray(self.rho)[..., None, None]
            P_y_bar = (rho * state.P_y_bar + P_y_bar) / (rho + 1)
        excess = P_y - xp.asarray(self.alpha)[..., None, None] * P_y_bar
        robust = _finite(excess) & ~is_positive_definite(excess)
        lam = self.lam(P_y_bar, P_y) if callable(self.lam) else xp.asarray(self.lam)
        clipped = robust & (lam < 1)
        scale = xp.where(robust & (lam > 1), lam, 1.0)[..., None, None]
        estimate = _update(Gaussian(prior.mean, scale * prior.cov), z, sensor)
        robust = _count(state.robust, robust, estimate)
        clipped = _count(state.clipped, clipped, estimate)
        return AdaptiveRobustState(estimate, P_y_bar, robust, clipped)


def _given(prior: Gaussian) -> Gaussian:
    """A prior whose arrays are of a kind that products keep, and fit together."""
    mean, cov = (validation.given(f"prior.{name}", a) for name, a in prior._asdict().items())
    if mean.ndim == 0:
        raise ValueError(f"prior.mean must have shape (..., n); found {mean.shape}")
    return Gaussian(mean, validation.core("prior.cov", cov, mean.shape[-1:] * 2))


def _zeros(prior: Gaussian) -> Array:
    """A counter for every member of the prior."""
    xp = prior.mean.__array_namespace__()
    batch = np.broadcast_shapes(prior.mean.shape[:-1], prior.cov.shape[:-2])
    return xp.zeros(batch, dtype=xp.int64)


def _count(counter: Array, event: Array, estimate: Gaussian) -> Array:
    """One more where the event happened, for every member of the estimate."""
    xp = estimate.mean.__array_namespace__()
    return xp.broadcast_to(counter + event, estimate.mean.shape[:-1])


def _finite(A: Array) -> Array:
    """Members without a NaN or an infinity."""
    xp = A.__array_namespace__()
    return xp.all(xp.isfinite(A), axis=(-2, -1))


def _expm(A: Array) -> Array:
    """Matrix exponential of a stack: Taylor to degree 14 of A / 2^s, squared s times.

    Each member has its own s, with norm(A) / 2^s at most 1/2. A norm above 1024, where doubles
    overflow, gives NaN.
    """
    xp = A.__array_namespace__()
    identity = xp.eye(A.shape[-1])
    norm = xp.max(xp.sum(xp.abs(A), axis=-1), axis=-1)
    usable = norm <= 1024.0  # and not NaN
    halvings = xp.ceil(xp.log2(xp.where(usable & (norm > 0.5), norm, 0.5) / 0.5))[..., None, None]
    scaled = xp.where(usable[..., None, None], A, xp.nan) / 2**halvings
    E = identity + scaled / 14
    for j in range(13, 0, -1):
        E = identity + scaled @ E / j
    for j in range(11):
        E = xp.where(j < halvings, E @ E, E)
    return E
