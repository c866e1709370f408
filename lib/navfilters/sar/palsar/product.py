"""A PALSAR level-1.0 product, opened."""

import datetime
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from navfilters.numerics.validation import whole_number
from navfilters.sar.palsar.ceos_fields import take
from navfilters.sar.palsar.orbit_and_pulse import StateVectors

_TOP = 31  # the largest 5-bit code

_MARKS = ".~:( "  # between a file's name and what another program appends to it

_BLOCK = 256  # lines that the Doppler estimate holds at once


@dataclass(frozen=True, eq=False)
class Product:
    """What ``open_product`` or ``open_frames`` has checked; samples stay in the files until read.

    Column k of every line is the echo at range near_range + k c / (2 sampling_rate), whatever the
    line's own window was: that of the first line that is not missing counts for all.

    Parameters
    ----------
    image, leader : Path
        Of the first frame, where several are joined.
    lines, samples : int
        Shape of the whole image; lines that are missing count.
    day : datetime.date
        UTC day of the first line that is not missing; times are seconds from its start.
    line_times : ndarray (lines,)
        UTC seconds of the day, evenly spaced; known to a small part of a line where there are
        thousands of lines, to 1 ms for two.
    missing : ndarray (lines,) of bool
        Lines without an echo: flagged as filled, absent from the file, or calibration data.
    valid : ndarray (lines, 2)
        Half-open range of the columns that hold samples; (0, 0) where missing.
    prf : float
        Lines a second of this polarisation, Hz.
    near_range : float
        Of column 0, m; whole metres, and so known to 0.5 m.
    sampling_rate : float
        Hz.
    chirp_rate : float
        Hz/s, negative.
    pulse_length : float
        s.
    wavelength : float
        m.
    dc : complex
        Code of zero signal, I + iQ; each frame's own is used to read it.
    polarisation : str
        Transmitted, received: "HH", "HV", "VH" or "VV".
    state_vectors : StateVectors
        times (n,) in UTC seconds of the day, positions (n, 3) in m and velocities (n, 3) in m/s,
        Earth-fixed.
    """

    image: Path
    leader: Path
    lines: int
    samples: int
    day: datetime.date
    line_times: np.ndarray
    missing: np.ndarray
    valid: np.ndarray
    prf: float
    near_range: float
    sampling_rate: float
    chirp_rate: float
    pulse_length: float
    wavelength: float
    dc: complex
    polarisation: str
    state_vectors: StateVectors
    _origin: np.ndarray = field(repr=False)  # (lines,) bytes at which column 0 stands, or would
    _frame: np.ndarray = field(repr=False)  # (lines,) of the images, which one holds a line
    _images: tuple[tuple[Path, complex], ...] = field(repr=False)  # with their codes of zero signal

    @property
    def name(self) -> str:
        """Of the image file; of all of them, where frames are joined."""
        return " + ".join(path.name for path, _ in self._images)

    def read(self, first: int, last: int) -> np.ndarray:
        """Echoes of some lines, without the code of zero signal.

        Parameters
        ----------
        first, last : int
            Lines, 0-based, half-open.

        Returns
        -------
        ndarray (last - first, samples) of complex64
            0 where nothing was received: missing lines, and columns outside of ``valid``.

        Raises
        ------
        ValueError
            Lines that the product does not have, or a file that has become shorter.
        OSError

        Warns
        -----
        UserWarning
            Samples of more than 5 bits, with their number.
        """
        first, last = self._range(first, last)
        echoes = np.zeros((last - first, self.samples), np.complex64)
        over = dict.fromkeys((path for path, _ in self._images), 0)
        for line, codes in self._codes(first, last):
            path, dc = self._images[self._frame[line]]
            over[path] += int(np.count_nonzero(codes > _TOP))
            start, stop = self.valid[line]
            out = echoes[line - first, start:stop].view(np.float32).reshape(-1, 2)
            np.subtract(codes, np.array([dc.real, dc.imag], np.float32), out=out)
        for path, many in over.items():
            if many:
                warnings.warn(
                    f"{path}: {many} values of lines {first} to {last - 1} are above {_TOP}, "
                    "more than 5 bits hold",
                    stacklevel=2,
                )
        return echoes

    def doppler_centroid(self, first: int, last: int) -> float:
        """Mean Doppler frequency of some lines, from the phase between neighbours.

        f = prf angle(sum conj(z[n]) z[n + 1]) / (2 pi)

        Parameters
        ----------
        first, last : int
            Lines, 0-based, half-open.

        Returns
        -------
        float
            Hz, between -prf / 2 and prf / 2: whole multiples of prf are not seen.

        Raises
        ------
        ValueError
            As :meth:`read`, or no two lines beside each other that hold echoes.
        """
        first, last = self._range(first, last)
        together = 0j
        for start in range(first, last - 1, _BLOCK):
            z = self.read(start, min(start + _BLOCK + 1, last))
            together += complex(np.vdot(z[:-1], z[1:]))
        if together == 0:
            raise ValueError(
                f"first, last must hold two neighbours with echoes; found {first}, {last}"
            )
        return float(self.prf * np.angle(together) / (2 * np.pi))

    def _codes(self, first: int, last: int) -> Iterator[tuple[int, np.ndarray]]:
        """Lines, image by image, and the codes (n, 2) of their valid columns as they stand."""
        for k, (path, _) in enumerate(self._images):
            lines = first + np.flatnonzero(self._frame[first:last] == k)
            if not len(lines):
                continue
            with open(path, "rb", buffering=0) as file:
                for line in lines:
                    start, stop = (int(column) for column in self.valid[line])
                    at = int(self._origin[line]) + 2 * start
                    raw = take(file, path, at, 2 * (stop - start), f"line {line}")
                    yield int(line), np.frombuffer(raw, np.uint8).reshape(-1, 2)

    def _range(self, first: int, last: int) -> tuple[int, int]:
        first = whole_number("first", first, 0)
        last = whole_number("last", last, first)
        if last > self.lines:
            raise ValueError(f"last must be at most the {self.lines} lines; found {last}")
        return first, last
