"""The processor's pixels: the equations, energy, patches, memory, and what is refused."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from focused_points import (
    compressed,
    cut,
    hyperbola,
    noise,
    response,
    velocity_at,
)
from numpy.testing import assert_allclose, assert_array_equal
from scipy.constants import c
from scipy.fft import next_fast_len

from navfilters.sar.images.focuser import GUARD, Focuser
from navfilters.sar.images.slant_image import effective_velocity
from navfilters.sar.raw.echoes_of_points import point_echo
from navfilters.sar.raw.observation import centred_window
from navfilters.sar.raw.radar import PALSAR, receive


def ground(**options):
    """Raw data of ground, each range of which sends the pulse back with a random amplitude."""
    raw = noise(**options)
    t = np.arange(raw.samples.shape[1]) / raw.sampling
    phase = np.pi * raw.chirp_rate * (t - raw.pulse_length / 2) ** 2
    chirp = np.where(t < raw.pulse_length, np.exp(1j * phase), 0)
    samples = np.fft.ifft(np.fft.fft(raw.samples, axis=1) * np.fft.fft(chirp), axis=1)
    return replace(raw, samples=samples.astype(np.complex64))


def kept(raw, bandwidth, centroid=0.0):
    """Doppler frequencies of the pulses' spectrum, Hz, and which are processed."""
    f = np.fft.fftfreq(len(raw.samples), 1 / raw.prf)
    f = f + raw.prf * np.round((centroid - f) / raw.prf)
    return f, np.abs(f - centroid) <= bandwidth / 2


@pytest.mark.parametrize(("pulses", "ranges"), [(2048, 512), (120, 512)])
@pytest.mark.parametrize("centroid", [0.0, -700.0])
@pytest.mark.parametrize(("velocity", "slope"), [(7182.0, -1.86), (7000.0, 30.0)])
def test_pixels_are_those_of_the_equations(pulses, ranges, centroid, velocity, slope):
    """In double precision, without series or interpolation, at every range: to 2e-5 of the peak."""
    raw, samples, bandwidth = noise(pulses=pulses, ranges=ranges), 301, 1710.0
    pixels = (
        Focuser(raw, samples=samples, bandwidth=bandwidth, doppler_centroid=centroid)
        .image(velocity, slope)
        .pixels
    )
    f, processed = kept(raw, bandwidth, centroid)
    f, f_0, f_R = f[:, None], c / raw.wavelength, np.fft.fftfreq(ranges, 1 / raw.sampling)
    dR = c / (2 * raw.sampling)
    distance = dR * (np.arange(samples) - samples // 2)
    R_mid = raw.near_range + samples // 2 * dR
    D = np.sqrt(1 - (raw.wavelength * f / (2 * velocity)) ** 2)
    A = np.sqrt((f_0 + f_R) ** 2 - (c * f / (2 * velocity)) ** 2) - f_0 * D - f_R
    spectrum = np.fft.fft(compressed(raw), axis=1) * np.exp(4j * np.pi * R_mid / c * A)
    D = np.sqrt(1 - (raw.wavelength * f / 2) ** 2 / (velocity**2 + slope * distance))
    turn = np.exp(4j * np.pi / raw.wavelength * (R_mid + distance) * (D - 1))
    lines = np.where(processed[:, None], np.fft.ifft(spectrum, axis=1)[:, :samples] * turn, 0)
    wanted = np.fft.ifft(lines, axis=0)
    assert_allclose(pixels, wanted, rtol=0, atol=2e-5 * np.abs(wanted).max())


@pytest.mark.parametrize("bandwidth", [1000.0, 2150.0])
def test_energy_of_each_range(bandwidth):
    """Parseval: the azimuth filter turns phases, so the energy is that of the processed band."""
    raw = noise()
    pixels = Focuser(raw, samples=300, bandwidth=bandwidth, migration=False).image(7182.0).pixels
    spectrum = compressed(replace(raw, samples=np.pad(raw.samples, ((0, 0), (0, 12)))))
    band = spectrum[kept(raw, bandwidth)[1], :300]
    wanted = np.sum(np.abs(band) ** 2, axis=0) / len(raw.samples)
    assert_allclose(np.sum(np.abs(pixels.astype(complex)) ** 2, axis=0), wanted, rtol=2e-6)


def test_energy_is_kept_by_all_steps():
    """Of data that stay inside the image; noise passes the pulse's filter with a gain of 1.

    The sidelobes of what migration moves by a part of a sample leave the image: 1e-4 of the energy.
    """
    raw = noise(ranges=512, first=128 + 40, last=384 - 40)
    image = Focuser(raw, bandwidth=1000.0).image(7182.0)
    assert image.pixels.shape == (2048, 384)
    inside = kept(raw, 1000.0)[1]
    wanted = np.sum(np.abs(compressed(raw)[inside]) ** 2) / 2048
    got = np.sum(np.abs(image.pixels.astype(complex)) ** 2)
    assert_allclose(got, wanted, rtol=1e-4)
    everywhere = noise(ranges=512)
    pixels = Focuser(everywhere, bandwidth=1000.0).image(7182.0).pixels
    share = inside.sum() / 2048  # of 3.7e5 independent pixels: a deviation of 2e-3
    assert_allclose(np.mean(np.abs(pixels) ** 2), share, rtol=0.01)


def test_corners_are_as_sharp_as_the_centre(setup, flight, hit, small):
    """Of an image of full size: place, height and widths, with the slope of the velocity."""
    lines, samples, dR = 2048, 1024, small.range_spacing
    window = centred_window(small, flight, hit, lines, samples)
    t, R = (float(a) for a in flight.closest(hit))
    places = [(i, j) for i in (64, lines - 64) for j in (48, samples - 48)]
    places.append((lines // 2, samples // 2))
    points = [
        flight.ground_point(t + (i - lines // 2) / small.prf, R + (j - samples // 2) * dR, 0.0)
        for i, j in places
    ]
    echo = sum(point_echo(small, flight, p, window) for p in points)
    ends = [flight.ground_point(t, R + d, 0.0) for d in (-2000.0, 2000.0)]
    r, v = flight.position(t), flight.velocity(t)
    a = setup.orbit.acceleration(np.concatenate([r, v]))
    slope = np.diff([effective_velocity(r, v, p, a) ** 2 for p in ends])[0] / 4000.0
    focuser = Focuser(receive(small, window, echo), lines=lines, samples=samples)
    pixels = focuser.image(velocity_at(setup, flight, hit), slope).pixels

    def around(i, j, reach=40):
        cell = pixels[i - reach : i + reach, j - reach : j + reach]
        down, along = response(cell[:, reach]), response(cell[reach])
        return (down[0] - reach, along[0] - reach, cut(cell[:, reach]).max(), down[1], along[1])

    *corners, centre = [np.array(around(*place)) for place in places]
    for corner in corners:
        assert_allclose(corner[:2], 0.0, atol=0.03)
        assert_allclose(corner[2:] / centre[2:], 1.0, rtol=0.02)


@pytest.mark.parametrize("phi", [0.7, -2.5])
def test_a_constant_phase_stays(phi):
    raw = noise()
    turned = replace(raw, samples=raw.samples * np.exp(1j * phi).astype(np.complex64))
    one, other = (Focuser(data, samples=200).image(7182.0).pixels for data in (raw, turned))
    assert_allclose(other, one * np.exp(1j * phi), rtol=0, atol=1e-6 * np.abs(one).max())


@pytest.mark.parametrize("samples", [64, 101])
@pytest.mark.parametrize("change", [0.0, 6.0, 60.0, -40.0])
def test_a_patch_is_the_middle_of_the_image(samples, change):
    """To 0.5 % of the samples by which the migrations, some 18, of the two velocities differ.

    The pulse is PALSAR's: the spectrum of a short one reaches the edges of the band, where a shift
    by a part of a sample is nothing local.
    """
    raw = ground(pulses=1024, ranges=1300, radar=PALSAR)
    focuser = Focuser(raw, samples=257, bandwidth=1710.0)
    patch = focuser.patch(samples, 7182.0)
    whole, part = (f.image(7182.0 + change, -1.86) for f in (focuser, patch))
    start = 257 // 2 - samples // 2
    wanted = whole.pixels[:, start : start + samples]
    off = np.sqrt(np.mean(np.abs(part.pixels - wanted) ** 2, axis=0))
    off /= np.sqrt(np.mean(np.abs(wanted) ** 2))
    assert off.max() < 1e-5 + 0.005 * 18 * 2 * abs(change) / 7182
    assert_allclose(part.near_range, whole.near_range + start * whole.range_spacing, rtol=1e-12)
    assert part.first_time == whole.first_time


def test_a_patch_of_all_samples_is_the_focuser_itself():
    """Where the guard is as wide as the pulse that is cut off anyway."""
    focuser = Focuser(noise(pulses=64, radar=replace(PALSAR, pulse_length=2e-6)))
    assert focuser.samples + 2 * GUARD == 500
    assert focuser.patch(focuser.samples, 7182.0) is focuser


def test_a_patch_of_a_patch():
    """What the first has straightened is not straightened again."""
    focuser = Focuser(ground(), samples=301, bandwidth=1710.0)
    twice = focuser.patch(201, 7182.0).patch(65, 7182.0).image(7182.0)
    wanted = focuser.image(7182.0).pixels[:, 118:183]
    assert_allclose(twice.pixels, wanted, rtol=0, atol=1e-5 * np.abs(wanted).max())


@pytest.mark.parametrize(
    ("samples", "velocity", "message"),
    [
        (73, 7182.0, "samples must be at most 72"),
        (1, 7182.0, "samples must be an integer of at least 2"),
        (64, 50.0, "velocity must be finite and above"),
    ],
)
def test_patch_refuses(samples, velocity, message):
    with pytest.raises(ValueError, match=message):
        Focuser(hyperbola(7182.0)).patch(samples, velocity)


@pytest.mark.parametrize(
    "options",
    [
        {"bandwidth": 900.0},
        {"bandwidth": 1710.0, "doppler_centroid": 700.0},
        {"doppler_centroid": -3000.0},
        {"migration": False},
        {},
    ],
)
@pytest.mark.parametrize("first", [{}, {"doppler_centroid": 500.0, "migration": False}])
def test_otherwise_is_another_focuser_of_the_same_data(first, options):
    raw, size = noise(), {"lines": 512, "samples": 300}
    found = Focuser(raw, **size, **first).otherwise(**options).image(7182.0, -1.86)
    wanted = Focuser(raw, **size, **options).image(7182.0, -1.86)
    assert_array_equal(found.pixels, wanted.pixels)
    assert found[1:] == wanted[1:]


def test_otherwise_leaves_the_first_focuser_as_it_is():
    focuser = Focuser(ground(), samples=301, bandwidth=1710.0)
    before = focuser.image(7182.0).pixels
    focuser.otherwise(bandwidth=400.0, migration=False).image(7000.0)
    assert_array_equal(focuser.image(7182.0).pixels, before)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "bandwidth must stay within the band of this focuser; found None Hz about 0.0"),
        ({"bandwidth": 1000.0, "doppler_centroid": 1.0}, "found 1000.0 Hz about 1.0"),
        ({"bandwidth": 2151.0}, r"bandwidth must be in \(0, 2150.0\] Hz"),
    ],
)
def test_otherwise_refuses(options, message):
    with pytest.raises(ValueError, match=message):
        Focuser(hyperbola(7182.0), bandwidth=1000.0).otherwise(**options)


def test_a_patch_is_not_processed_otherwise():
    patch = Focuser(hyperbola(7182.0)).patch(64, 7182.0)
    with pytest.raises(ValueError, match="a patch must be taken of what is processed otherwise"):
        patch.otherwise(bandwidth=1000.0)


def in_arrays():
    """Bytes that arrays hold; what a tracer of coverage keeps for each thread is not theirs."""
    of_numpy = tracemalloc.DomainFilter(True, np.lib.tracemalloc_domain)
    snapshot = tracemalloc.take_snapshot().filter_traces([of_numpy])
    return sum(trace.size for trace in snapshot.traces)


def test_images_keep_and_take_no_more_memory_than_they_need():
    """At work: all lines of the image, and blocks; after twenty of them: nothing."""
    lines, samples = 512, 300
    focuser = Focuser(noise(), lines=lines, samples=samples)
    focuser.image(7182.0)
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        for i in range(20):
            image = focuser.image(7182.0 + i)
        most = tracemalloc.get_traced_memory()[1]
        kept = in_arrays()
    finally:
        tracemalloc.stop()
    assert image.pixels.base is None
    assert_allclose(kept, image.pixels.nbytes, rtol=0.01)
    padded = 8 * next_fast_len(2048) * samples
    assert most - before < padded + 2 * image.pixels.nbytes + 10 * 2**20  # of two blocks at work


def test_sizes_and_centre():
    raw = hyperbola(7182.0)
    image = Focuser(raw, lines=100, samples=50).image(7182.0)
    assert image.pixels.shape == (100, 50)
    assert image.pixels.dtype == np.complex64
    assert_allclose(image.first_time, -50 / raw.prf, atol=1e-12)
    assert_allclose(image.centre_range, raw.near_range + 25 * c / 64e6)
    assert Focuser(raw).image(7182.0).pixels.shape == (2048, 200 - 128)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"lines": 4000}, "lines must be at most 2048"),
        ({"samples": 73}, "samples must be at most 72"),
        ({"lines": 1}, "lines must be an integer of at least 2"),
        ({"bandwidth": 0.0}, r"bandwidth must be in \(0, 2150.0\] Hz"),
        ({"bandwidth": 2151.0}, "bandwidth must be in"),
    ],
)
def test_focuser_refuses(options, message):
    with pytest.raises(ValueError, match=message):
        Focuser(hyperbola(7182.0), **options)


@pytest.mark.parametrize(
    ("samples", "message"),
    [
        (np.zeros((9, 9)), "raw.samples must be a complex array"),
        (np.zeros(9, complex), "raw.samples must be a complex array"),
        (np.zeros((9, 128), complex), "raw.samples must hold a whole pulse"),
    ],
)
def test_focuser_refuses_data(samples, message):
    with pytest.raises(ValueError, match=message):
        Focuser(replace(hyperbola(7182.0), samples=samples))


@pytest.mark.parametrize("velocity", [0.0, 50.0, np.nan])
def test_velocity_must_fit_the_doppler_band(velocity):
    with pytest.raises(ValueError, match="velocity must be finite and above"):
        Focuser(hyperbola(7182.0)).image(velocity)
