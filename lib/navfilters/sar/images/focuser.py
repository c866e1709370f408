"""From raw data to an image: range-Doppler focusing at an assumed velocity."""

from copy import copy

import numpy as np
from scipy import fft
from scipy.constants import c

from navfilters.numerics import validation
from navfilters.sar.images.middle_lines import middle_lines
from navfilters.sar.images.raw_data import RawData
from navfilters.sar.images.slant_image import Image
from navfilters.sar.in_parts import blocks, in_threads
from navfilters.sar.phase_blocks import (
    PIECE,
    Phase,
    fast_length,
    lines_at_once,
    phasor,
    unit,
)
from navfilters.types import Array

GUARD = 32
"""Samples on each side of a patch, over which it fades."""

COLUMNS = 32
"""Of a matrix that are transformed at once: a few MB."""


class Focuser:
    """Raw data, compressed in range and transformed: what all assumed velocities share.

    Parameters
    ----------
    raw : RawData
    lines, samples : int, optional
        Of the image: the middle lines, and the first samples. By default all pulses, and all ranges
        from which the whole pulse came back.
    bandwidth : float, optional
        Doppler band that is processed, Hz; by default all.
    doppler_centroid : float
        Middle of that band, Hz.
    migration : bool
        Whether range-cell migration is corrected; without, to show what it does.

    Raises
    ------
    ValueError
        Naming the argument, the value found and what is needed.

    Notes
    -----
    Migration and the coupling of range and azimuth frequencies are removed for the middle of the
    swath; over an image of 4.8 km the remaining migration is below 0.05 samples at its edges. The
    azimuth filter is exact at every range.

    Only the range-compressed spectrum is kept, not the raw data.

    References
    ----------
    pogorelsky2020, section "SAR image formation", and Cumming and Wong, which it cites.
    """

    def __init__(
        self,
        raw: RawData,
        *,
        lines: int | None = None,
        samples: int | None = None,
        bandwidth: float | None = None,
        doppler_centroid: float = 0.0,
        migration: bool = True,
    ) -> None:
        data = np.asarray(raw.samples)
        if data.ndim != 2 or not np.iscomplexobj(data):
            raise ValueError(
                "raw.samples must be a complex array (pulses, ranges); found dtype "
                f"{data.dtype} and shape {data.shape}"
            )
        pulses, ranges = data.shape
        whole = ranges - int(np.ceil(raw.pulse_length * raw.sampling))
        if whole < 1:
            raise ValueError(
                f"raw.samples must hold a whole pulse, {ranges - whole} ranges; found {ranges}"
            )
        for name, value, most in (("lines", lines, pulses), ("samples", samples, whole)):
            if value is not None and validation.whole_number(name, value, 2) > most:
                raise ValueError(f"{name} must be at most {most} for these data; found {value}")
        self._wavelength, self._sampling, self._prf = raw.wavelength, raw.sampling, raw.prf
        self._near_range, self._first_time = raw.near_range, raw.first_time
        self._lines, self._samples = lines or pulses, samples or whole
        self._first = (pulses - self._lines) // 2
        self._n, m = fft.next_fast_len(pulses), fast_length(ranges)
        self._kept, self._f = self._band(bandwidth, doppler_centroid)
        self._f_R = fft.fftfreq(m, 1 / raw.sampling)
        self._migration = migration
        self._removed = np.inf  # the velocity for which migration is gone: at none, there is none
        matched = _matched(raw, m)
        spectrum = np.zeros((self._n, m), np.complex64)

        def compress(rows: slice) -> None:
            pulse = fft.fft(data[rows].astype(np.complex64, copy=False), m, axis=1)
            np.multiply(pulse, matched, out=spectrum[rows])

        in_threads(compress, blocks(pulses, 64))
        self._spectrum = np.empty((len(self._kept), m), np.complex64)

        def transform(columns: slice) -> None:
            column = fft.fft(spectrum[:, columns].copy(), axis=0, overwrite_x=True)
            self._spectrum[:, columns] = column[self._kept]

        in_threads(transform, blocks(m, COLUMNS))

    @property
    def range_spacing(self) -> float:
        """dr = c / (2 f_s), m. Eq. (2)."""
        return c / (2 * self._sampling)

    @property
    def samples(self) -> int:
        """Of an image, in range."""
        return self._samples

    @property
    def wavelength(self) -> float:
        """Of the carrier, m."""
        return self._wavelength

    @property
    def centre_range(self) -> float:
        """Slant range of an image's centre pixel, where its velocity holds, m. Eq. (1)."""
        return self._near_range + self._samples // 2 * self.range_spacing

    def otherwise(
        self,
        *,
        bandwidth: float | None = None,
        doppler_centroid: float = 0.0,
        migration: bool = True,
    ) -> "Focuser":
        """The same data, processed in another way, without their transforms once more.

        Parameters
        ----------
        bandwidth, doppler_centroid, migration
            As of the class.

        Returns
        -------
        Focuser
            To the last bit one of the raw data, with these options.

        Raises
        ------
        ValueError
            A band of which this one has not all, or a patch.
        """
        if np.isfinite(self._removed):
            raise ValueError("a patch must be taken of what is processed otherwise, not before it")
        other = copy(self)
        other._migration = migration
        other._kept, other._f = self._band(bandwidth, doppler_centroid)
        row = np.full(self._n, -1)
        row[self._kept] = np.arange(len(self._kept))
        rows = row[other._kept]
        if rows.min() < 0:
            raise ValueError(
                f"bandwidth must stay within the band of this focuser; found {bandwidth} Hz about "
                f"{doppler_centroid}"
            )
        if not np.array_equal(other._kept, self._kept):
            other._spectrum = self._spectrum[rows]
        return other

    def image(self, velocity: float, slope: float = 0.0) -> Image:
        """Focus for an effective velocity.

        Migration is corrected by a phase in range frequency, exp(i A(f_t, f_R)), and each range
        compressed in azimuth by exp(4 pi i R (D - 1) / wavelength), with
        D^2 = 1 - (wavelength f_t / 2V)^2.

        Parameters
        ----------
        velocity : float
            At the middle of the samples: see ``effective_velocity``, m/s.
        slope : float
            Change of its square with slant range, m/s^2.

        Returns
        -------
        Image

        Raises
        ------
        ValueError
            A velocity so small that the processed Doppler frequencies do not occur.

        References
        ----------
        pogorelsky2020, section "SAR image formation".
        """
        migration, R_mid = self._migrated(velocity), self.centre_range

        def compression(f: Array, distance: Array) -> Array:
            squared = velocity**2 + slope * distance
            D = np.sqrt(1 - (self._wavelength * f / 2) ** 2 / squared)
            return 4 * np.pi / self._wavelength * (R_mid + distance) * (D - 1)

        def change(f: Array, distance: Array) -> Array:
            return compression(f, distance) - compression(f, np.zeros(1))

        middle = (self._first + self._lines // 2) / self._prf
        in_time = 2 * np.pi * middle * self._f[:, None]
        in_the_middle = unit(compression(self._f[:, None], np.zeros(1)) + in_time)
        size = -(-self._samples // PIECE) * PIECE
        distance = self.range_spacing * (np.arange(size) - self._samples // 2)
        filtered = np.empty((len(self._f), size), np.complex64)
        filtered[:, self._samples :] = 0

        def fill(lines: slice) -> None:
            data = phasor(change, self._f[lines], distance)[:, : self._samples]
            data *= in_the_middle[lines]
            straight = self._straightened(migration, lines)[:, : self._samples]
            np.multiply(data, straight, out=filtered[lines, : self._samples])

        most = lines_at_once(self._f, (migration, self._f_R), (change, distance))
        in_threads(fill, blocks(len(self._f), most))
        first = round(self._f[0] * self._n / self._prf)
        pixels = middle_lines(filtered, first, self._n, self._lines, self._samples)
        return Image(
            pixels,
            self._first_time + self._first / self._prf,
            self._prf,
            self._near_range,
            self.range_spacing,
        )

    def patch(self, samples: int, velocity: float) -> "Focuser":
        """The same data at the middle ranges alone, whose images cost in proportion: to climb on.

        The migration of one velocity is removed from all ranges before they are cut; the images of
        the patch correct what another velocity leaves.

        Parameters
        ----------
        samples : int
            Of the patch.
        velocity : float
            In the middle of those at which it will be focused, m/s.

        Returns
        -------
        Focuser
            Of the same lines. Its images are the middle columns of the whole ones, to 0.5 % of
            their amplitude for each sample by which the migrations of the two velocities differ.

        Raises
        ------
        ValueError
            Naming the argument, the value found and what is needed.
        """
        if samples == self._samples and fast_length(samples + 2 * GUARD) >= len(self._f_R):
            return self  # there is nothing to cut
        most = min(self._samples, len(self._f_R) - 2 * GUARD)
        if validation.whole_number("samples", samples, 2) > most:
            raise ValueError(f"samples must be at most {most} for these data; found {samples}")
        migration = self._migrated(velocity)
        start = self._samples // 2 - samples // 2
        m = fast_length(samples + 2 * GUARD)
        # the patch comes first, then the guard behind it and, from the end, that in front of it
        behind = (m - samples) // 2
        place = np.r_[: samples + behind, samples + behind - m : 0]
        outside = np.abs(place - np.clip(place, 0, samples - 1))
        fading = np.cos(np.pi / 2 * outside / (behind + 1)).astype(np.float32) ** 2
        column = (start + place) % len(self._f_R)
        part = copy(self)
        part._samples, part._near_range = samples, self._near_range + start * self.range_spacing
        part._f_R = fft.fftfreq(m, 1 / self._sampling)
        part._removed = velocity
        part._spectrum = np.empty((len(self._f), m), np.complex64)

        def cut(lines: slice) -> None:
            data = self._straightened(migration, lines)[:, column]
            part._spectrum[lines] = fft.fft(data * fading, axis=1, overwrite_x=True)

        most = lines_at_once(self._f, (migration, self._f_R))
        in_threads(cut, blocks(len(self._f), most))
        return part

    def _band(self, bandwidth: float | None, centroid: float) -> tuple[Array, Array]:
        """Which frequencies of the transform are processed, in order, and what they are, Hz."""
        if bandwidth is not None and not 0 < bandwidth <= self._prf:
            raise ValueError(f"bandwidth must be in (0, {self._prf}] Hz; found {bandwidth}")
        f = fft.fftfreq(self._n, 1 / self._prf)
        f = centroid + (f - centroid + self._prf / 2) % self._prf - self._prf / 2
        half = (bandwidth or 1.01 * self._prf) / 2
        kept = np.flatnonzero(np.abs(f - centroid) <= half)
        kept = kept[np.argsort(f[kept])]  # neighbours in frequency, as the blocks need them
        return kept, f[kept]

    def _migrated(self, velocity: float) -> Phase:
        """A(f_t, f_R): removes the migration and secondary range compression that are left."""
        least = self._wavelength * np.abs(self._f).max() / 2
        if not (np.isfinite(velocity) and velocity > 2 * least):
            raise ValueError(
                f"velocity must be finite and above {2 * least:.0f} m/s; found {velocity}"
            )
        carrier = c / self._wavelength
        scale = 4 * np.pi / c * self.centre_range if self._migration else 0.0

        def removing(f: Array, f_R: Array, velocity: float) -> Array:
            D = np.sqrt(1 - (self._wavelength * f / (2 * velocity)) ** 2)
            whole = np.sqrt((carrier + f_R) ** 2 - (c * f / (2 * velocity)) ** 2)
            return scale * (whole - carrier * D - f_R)

        whole_swath = removing(np.zeros((1, 1)), self._f_R, np.inf)  # at any frequency the same

        def phase(f: Array, f_R: Array) -> Array:
            if np.isinf(self._removed) and f_R is self._f_R:
                return removing(f, f_R, velocity) - whole_swath
            return removing(f, f_R, velocity) - removing(f, f_R, self._removed)

        return phase

    def _straightened(self, migration: Phase, lines: slice) -> Array:
        """Ranges of a block of lines, of which migration is removed."""
        data = phasor(migration, self._f[lines], self._f_R)
        data *= self._spectrum[lines]
        return fft.ifft(data, axis=1, overwrite_x=True)


def _matched(raw: RawData, m: int) -> Array:
    """Conjugate spectrum of the sampled chirp, (m,), of unit energy."""
    t = np.arange(m) / raw.sampling
    phase = np.pi * raw.chirp_rate * (t - raw.pulse_length / 2) ** 2
    chirp = np.where(t < raw.pulse_length, np.exp(1j * phase), 0)
    return (np.conj(fft.fft(chirp)) / np.linalg.norm(chirp)).astype(np.complex64)
