"""Earth-fixed flight with an attitude, as a filter's dynamics on a manifold."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from navfilters.numerics import validation
from navfilters.numerics.loops import is_jax, repeat
from navfilters.numerics.small_matrices import stacked
from navfilters.space.earth_fixed_orbit import EarthFixedOrbit, padded
from navfilters.space.pose import difference, retract
from navfilters.space.variations import Pair, forwards, rates, series, to_end
from navfilters.types import Array


@dataclass(frozen=True, eq=False)
class EarthFixedNavigation:
    """Several steps of an orbit between two images, and a misalignment that stays.

    The state is x = (r, v, q): position, m, velocity, m/s, and a unit quaternion, scalar last. F, Q
    and W are of its error, truth minus estimate, as in :mod:`navfilters.space.pose`.

    Parameters
    ----------
    orbit : EarthFixedOrbit
        Of one step.
    steps : int

    Raises
    ------
    ValueError
        steps is not an integer of at least 1.

    References
    ----------
    pogorelsky2020, Eqs. (8)-(12).
    """

    orbit: EarthFixedOrbit
    steps: int

    def __post_init__(self) -> None:
        steps = validation.whole_number("steps", self.steps, 1)
        object.__setattr__(self, "steps", steps)

    @property
    def Q(self) -> Array:
        """Covariance of the noise of *one step*, (..., 9, 9)."""
        return self.orbit.Q

    def f(self, x: Array) -> Array:
        """The state after all steps.

        Parameters
        ----------
        x : array (..., 10)

        Returns
        -------
        array (..., 10)
        """
        xp = x.__array_namespace__()
        flown = repeat(lambda _, x: self.orbit.advance(x), x[..., :6], self.steps, xp)
        return self._with_attitude(flown, x)

    def transition(self, x: Array) -> tuple[Array, Array]:
        """The same, and how its error grows.

        Parameters
        ----------
        x : array (..., 10)

        Returns
        -------
        tuple of array (..., 10), array (..., 9, 9)
            f(x) and F.
        """
        if is_jax(x.__array_namespace__()):
            flown, F = forwards(self._step, x[..., :6], self.steps, 9)
            return self._with_attitude(flown, x), F
        flown, derivatives = self._to_end(x)
        return self._with_attitude(flown, x), padded(derivatives[-1])

    def propagate(self, x: Array, Q: Array) -> tuple[Array, Array, Array]:
        """The same, and the covariance at the end of a noise that enters after every step.

        W = sum_k Phi_k Q Phi_k^T,   Phi_k from after step k to the end:
        F P F^T + W is what repeating P <- F_k P F_k^T + Q gives.

        Parameters
        ----------
        x : array (..., 10)
        Q : array (..., 9, 9)
            Covariance of each step's noise.

        Returns
        -------
        tuple of array (..., 10), array (..., 9, 9), array (..., 9, 9)
            f(x), F and W.

        References
        ----------
        pogorelsky2020, Eq. (12).
        """
        if is_jax(x.__array_namespace__()):
            flown, F, W = forwards(self._step, x[..., :6], self.steps, 9, Q)
            return self._with_attitude(flown, x), F, W
        flown, (*of_noise, F) = self._to_end(x)
        F = padded(F)
        W = self.steps * Q + 0 * F
        W[..., :6, :6] = sum(Phi @ Q[..., :6, :6] @ Phi.mT for Phi in of_noise)
        W[..., :6, 6:] = sum(of_noise) @ Q[..., :6, 6:]
        W[..., 6:, :6] = W[..., :6, 6:].mT
        return self._with_attitude(flown, x), F, W

    retract = staticmethod(retract)
    difference = staticmethod(difference)

    def _with_attitude(self, flown: Array, x: Array) -> Array:
        return x.__array_namespace__().concat([flown, x[..., 6:]], axis=-1)

    def _to_end(self, x: Array) -> tuple[Array, list[Array]]:
        """The last position and velocity, and its derivatives by each, from last to first."""
        path = self.orbit.path(x[..., :6], self.steps)
        parts = to_end(lambda _, part: self.orbit.flight_transitions(part), path, 6)
        return path[-1], list(parts)

    def _step(self, k: Array, x: Array) -> tuple[Array, Callable[..., Array]]:
        """Position and velocity a step later, and M -> F M, for JAX."""
        orbit, w, printed = self.orbit, self.orbit.rate, self.orbit.integrator == "printed"
        x_next = orbit.advance(x)
        at = x if printed else (x + x_next) / 2
        G = orbit.gravity.gradient_elements(at[..., 0], at[..., 1], at[..., 2])
        G[0][0], G[1][1] = G[0][0] + w * w, G[1][1] + w * w

        def coriolis(v: Array) -> Array:
            xp = v.__array_namespace__()
            return xp.stack([2 * w * v[1], -2 * w * v[0], xp.zeros_like(v[2])])

        A = partial(rates, stacked(G), coriolis)
        if not printed:
            return x_next, partial(series, A, orbit.step, 2)

        def grow(r: Array, v: Array) -> Pair:
            h, (_, a) = orbit.step, A(r, v)
            return r + h * v + (h * h / 2) * a, v + h * a  # Eq. (11)

        return x_next, grow
