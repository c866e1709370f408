"""What a focuser asks of raw data."""

from typing import Protocol

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
