"""Raw stripmap data to an image: range-Doppler processing for an assumed velocity.

The processor knows the header of the data and the velocity it assumes, nothing of the flight: the
range of a point is taken to be the hyperbola R^2 = R_0^2 + V^2 t^2.
"""

from typing import NamedTuple, Protocol

import numpy as np
from scipy import fft
from scipy.constants import c
from scipy.ndimage import map_coordinates

from navfilters import validation
from navfilters.types import Array


class RawData(Protocol):
    """What the processor asks of raw data; all are attributes."""

    @property
    def samples(self) -> Array:
        """Demodulated echoes, (pulses, ranges), complex."""

    @property
    def wavelength(self) -> float:
        """Of the carrier, m."""

    @property
    def sampling(self) -> float:
        """Complex samples in a second, Hz."""

    @property
    def prf(self) -> float:
        """Pulses in a second, Hz."""

    @property
    def pulse_length(self) -> float:
        """Of the chirp, s."""

    @property
    def chirp_rate(self) -> float:
        """Of the chirp, Hz/s, negative if its frequency falls."""

    @property
    def near_range(self) -> float:
        """Slant range of the first sample, m."""

    @property
    def first_time(self) -> float:
        """Of the first pulse, s."""


def effective_velocity(r: Array, v: Array, r_f: Array, acceleration: Array) -> Array:
    """The velocity of the hyperbola that a point's range follows, where the point is closest.

    V^2 = (R^2)'' / 2 = norm(v)^2 + (r - r_f) . a

    Parameters
    ----------
    r, v, acceleration : array (..., 3)
        Of the antenna, Earth-fixed, m, m/s, m/s^2.
    r_f : array (..., 3)
        The point, Earth-fixed, m.

    Returns
    -------
    array (...)
        m/s.

    Notes
    -----
    It is less than the in-track velocity, by 5 % in a low orbit, because the path is curved and the
    ground is closer to the centre of the curve.
    """
    return np.sqrt(np.sum(v * v + (r - r_f) * acceleration, axis=-1))


class Image(NamedTuple):
    """A single-look complex image.

    Parameters
    ----------
    pixels : array (lines, samples) of complex64
        One line for each pulse, in zero-Doppler time.
    first_time : float
        Of the first line, s.
    prf : float
        Lines in a second, Hz.
    near_range : float
        Slant range of the first sample, m: r_0.
    range_spacing : float
        dr, m.

    References
    ----------
    pogorelsky2020, Eqs. (1), (2).
    """

    pixels: Array
    first_time: float
    prf: float
    near_range: float
    range_spacing: float

    @property
    def centre_range(self) -> float:
        """Slant range of the centre pixel, r_0 + (k_c - 1) dr, m. Eq. (1), which counts from 1."""
        return self.near_range + self.pixels.shape[1] // 2 * self.range_spacing

    @property
    def centre_time(self) -> float:
        """Zero-Doppler time of the centre pixel, s."""
        return self.first_time + self.pixels.shape[0] // 2 / self.prf


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
        if bandwidth is not None and not 0 < bandwidth <= raw.prf:
            raise ValueError(f"bandwidth must be in (0, {raw.prf}] Hz; found {bandwidth}")
        self._raw = raw
        self._lines, self._samples = lines or pulses, samples or whole
        self._first = (pulses - self._lines) // 2
        self._migration = migration
        self._n, m = fft.next_fast_len(pulses), fft.next_fast_len(ranges)
        f = fft.fftfreq(self._n, 1 / raw.prf)
        f = doppler_centroid + (f - doppler_centroid + raw.prf / 2) % raw.prf - raw.prf / 2
        half = (bandwidth or 1.01 * raw.prf) / 2
        self._kept = np.flatnonzero(np.abs(f - doppler_centroid) <= half)
        self._f, self._f_R = f[self._kept], fft.fftfreq(m, 1 / raw.sampling)
        spectrum = fft.fft(data.astype(np.complex64, copy=False), m, axis=1, workers=2)
        spectrum *= _matched(raw, m)
        spectrum = fft.fft(spectrum, self._n, axis=0, workers=2, overwrite_x=True)
        self._spectrum = spectrum[self._kept]

    @property
    def range_spacing(self) -> float:
        """dr = c / (2 f_s), m. Eq. (2)."""
        return c / (2 * self._raw.sampling)

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
        raw, f = self._raw, self._f
        least = raw.wavelength * np.abs(f).max() / 2
        if not (np.isfinite(velocity) and velocity > 2 * least):
            raise ValueError(
                f"velocity must be finite and above {2 * least:.0f} m/s; found {velocity}"
            )
        middle = self._samples // 2
        R_mid = raw.near_range + middle * self.range_spacing
        data = fft.ifft(self._straightened(velocity, R_mid), axis=1, workers=2, overwrite_x=True)
        offset = self.range_spacing * (np.arange(self._samples) - middle)

        def filter_phase(distance: float) -> Array:
            squared = velocity**2 + slope * distance
            D = np.sqrt(1 - (raw.wavelength * f / 2) ** 2 / squared)
            return 4 * np.pi / raw.wavelength * (R_mid + distance) * (D - 1)

        reach = 1000.0  # the phase is linear in range to 1e-3 rad over tens of kilometres
        by_range = (filter_phase(reach) - filter_phase(-reach)) / (2 * reach)
        padded = np.zeros((self._n, self._samples), np.complex64)
        padded[self._kept] = data[:, : self._samples] * _ramp(by_range, offset)
        padded[self._kept] *= np.exp(1j * filter_phase(0.0)).astype(np.complex64)[:, None]
        focused = fft.ifft(padded, axis=0, workers=2, overwrite_x=True)
        pixels = focused[self._first : self._first + self._lines]
        return Image(
            pixels,
            raw.first_time + self._first / raw.prf,
            raw.prf,
            raw.near_range,
            self.range_spacing,
        )

    def _straightened(self, velocity: float, slant_range: float) -> Array:
        """The spectrum with migration and secondary range compression removed."""
        if not self._migration:
            return self._spectrum.copy()
        carrier = c / self._raw.wavelength
        # sqrt((f_0 + f_R)^2 - (c f_t / 2V)^2) - f_0 D - f_R, in powers of f_R
        D = np.sqrt(1 - (self._raw.wavelength * self._f / (2 * velocity)) ** 2)
        first = 1 / D - 1
        second = (1 - 1 / D**2) / (2 * carrier * D)
        third = -second / (carrier * D**2)
        powers = np.stack([self._f_R, self._f_R**2, self._f_R**3])
        scale = 4 * np.pi * slant_range / c
        phase = (np.stack([first, second, third], axis=1) * scale) @ powers
        return self._spectrum * _unit(phase.astype(np.float32))


def _matched(raw: RawData, m: int) -> Array:
    """Conjugate spectrum of the sampled chirp, (m,), of unit energy."""
    t = np.arange(m) / raw.sampling
    phase = np.pi * raw.chirp_rate * (t - raw.pulse_length / 2) ** 2
    chirp = np.where(t < raw.pulse_length, np.exp(1j * phase), 0)
    return (np.conj(fft.fft(chirp)) / np.linalg.norm(chirp)).astype(np.complex64)


def _unit(phase: Array) -> Array:
    """exp(i phase) in single precision."""
    z = np.empty(phase.shape, np.complex64)
    np.cos(phase, out=z.real)
    np.sin(phase, out=z.imag)
    return z


def _ramp(rate: Array, offset: Array, block: int = 32) -> Array:
    """exp(i rate offset) for evenly spaced offsets, (n, m), as products of few exponentials."""
    coarse = _unit(np.outer(rate, offset[::block]).astype(np.float32))
    fine = _unit(np.outer(rate, offset[:block] - offset[0]).astype(np.float32))
    product = coarse[:, :, None] * fine[:, None, :]
    return product.reshape(len(rate), -1)[:, : len(offset)]


def multilook(image: Image, azimuth: int = 4, in_range: int = 2) -> Array:
    """Mean intensity of neighbouring pixels.

    Parameters
    ----------
    image : Image
    azimuth, in_range : int
        How many lines and samples become one; by default the "2 x 4 looks" that make PALSAR's pixel
        13 m by 15 m on the ground. What is left over at the far ends is cut off.

    Returns
    -------
    ndarray (lines // azimuth, samples // in_range) of float32

    Raises
    ------
    ValueError
        Numbers that are not integers of at least 1, or exceed the image.
    """
    shape = image.pixels.shape
    for name, value, most in (("azimuth", azimuth, shape[0]), ("in_range", in_range, shape[1])):
        if validation.whole_number(name, value, 1) > most:
            raise ValueError(f"{name} must be at most {most} for this image; found {value}")
    rows, columns = shape[0] // azimuth, shape[1] // in_range
    cut = image.pixels[: rows * azimuth, : columns * in_range]
    power = cut.real**2 + cut.imag**2
    return power.reshape(rows, azimuth, columns, in_range).mean(axis=(1, 3))


def decibels(power: Array) -> Array:
    """Logarithmic scale, 10 log10.

    Parameters
    ----------
    power : array (...)
        Not negative. Zeros become as dark as the darkest that is not.

    Returns
    -------
    ndarray (...)
        dB.

    Raises
    ------
    ValueError
        Nothing above zero.
    """
    power = np.asarray(power)
    bright = power > 0
    if not bright.any():
        raise ValueError("power must be positive somewhere; found none above zero")
    return 10 * np.log10(np.where(bright, power, power[bright].min()))


class GroundImage(NamedTuple):
    """An image on the ground, as seen from above: the radar flew upwards on its left.

    Parameters
    ----------
    values : array (rows, columns) of float32
        dB; rows from late to early, columns away from the radar.
    pixel : float
        Side of a pixel, m.
    centre : tuple of int
        Row and column of what was the centre pixel of the image, exactly.
    incidence : float
        At the centre, rad.
    """

    values: Array
    pixel: float
    centre: tuple[int, int]
    incidence: float


def to_ground(
    image: Image,
    *,
    incidence: float,
    ground_speed: float,
    looks: tuple[int, int] = (4, 2),
    pixel: float = 10.0,
    radius: float = 6.371e6,
) -> GroundImage:
    """Multilooked, in dB, resampled to square pixels on ground of constant height.

    R(g)^2 = R_c^2 + 2 R_c g sin(theta) + g^2 (1 + R_c cos(theta) / radius),   t(s) = s / speed

    Parameters
    ----------
    image : Image
    incidence : float
        theta, at the centre pixel, rad.
    ground_speed : float
        Of the line across the flight on the ground, about V_eff^2 / norm(v), m/s.
    looks : tuple of int
        In azimuth and in range.
    pixel : float
        m.
    radius : float
        Of the Earth, m.

    Returns
    -------
    GroundImage
        Terrain that is higher than the centre lies closer to the radar in it than in truth. Lines
        of equal time are drawn square to the flight: on the turning Earth they are sheared, by
        0.5 % at most.

    Raises
    ------
    ValueError
        Naming the argument, the value found and what is needed.
    """
    if not 0 < incidence < np.pi / 2:
        raise ValueError(f"incidence must be between 0 and pi/2 rad; found {incidence}")
    for name, value in (("ground_speed", ground_speed), ("pixel", pixel), ("radius", radius)):
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name} must be a positive number; found {value}")
    power = multilook(image, *looks)
    lines, samples = image.pixels.shape
    dR, R_c = image.range_spacing, image.centre_range
    rows = int(0.495 * lines / image.prf * ground_speed / pixel)
    columns = int(0.495 * samples * dR / np.sin(incidence) / pixel)
    along = pixel * np.arange(rows, -rows - 1, -1)
    across = pixel * np.arange(-columns, columns + 1)
    bend = 1 + R_c * np.cos(incidence) / radius
    distance = np.sqrt(R_c**2 + 2 * R_c * np.sin(incidence) * across + bend * across**2)
    line = lines // 2 + along / ground_speed * image.prf
    sample = samples // 2 + (distance - R_c) / dR
    # a multilooked pixel is at the mean index of those in it
    where = [(line - (looks[0] - 1) / 2) / looks[0], (sample - (looks[1] - 1) / 2) / looks[1]]
    grid = np.meshgrid(*where, indexing="ij")
    values = map_coordinates(decibels(power), grid, order=1, mode="nearest")
    return GroundImage(values.astype(np.float32), pixel, (rows, columns), incidence)
