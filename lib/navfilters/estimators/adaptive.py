"""The adaptive EKF of Xiong et al. as a rule: Q tuned by the autocorrelation of the innovations."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from navfilters.estimators.rule import Rule, zeros
from navfilters.numerics import validation
from navfilters.numerics.matrix_exponential import expm
from navfilters.numerics.small_matrices import right_divide
from navfilters.types import Array, Gaussian, Moments


class AdaptiveMemory(NamedTuple):
    """What the adaptive rule remembers.

    Parameters
    ----------
    innovations : array (..., N + k, m)
        The last innovations, the newest at the end; zeros before the first.
    count : int array (...)
        Innovations so far.
    factor : array (..., n, n)
        E of the last step; the identity at first and without ``memory``.
    """

    innovations: Array
    count: Array
    factor: Array


def _paper_directions() -> np.ndarray:
    """The pattern of Eq. (44): each star's direction, in the velocity components."""
    half = 0.5**0.5
    return np.array([[0, 0], [0, 0], [0, 0], [half, 0], [0, 1], [half, 0]])


@dataclass(frozen=True, eq=False)
class AdaptiveNoise(Rule):
    """The rule that tunes Q by the autocorrelation of the innovations.

    Sigma = F P F^T + E Q_0 E^T,   E = expm(A M A^T / 2),   M = (C_1 + ... + C_k) C_0^-1,
    C_i = (N - 1)^-1 sum of y_j y_{j-i}^T over the last N innovations y_j,
    those before the step; Q_0 until N + k of them exist

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
    memory : bool
        Whether each step multiplies the last one's E, instead of the identity: Q is an integrator.
    cap : float or array (...)
        With ``memory``, the largest tr(E Q_0 E^T) / tr Q_0; E is scaled down to it. The text has
        none.

    Raises
    ------
    ValueError
        Values that are not finite, or a k or N that is too small or not an integer.

    References
    ----------
    xiong2009, Eqs. (A.16), (A.17), (44)-(46).
    """

    a: Array = 1.5
    k: int = 2
    N: int = 15
    directions: Array = field(default_factory=_paper_directions, metadata={"axes": 2})
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
            "memory": validation.flag("memory", self.memory),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    looks = True

    def init(self, prior: Gaussian) -> AdaptiveMemory:
        """An empty window."""
        xp, n = prior.mean.__array_namespace__(), prior.cov.shape[-1]
        count = zeros(prior)
        window = (*count.shape, self.N + self.k, np.shape(self.directions)[-1])
        return AdaptiveMemory(xp.zeros(window), count, xp.zeros((*count.shape, n, n)) + xp.eye(n))

    def process_noise(self, memory: AdaptiveMemory, Q: Array) -> tuple[Array, AdaptiveMemory]:
        """E Q E^T."""
        validation.core("dynamics.Q", Q, memory.factor.shape[-2:])
        full = (memory.count >= self.N + self.k)[..., None, None]
        E = self._factor(memory.innovations, full)
        if not self.memory:
            return E @ Q @ E.mT, memory
        xp, E = E.__array_namespace__(), E @ memory.factor
        growth = xp.linalg.trace(E @ Q @ E.mT) / xp.linalg.trace(Q)
        kept = xp.asarray(self.cap) / growth
        E = xp.sqrt(xp.where(kept < 1, kept, 1.0))[..., None, None] * E
        return E @ Q @ E.mT, memory._replace(factor=E)

    def enlarge(
        self, memory: AdaptiveMemory, prior: Gaussian, y: Array | None, moments: Moments | None
    ) -> tuple[Gaussian, AdaptiveMemory]:
        """The prior as it is; its innovation is the newest."""
        assert y is not None
        xp, past, factor = y.__array_namespace__(), memory.innovations, memory.factor
        batch = xp.broadcast_shapes(y.shape[:-1], factor.shape[:-2])  # a cap has its own
        past = xp.broadcast_to(past, (*batch, *past.shape[-2:]))
        newest = xp.broadcast_to(y[..., None, :], (*batch, 1, y.shape[-1]))
        window = xp.concat([past[..., 1:, :], newest], axis=-2)
        count = xp.broadcast_to(memory.count + 1, batch)
        factor = xp.broadcast_to(factor, (*batch, *factor.shape[-2:]))
        return prior, AdaptiveMemory(window, count, factor)

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
        return expm(xp.where(full, A @ M @ A.mT / 2, 0.0))
