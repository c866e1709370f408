"""The processor against theory: point response, position, velocity, migration, projection."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.constants import c
from scipy.fft import next_fast_len

from navfilters.papers.pogorelsky2020.experiment import NOMINAL
from navfilters.papers.pogorelsky2020.true_flight import truth
from navfilters.sar.images.autofocusing import sharpness
from navfilters.sar.images.focuser import Focuser
from navfilters.sar.images.ground_image import decibels, multilook, to_ground
from navfilters.sar.images.slant_image import Image, effective_velocity
from navfilters.sar.raw.echoes_of_points import point_echo
from navfilters.sar.raw.flight import view_of
from navfilters.sar.raw.observation import centred_window
from navfilters.sar.raw.radar import PALSAR, Radar, Raw, receive
from navfilters.space.frames import east_north_up, ecef_to_geodetic, ellipsoid_intersection


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


def test_effective_velocity_is_the_range_s_curvature(setup, flight, hit):
    t, _ = flight.closest(hit)
    h = 0.05
    squared = [np.sum((hit - flight.position(t + s * h)) ** 2) for s in (-2, -1, 0, 1, 2)]
    second = np.dot([-1, 16, -30, 16, -1], squared) / (12 * h * h)
    assert_allclose(velocity_at(setup, flight, hit), np.sqrt(second / 2), rtol=1e-6)


def test_velocity_of_the_paper(setup):
    """7182.48 m/s at the start; it changes by 1.054 of a change of the in-track velocity."""
    known = truth(setup, 1)
    x = known.x[0]
    beam = replace(setup.geometry, T_e_b=known.T_e_b[0]).boresight(NOMINAL)
    p = ellipsoid_intersection(x[:3], beam)

    def V(stretch):
        v = x[3:] * stretch
        a = setup.orbit.acceleration(np.concatenate([x[:3], v]))
        return effective_velocity(x[:3], v, p, a)

    assert_allclose(V(1.0), 7182.48, atol=0.01)
    change = (V(1 + 1e-4) - V(1 - 1e-4)) / (2e-4 * np.linalg.norm(x[3:]))
    assert_allclose(change, 1.054, atol=1e-3)


def test_range_response(setup, flight, hit):
    """A flat spectrum of 28 in 32 MHz: 0.886 c / 2B, -13.3 dB, position to 0.01 samples."""
    image = point(LONG, flight, hit).image(velocity_at(setup, flight, hit))
    line = image.pixels[64]
    place, width, peak_ratio, side_ratio = response(line)
    assert_allclose(place, 32.0, atol=0.02)
    assert_allclose(width * image.range_spacing, 0.886 * c / (2 * 28e6), rtol=0.02)
    assert_allclose(peak_ratio, -13.26, atol=0.5)
    theory = sinc_response(28 / 32)
    assert_allclose(side_ratio, theory[3], atol=0.6)


def test_azimuth_response(setup, flight, hit):
    """Uniform illumination over the Doppler band 2 V_sat / L: 0.886 L / 2 on the orbit."""
    image = point(LONG, flight, hit).image(velocity_at(setup, flight, hit))
    place, width, peak_ratio, side_ratio = response(image.pixels[:, 32])
    speed = np.linalg.norm(flight.velocity(0.0))
    assert_allclose(place, 64.0, atol=0.02)
    assert_allclose(width / LONG.prf * speed, 0.886 * LONG.antenna / 2, rtol=0.02)
    assert_allclose(peak_ratio, -13.26, atol=0.5)
    assert_allclose(side_ratio, sinc_response(2 * speed / LONG.antenna / LONG.prf)[3], atol=0.6)


def test_palsar_response(setup, flight, hit):
    """With the antenna's pattern: the spectrum is the pattern, so is the response."""
    image = point(PALSAR, flight, hit, 128, 32).image(velocity_at(setup, flight, hit))
    assert np.unravel_index(np.abs(image.pixels).argmax(), image.pixels.shape) == (64, 16)
    place, width, peak_ratio, side_ratio = response(image.pixels[:, 16])
    band = 2 * np.linalg.norm(flight.velocity(0.0)) / PALSAR.antenna / PALSAR.prf
    k = np.fft.fftfreq(512)
    spectrum = np.where(np.abs(k) < band / 2, np.sinc(k / band) ** 2, 0.0)
    theory = response(np.roll(np.fft.ifft(spectrum), 256))
    assert_allclose(place, 64.0, atol=0.02)
    assert_allclose(width, theory[1], rtol=0.01)
    assert_allclose(peak_ratio, theory[2], atol=0.5)
    assert_allclose(side_ratio, theory[3], atol=0.6)
    assert_allclose(response(image.pixels[64])[0], 16.0, atol=0.02)


@pytest.mark.parametrize(("dt", "dR"), [(0.02, 100.0), (-0.021, -70.0)])
def test_position_of_points_off_the_grid(setup, flight, hit, small, dt, dR):
    t, R = (float(a) for a in flight.closest(hit))
    p = flight.ground_point(t + dt, R + dR, 0.0)
    window = centred_window(small, flight, hit, 128, 64)
    focuser = Focuser(
        receive(small, window, point_echo(small, flight, p, window)), lines=128, samples=64
    )
    image = focuser.image(velocity_at(setup, flight, hit))
    row, column = np.unravel_index(np.abs(image.pixels).argmax(), image.pixels.shape)
    line, sample = response(image.pixels[:, column])[0], response(image.pixels[row])[0]
    assert_allclose(image.first_time + line / image.prf, t + dt, atol=0.03 / image.prf)
    found = image.near_range + sample * image.range_spacing
    assert_allclose(found, R + dR, atol=0.03 * image.range_spacing)


def test_phase_is_that_of_the_range():
    """A point's phase is -4 pi R_0 / wavelength, its amplitude the root of the pulse's energy."""
    raw = hyperbola(7182.0)
    pixels = Focuser(raw).image(7182.0).pixels
    row, column = np.unravel_index(np.abs(pixels).argmax(), pixels.shape)
    assert (row, column) == (1024, 32)
    phase = np.angle(pixels[row, column] * np.exp(4j * np.pi * 866e3 / raw.wavelength))
    assert abs(phase + np.pi / 4) < 0.05  # of the azimuth chirp's spectrum


def test_wrong_velocity_blurs_and_only_blurs(small):
    focuser = Focuser(hyperbola(7182.0), samples=64)
    sharp, blurred = (focuser.image(7182.0 + dv).pixels for dv in (0.0, 120.0))
    assert response(blurred[:, 32])[1] > 2 * response(sharp[:, 32])[1]
    power = [np.abs(p) ** 2 for p in (sharp, blurred)]
    assert_allclose(power[0].sum(), power[1].sum(), rtol=1e-3)
    centre = [np.sum(p * np.arange(2048)[:, None]) / p.sum() for p in power]
    assert_allclose(centre[0], centre[1], atol=0.3)
    assert sharpness(power[0]) > 2 * sharpness(power[1])


def test_migration_must_be_corrected(flight, hit, setup):
    """18 cells of it: without correction the velocity hardly matters to the sharpness."""
    change = {}
    V = float(velocity_at(setup, flight, hit))
    for migration in (True, False):
        focuser = point(PALSAR, flight, hit, 128, 32, migration=migration)
        values = [sharpness(np.abs(focuser.image(V + dv).pixels) ** 2) for dv in (0.0, 15.0)]
        change[migration] = values[0] / values[1], values[0]
    assert change[True][0] > 3
    assert change[True][1] > 5 * change[False][1]


def test_slope_of_the_velocity_with_range():
    """A point 2.4 km from the middle is sharp when the slope carries its velocity to it."""
    focuser = Focuser(hyperbola(7190.0, ranges=1200))
    middle = (1200 - 128) // 2
    slope = (7190.0**2 - 7130.0**2) / ((32 - middle) * focuser.range_spacing)
    peaks = [
        np.abs(focuser.image(*assumed).pixels[:, 32]).max()
        for assumed in ((7190.0,), (7130.0, slope), (7130.0,))
    ]
    assert_allclose(peaks[1], peaks[0], rtol=0.01)
    assert peaks[2] < 0.9 * peaks[0]


@pytest.mark.parametrize(("seen", "centroid"), [((0.2, 0.5), -710.0), ((0.5, 0.8), -1315.0)])
def test_doppler_centroid(seen, centroid):
    """Seen by a squinted beam, also beyond half the PRF, a point is where it would be anyway."""
    raw = hyperbola(7182.0, at=-0.3, seen=seen)
    image = Focuser(raw, samples=64, doppler_centroid=centroid, bandwidth=1400.0).image(7182.0)
    row, column = np.unravel_index(np.abs(image.pixels).argmax(), image.pixels.shape)
    assert column == 32
    assert_allclose(image.first_time + row / image.prf, -0.3, atol=1 / image.prf)
    aside = Focuser(raw, samples=64, doppler_centroid=0.0, bandwidth=1000.0).image(7182.0)
    assert np.abs(aside.pixels).max() < 0.7 * np.abs(image.pixels).max()


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
        after, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert image.pixels.base is None
    assert abs(after - before - image.pixels.nbytes) < 0.05 * image.pixels.nbytes
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


def image_of(pixels):
    return Image(np.asarray(pixels, np.complex64), 0.0, 2150.0, 860e3, 4.684)


def test_multilook():
    z = np.random.default_rng(0).standard_normal((9, 7, 2)).astype(np.float32)
    z = z.view(np.complex64)[..., 0]
    got = multilook(image_of(z))
    assert got.shape == (2, 3)
    assert_allclose(got[1, 2], np.mean(np.abs(z[4:8, 4:6]) ** 2), rtol=1e-6)
    assert_allclose(multilook(image_of(z), 1, 1), np.abs(z) ** 2, rtol=1e-5)
    with pytest.raises(ValueError, match="azimuth must be at most 9"):
        multilook(image_of(z), 10, 1)
    with pytest.raises(ValueError, match="in_range must be an integer of at least 1"):
        multilook(image_of(z), 1, 0)


def test_decibels():
    assert_allclose(decibels([1.0, 10.0, 0.0]), [0.0, 10.0, 0.0])
    with pytest.raises(ValueError, match="power must be positive somewhere"):
        decibels(np.zeros(3))


@pytest.mark.parametrize(("line", "sample"), [(128, 64), (60, 100), (200, 21)])
def test_to_ground_puts_pixels_where_they_belong(flight, hit, line, sample):
    """A bright pixel, to the place at which a point on the ellipsoid has its time and range."""
    t, R = (float(a) for a in flight.closest(hit))
    dR, prf = 4.684, 2150.0
    pixels = np.full((256, 128), 0.1, np.complex64)
    pixels[line - 2 : line + 3, sample - 2 : sample + 3] = 10.0
    image = Image(pixels, t - 128 / prf, prf, R - 64 * dR, dR)
    view = view_of(flight, hit)
    p = flight.ground_point(t + (line - 128) / prf, R + (sample - 64) * dR, 0.0)
    place = [float(a) for a in ecef_to_geodetic(hit)]
    east, north, _ = east_north_up(*place[:2]) @ (p - hit)
    ahead, away = (axis @ [east, north] for axis in view.axes)
    ground = to_ground(image, incidence=view.incidence, ground_speed=6792.0, looks=(1, 1), pixel=5)
    weight = 10 ** (ground.values / 10)
    weight[weight < 1] = 0
    rows, columns = np.indices(weight.shape)
    row, column = (np.sum(a * weight) / weight.sum() for a in (rows, columns))
    # lines of equal time are not square to the flight on a turning Earth: a shear of 0.3 %
    assert_allclose((ground.centre[0] - row) * 5, ahead, atol=1.2)
    assert_allclose((column - ground.centre[1]) * 5, away, atol=0.6)


@pytest.mark.parametrize("looks", [(4, 2), (2, 1), (3, 5)])
def test_looks_do_not_shift(looks):
    """A symmetric bump about the centre pixel stays there."""
    i, j = np.indices((256, 128))
    bump = np.exp(-(((i - 128) / 40) ** 2) - ((j - 64) / 12) ** 2)
    ground = to_ground(image_of(bump), incidence=0.7, ground_speed=6800.0, looks=looks)
    row, column = ground.centre
    assert_array_equal(ground.values.shape, (2 * row + 1, 2 * column + 1))
    power = 10 ** (ground.values / 10)
    assert_allclose(np.sum(power.sum(axis=1) * (np.arange(2 * row + 1) - row)) / power.sum(), 0,
                    atol=0.06)  # fmt: skip
    assert_allclose(np.sum(power.sum(axis=0) * (np.arange(2 * column + 1) - column)) / power.sum(),
                    0, atol=0.06)  # fmt: skip


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"incidence": 0.0}, "incidence must be between 0 and pi/2"),
        ({"ground_speed": -1.0}, "ground_speed must be a positive"),
        ({"pixel": np.nan}, "pixel must be a positive"),
    ],
)
def test_to_ground_refuses(change, message):
    options = {"incidence": 0.7, "ground_speed": 6800.0} | change
    with pytest.raises(ValueError, match=message):
        to_ground(image_of(np.ones((16, 16))), **options)
