"""The folder of a campaign: finished parts on disk."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import navfilters
from navfilters.papers.pogorelsky2020.imaging import Imaging
from navfilters.runs import stored_arrays
from navfilters.types import Array

FORMAT = 2
"""Of the stored arrays; 1 had the runs on the first axis and the times on the second."""


@dataclass(frozen=True, eq=False)
class Folder:
    """Where a campaign keeps what is finished.

    Parameters
    ----------
    path : Path
    imaging : Imaging
    seed : int
        Of the runs.
    """

    path: Path
    imaging: Imaging
    seed: int

    def load(self, name: str, kind: type, *job: Any) -> Any:
        """A stored named tuple or dataclass of arrays; None if it is not there yet.

        Parameters
        ----------
        name : str
            Of the file, without its ending.
        kind : type
            ``ImageTable``, ``MonteCarlo`` or ``Formed``.
        *job
            What it is made of, beyond the imaging.

        Returns
        -------
        kind or None

        Raises
        ------
        ValueError
            The file is damaged or of another campaign; naming it.
        """
        names = kind.__annotations__
        arrays = stored_arrays.load(
            self.path / f"{name}.npz",
            self._job(job),
            names,
            kind="campaign",
            remedy="what it held is computed again",
        )
        return None if arrays is None else kind(*arrays)

    def save(self, name: str, value: Any, *job: Any) -> None:
        """Store it, whole or not at all.

        Parameters
        ----------
        name : str
        value : named tuple or dataclass of arrays
        *job
            As in ``load``.
        """
        arrays = {part: getattr(value, part) for part in type(value).__annotations__}
        stored_arrays.save(self.path / f"{name}.npz", self._job(job), **arrays)

    def _job(self, job: tuple[Any, ...]) -> str:
        return repr((FORMAT, navfilters.__version__, self.imaging, *job))


class Formed(NamedTuple):
    """An image that a run formed itself.

    Parameters
    ----------
    start, speed : array ()
        In-track velocity before and after the climb, m/s; NaN for no peak.
    r_f : array (3,)
        Position of the centre pixel, m; NaN for no match.
    ended : array () of str
        Of the climb.
    """

    start: Array
    speed: Array
    r_f: Array
    ended: Array
