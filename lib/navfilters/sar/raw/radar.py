"""A pulsed radar: what it sends, what it receives, and the window in which it listens."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from navfilters.types import Array

LIGHT = 299792458.0
"""Speed of light, m/s."""


@dataclass(frozen=True)
class Radar:
    """A stripmap radar; by default PALSAR's fine beam.

    Parameters
    ----------
    wavelength : float
        m.
    bandwidth : float
        Of the chirp, Hz.
    pulse_length : float
        s.
    sampling : float
        Complex samples in a second, Hz.
    prf : float
        Pulses in a second, Hz.
    antenna : float
        Length along the flight, m.
    squint : float
        Angle by which the beam looks ahead of the plane across the flight, deg: an antenna that is
        not where it should be. The pattern in elevation is left out, so no other angle matters.
    nesz : float
        Reflectivity that the thermal noise equals, dB of the scene's unit.
    falling : bool
        Whether the chirp's frequency falls, as PALSAR's does.

    Raises
    ------
    ValueError
        Naming the argument, the value found and what is needed.

    Notes
    -----
    Nothing is received from angles beyond +-wavelength / (2 antenna), where a uniform antenna's
    power has fallen by 3.9 dB one way: there are no azimuth ambiguities.

    References
    ----------
    pogorelsky2020, section "Closed-loop trajectory and SAR data": ALOS PALSAR, without parameters.
    """

    wavelength: float = 0.2360571
    bandwidth: float = 28e6
    pulse_length: float = 27e-6
    sampling: float = 32e6
    prf: float = 2150.0
    antenna: float = 8.9
    squint: float = 0.0
    nesz: float = -23.0
    falling: bool = True

    def __post_init__(self) -> None:
        for name in ("wavelength", "bandwidth", "pulse_length", "sampling", "prf", "antenna"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"{name} must be a positive number; found {value}")
        if self.bandwidth > self.sampling:
            raise ValueError(
                f"sampling must be at least the bandwidth, {self.bandwidth} Hz; found "
                f"{self.sampling}"
            )
        if not abs(self.squint) < 5:
            raise ValueError(f"squint must be less than 5 deg either way; found {self.squint}")
        if np.isnan(self.nesz):
            raise ValueError(f"nesz must be a number of dB, or -inf; found {self.nesz}")

    @property
    def range_spacing(self) -> float:
        """Slant range between samples, m."""
        return LIGHT / (2 * self.sampling)

    @property
    def chirp_rate(self) -> float:
        """Hz/s, negative if the frequency falls."""
        return (-1 if self.falling else 1) * self.bandwidth / self.pulse_length

    @property
    def chirp_samples(self) -> int:
        """Samples that a pulse covers."""
        return int(np.ceil(self.pulse_length * self.sampling))

    def pattern(self, sine: Array) -> Array:
        """Amplitude there and back, 1 at the middle of the beam.

        Parameters
        ----------
        sine : array (...)
            Of the angle ahead of the plane across the flight.

        Returns
        -------
        ndarray (...)
        """
        u = self.antenna / self.wavelength * (np.asarray(sine) - np.sin(np.deg2rad(self.squint)))
        return np.where(np.abs(u) <= 0.5, np.sinc(u) ** 2, 0.0)


PALSAR = Radar()
"""The fine beam of ALOS."""


@dataclass(frozen=True, eq=False)
class Raw:
    """Raw data, and what a processor is told of them.

    Parameters
    ----------
    samples : array (pulses, ranges) of complex64
        Demodulated from the carrier.
    wavelength, sampling, prf, pulse_length : float
        m, Hz, Hz, s: see ``Radar``.
    chirp_rate : float
        Hz/s, negative if the frequency falls.
    near_range : float
        Of the first sample, if a pulse is taken to leave at time 0, m.
    first_time : float
        Of the first pulse, from the flight's epoch, s.
    """

    samples: Array
    wavelength: float
    sampling: float
    prf: float
    pulse_length: float
    chirp_rate: float
    near_range: float
    first_time: float


class Window(NamedTuple):
    """Which pulses and ranges are received.

    Parameters
    ----------
    first_time : float
        Of the first pulse, s.
    pulses, ranges : int
    near_range : float
        Of the first sample, m.
    """

    first_time: float
    pulses: int
    ranges: int
    near_range: float


def receive(radar: Radar, window: Window, samples: Array) -> Raw:
    """Raw data with the header that goes with them.

    Parameters
    ----------
    radar : Radar
    window : Window
    samples : array (pulses, ranges) of complex

    Returns
    -------
    Raw
    """
    return Raw(
        samples,
        radar.wavelength,
        radar.sampling,
        radar.prf,
        radar.pulse_length,
        radar.chirp_rate,
        window.near_range,
        window.first_time,
    )
