"""A PALSAR level-1.0 product, opened."""

import datetime
import warnings
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
    """A product that ``open_product`` has checked; samples stay in the file until read.

    Column k of every line is the echo at range near_range + k c / (2 sampling_rate), whatever the
    line's own window was: that of the first line that is not missing counts for all.

    Parameters
    ----------
    image, leader : Path
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
        Code of zero signal, I + iQ.
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
        zero = np.array([self.dc.real, self.dc.imag], np.float32)
        over = 0
        with open(self.image, "rb", buffering=0) as file:
            for row, line in zip(echoes, range(first, last), strict=True):
                start, stop = (int(column) for column in self.valid[line])
                at, name = int(self._origin[line]) + 2 * start, f"line {line}"
                raw = take(file, self.image, at, 2 * (stop - start), name)
                codes = np.frombuffer(raw, np.uint8).reshape(-1, 2)
                over += int(np.count_nonzero(codes > _TOP))
                np.subtract(codes, zero, out=row[start:stop].view(np.float32).reshape(-1, 2))
        if over:
            warnings.warn(
                f"{self.image}: {over} values of lines {first} to {last - 1} are above {_TOP}, "
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

    def _range(self, first: int, last: int) -> tuple[int, int]:
        first = whole_number("first", first, 0)
        last = whole_number("last", last, first)
        if last > self.lines:
            raise ValueError(f"last must be at most the {self.lines} lines; found {last}")
        return first, last
