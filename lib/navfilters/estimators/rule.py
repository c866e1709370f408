"""What stands between prediction and moments: a rule on the covariances, with a memory."""

from typing import Any

import numpy as np

from navfilters.types import Array, Gaussian, Moments


class Rule:
    """The rule that changes nothing; a base for others.

    A rule is a frozen dataclass of its tuning parameters. Its memory is a named tuple of arrays
    with the batch axes in front, or None. ``enlarge`` acts where the whole measurement was taken.
    """

    looks = False
    """Whether ``enlarge`` is given the innovation and the moments; they cost a call."""

    def init(self, prior: Gaussian) -> Any:
        """The memory before any step."""
        return None

    def process_noise(self, memory: Any, Q: Array) -> tuple[Array, Any]:
        """The Q that the prediction takes, and the memory after it."""
        return Q, memory

    def enlarge(
        self, memory: Any, prior: Gaussian, y: Array | None, moments: Moments | None
    ) -> tuple[Gaussian, Any]:
        """The prior that the moments are made of, and the memory after it.

        Parameters
        ----------
        memory
        prior : Gaussian
            Predicted: mean (..., n), cov (..., n, n).
        y : array (..., m), optional
            The innovation, with ``looks``.
        moments : Moments, optional
            Those of the predicted prior, with ``looks``.

        Returns
        -------
        tuple of Gaussian, memory
        """
        return prior, memory

    def limit(self, P: Array) -> Array:
        """What ``enlarge`` makes of a first P, in the textbook's terms: see ``Filter``."""
        return P


def zeros(prior: Gaussian) -> Array:
    """A counter for every member of a prior."""
    xp = prior.mean.__array_namespace__()
    batch = np.broadcast_shapes(prior.mean.shape[:-1], prior.cov.shape[:-2])
    return xp.zeros(batch, dtype=xp.int64)
