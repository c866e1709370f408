"""A check: a rule, and cases with a number each that must not pass a limit."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from navfilters.crash.subject import Subject
from navfilters.types import Gaussian


@dataclass(frozen=True)
class Case:
    """One number of one configuration.

    Parameters
    ----------
    configuration : str
        What was tried.
    what : str
        What the number is.
    value : float
    limit : float
        It passes at ``value <= limit``; no number fails.
    """

    configuration: str
    what: str
    value: float
    limit: float

    @property
    def passed(self) -> bool:
        """Whether the value is a number within the limit."""
        return bool(self.value <= self.limit)

    @property
    def excess(self) -> float:
        """Value over limit, for what is worst; infinite where there is no number."""
        if not np.isfinite(self.value):
            return np.inf
        return self.value / self.limit if self.limit > 0 else np.inf if self.value > 0 else 0.0


@dataclass(frozen=True)
class Check:
    """A question to a filter.

    Parameters
    ----------
    name : str
    rule : str
        When it passes, in words.
    chapter : str
        Where the book explains it, relative to book/.
    cases : callable
        subject -> iterator of Case.
    vector : bool
        Whether the state is a vector; a filter of one state at a time is not asked otherwise.
    """

    name: str
    rule: str
    chapter: str
    cases: Callable[[Subject], Iterator[Case]]
    vector: bool = True

    def __call__(self, filter: Any) -> list[Case]:
        """All cases of a filter.

        Parameters
        ----------
        filter : Subject, or what ``run`` takes

        Returns
        -------
        list of Case
        """
        return list(self.cases(filter if isinstance(filter, Subject) else Subject(filter)))


def distance(found: Gaussian, wanted: Gaussian) -> float:
    """Largest difference of mean and covariance, in the deviations that are wanted.

    Parameters
    ----------
    found, wanted : Gaussian
        mean (..., n), cov (..., n, n).

    Returns
    -------
    float
        NaN where what was found is not finite.
    """
    deviation = np.sqrt(np.diagonal(wanted.cov, axis1=-2, axis2=-1))
    deviation = np.where(deviation > 0, deviation, 1.0)
    of_mean = np.abs(found.mean - wanted.mean) / deviation
    of_cov = np.abs(found.cov - wanted.cov) / (deviation[..., :, None] * deviation[..., None, :])
    worst = max(float(of_mean.max(initial=0.0)), float(of_cov.max(initial=0.0)))
    return worst if np.isfinite(of_mean).all() and np.isfinite(of_cov).all() else np.nan
