"""Raw data of points, by the library and by the textbook, and their responses."""

import numpy as np
from scipy.constants import c

from navfilters.sar.images.focuser import Focuser
from navfilters.sar.images.slant_image import effective_velocity
from navfilters.sar.raw.echoes_of_points import point_echo
from navfilters.sar.raw.observation import centred_window
from navfilters.sar.raw.radar import Radar, Raw, receive


class FlatBeam(Radar):
    """An antenna that is uniform over the illuminated angle, as the theory of resolution has it."""

    def pattern(self, sine):
        return np.where(super().pattern(sine) > 0, 1.0, 0.0)


LONG = FlatBeam(wavelength=0.059)  # the pulse of PALSAR, a quarter of its aperture


def hyperbola(V, *, R_0=866e3, at=0.0, seen=(-0.42, 0.42), pulses=2048, ranges=200, radar=None):
    """Raw data of a point by the textbook, independent of the flight and the echo module."""
    radar = radar or Radar(wavelength=0.059, pulse_length=4e-6)
    t = (np.arange(pulses) - pulses // 2) / radar.prf
    near, rate = R_0 - 32 * c / (2 * radar.sampling), radar.bandwidth / radar.pulse_length
    R = np.sqrt(R_0**2 + V**2 * (t - at) ** 2)
    into = np.arange(ranges) / radar.sampling + 2 * (near - R[:, None]) / c
    inside = (into >= 0) & (into < radar.pulse_length)
    lit = (t - at >= seen[0]) & (t - at <= seen[1])
    phase = np.pi * rate * (into - radar.pulse_length / 2) ** 2
    phase = phase - 4 * np.pi * R[:, None] / radar.wavelength
    samples = np.where(inside & lit[:, None], np.exp(1j * phase), 0).astype(np.complex64)
    return Raw(
        samples, radar.wavelength, radar.sampling, radar.prf, radar.pulse_length, rate, near, t[0]
    )


def cut(line, oversampling=32):
    """Amplitude along a line, interpolated by zero-padding the spectrum."""
    n = len(line)
    F = np.fft.fftshift(np.fft.fft(line))
    padded = np.zeros(n * oversampling, complex)
    middle = len(padded) // 2
    padded[middle - n // 2 : middle - n // 2 + n] = F
    return np.abs(np.fft.ifft(np.fft.ifftshift(padded))) * oversampling


def response(line, oversampling=32):
    """Peak's place, width at -3 dB, peak and integrated sidelobe ratios within 10 widths."""
    a = cut(line, oversampling)
    peak = int(a.argmax())
    y0, y1, y2 = a[peak - 1 : peak + 2]
    place = (peak + 0.5 * (y0 - y2) / (y0 - 2 * y1 + y2)) / oversampling
    half = a.max() / np.sqrt(2)
    right = peak + int(np.argmax(a[peak:] < half))
    left = peak - int(np.argmax(a[peak::-1] < half))
    width = right - (half - a[right]) / (a[right - 1] - a[right])
    width -= left + (half - a[left]) / (a[left + 1] - a[left])
    rising = np.diff(a)
    first = peak + int(np.argmax(rising[peak:] > 0))
    last = peak - int(np.argmax(-rising[peak - 1 :: -1] > 0))
    reach = round(10 * width)
    main = np.sum(a[last : first + 1] ** 2)
    near = a[peak - reach : peak + reach + 1]
    sides = np.concatenate([a[peak - reach : last], a[first : peak + reach + 1]])
    peak_ratio = 20 * np.log10(sides.max() / a.max())
    return place, width / oversampling, peak_ratio, 10 * np.log10(np.sum(near**2) / main - 1)


def point(radar, flight, hit, lines=128, samples=64, **options):
    window = centred_window(radar, flight, hit, lines, samples)
    raw = receive(radar, window, point_echo(radar, flight, hit, window))
    return Focuser(raw, lines=lines, samples=samples, **options)


def velocity_at(setup, flight, p):
    t, _ = flight.closest(p)
    r, v = flight.position(t), flight.velocity(t)
    return effective_velocity(r, v, p, setup.orbit.acceleration(np.concatenate([r, v])))


def sinc_response(occupied):
    """The response of a flat spectrum that fills this part of the samples' band."""
    n = 512
    k = np.fft.fftfreq(n)
    return response(np.roll(np.fft.ifft(np.where(np.abs(k) <= occupied / 2, 1.0, 0.0)), n // 2))


def noise(*, pulses=2048, ranges=500, first=0, last=None, radar=None):
    """Raw data of white noise, of deviation 1, in some of the ranges."""
    radar = radar or Radar(wavelength=0.236, pulse_length=4e-6)
    z = np.random.default_rng(5).standard_normal((pulses, ranges, 2)) / np.sqrt(2)
    samples = np.zeros((pulses, ranges), np.complex64)
    samples[:, first:last] = z.view(complex)[:, first:last, 0]
    rate = radar.bandwidth / radar.pulse_length
    return Raw(
        samples, radar.wavelength, radar.sampling, radar.prf, radar.pulse_length, rate, 860e3, 0.0
    )


def compressed(raw):
    """Doppler spectrum of the compressed ranges, (pulses, ranges), in double precision."""
    t = np.arange(raw.samples.shape[1]) / raw.sampling
    phase = np.pi * raw.chirp_rate * (t - raw.pulse_length / 2) ** 2
    chirp = np.where(t < raw.pulse_length, np.exp(1j * phase), 0)
    spectrum = np.fft.fft(raw.samples.astype(complex), axis=1)
    spectrum *= np.conj(np.fft.fft(chirp)) / np.linalg.norm(chirp)
    return np.fft.fft(np.fft.ifft(spectrum, axis=1), axis=0)
