"""Images that do not say what their numbers are: read right, or refused with the true reason."""

import numpy as np
import pytest
from geotiff_files import (
    SIZE,
    backscatter,
    image,
    power,
    read,
)
from numpy.testing import assert_allclose, assert_array_equal


@pytest.mark.parametrize("share", [1e-5, 1e-3, 0.03])
@pytest.mark.parametrize("amount", [-2e-5, -0.01, 0.0])
@pytest.mark.parametrize("gain", [1.0, 2e5])
def test_noise_that_was_subtracted_makes_no_decibels(tmp_path, scene, share, amount, gain):
    """Pixels at or below zero were not measured; all others are what they are without them."""
    values = power(backscatter(looks=4.0)) * gain
    wanted = read(image(tmp_path / "a.tif", values), scene)
    bad = np.random.default_rng(2).random(values.shape) < share
    bad[200, 200] = True
    values[bad] = amount * gain
    found = read(image(tmp_path / "b.tif", values), scene)
    kept = ~bad[50:-50, 50:-50]
    assert_allclose(found[kept], wanted[kept], rtol=0, atol=1e-4)
    assert_allclose(found[~bad[50:-50, 50:-50]].mean(), wanted.mean(), atol=0.1)


@pytest.mark.parametrize("level", [-25.0, -12.0, -3.0, -0.8])
@pytest.mark.parametrize("spread", [2.5, 4.0])
def test_decibels_with_a_town_are_decibels(tmp_path, scene, level, spread):
    values = backscatter(level=level, spread=spread)
    values[190:210, 190:210] = 12.0
    found = read(image(tmp_path / "a.tif", values), scene)
    assert_allclose(found, values[50:-50, 50:-50], rtol=0, atol=1e-4)


@pytest.mark.parametrize(
    "values",
    [
        backscatter(level=0.0),  # half below zero
        backscatter(level=-0.02, spread=0.01),  # noise alone, too much of which was subtracted
        backscatter(level=6.0, spread=3.0),
        backscatter(level=40.0),  # decibels of digital numbers: none below zero
        backscatter(level=40.0, looks=1.0),
        backscatter(level=80.0, spread=6.0),
        np.full((SIZE, SIZE), 3.0, "float32"),
        power(backscatter(spread=0.2)),  # linear, but as even as decibels may be
    ],
)
def test_an_image_that_may_be_either_is_refused_until_it_is_said(tmp_path, scene, values):
    path = image(tmp_path / "a.tif", values)
    message = (
        r"a\.tif must tell whether it is in dB or linear; found pixels of which .* below zero, the "
        r'middle one .*: say unit="dB" or unit="linear"'
    )
    with pytest.raises(ValueError, match=message):
        read(path, scene)
    found = read(path, scene, unit="dB")
    assert_allclose(found, values[50:-50, 50:-50], rtol=0, atol=2e-4)
    if (values > 0).all():
        found = read(path, scene, unit="linear")
        assert_allclose(found, 10 * np.log10(values[50:-50, 50:-50]), rtol=0, atol=1e-3)
    elif np.mean(values < 0) > 0.5:
        with pytest.raises(ValueError, match="must hold intensity or amplitude; found pixels"):
            read(path, scene, unit="linear")


@pytest.mark.parametrize(
    ("units", "name"),
    [("dB", None), ("decibel", None), ("DB", "VV"), ("", "Sigma0_VV_db"), ("", "gamma0 [dB]")],
)  # fmt: skip
def test_declared_decibels_are_believed(tmp_path, scene, units, name):
    values = backscatter(level=3.0)
    found = read(image(tmp_path / "a.tif", values, units=units, name=name), scene)
    assert_allclose(found, values[50:-50, 50:-50], rtol=0, atol=1e-4)


@pytest.mark.parametrize("units", ["linear", "intensity", "Amplitude", "power"])
def test_a_declared_linear_scale_is_believed(tmp_path, scene, units):
    values = power(backscatter(spread=0.2))
    found = read(image(tmp_path / "a.tif", values, units=units), scene)
    assert_allclose(found, 10 * np.log10(values[50:-50, 50:-50]), rtol=0, atol=1e-3)
    path = image(tmp_path / "b.tif", backscatter(), units=units)
    with pytest.raises(
        ValueError, match=r"b\.tif must hold intensity or amplitude; found .* below"
    ):
        read(path, scene)


@pytest.mark.parametrize("units", ["m", "metre", "radian", "degree", "K"])
def test_another_quantity_is_no_image(tmp_path, scene, units):
    path = image(tmp_path / "a.tif", power(backscatter()), units=units)
    with pytest.raises(ValueError, match=rf"in dB or linear; found the unit '{units}'"):
        read(path, scene)


def test_digital_numbers_of_16_bits_are_linear(tmp_path, scene):
    """Amplitudes as the agency's mosaic has them, 0 for no data."""
    numbers = np.rint(10 ** ((backscatter(spread=2.0, looks=16.0) + 83) / 20)).astype("uint16")
    numbers[:120] = 0
    found = read(image(tmp_path / "a.tif", numbers), scene)
    kept = numbers[125:-50, 50:-50]
    assert_allclose(found[75:], 10 * np.log10(kept), rtol=0, atol=1e-3)


def test_eight_bits_are_a_picture_until_it_is_said(tmp_path, scene):
    grey = np.clip(backscatter() * 5 + 180, 1, 255).astype("uint8")
    path = image(tmp_path / "a.tif", grey)
    with pytest.raises(ValueError, match="found uint8, as of a picture for the eye: say unit="):
        read(path, scene)
    found = read(path, scene, unit="linear")
    assert_allclose(found, 10 * np.log10(np.maximum(grey[50:-50, 50:-50], 1.0)), atol=1e-3)
    for colour in ("red", "palette"):
        path = image(tmp_path / f"{colour}.tif", grey, colour=colour)
        with pytest.raises(ValueError, match=f"found a picture in colours: {colour}"):
            read(path, scene, unit="dB")


@pytest.mark.parametrize("unit", ["db", "sigma", 3])
def test_a_unit_that_is_none(tmp_path, scene, unit):
    with pytest.raises(ValueError, match=f"unit must be 'dB', 'linear' or None; found {unit!r}"):
        read(tmp_path / "a.tif", scene, unit=unit)


@pytest.mark.parametrize(
    ("scale", "void"),
    [
        *((10.0, v) for v in (-9999.0, -32768.0, -999.0, 0.0, -3.4028235e38, 1e30, np.nan)),
        *((scale, v) for scale in (5.0, 23.0) for v in (-9999.0, 0.0)),
    ],
)
@pytest.mark.parametrize("linear", [False, True])
def test_undeclared_voids_touch_nothing_around_them(tmp_path, scene, scale, void, linear):
    """A pixel at the edge of a void would be an average with -9999."""
    values = backscatter(spread=2.0, size=int(4010 / scale))
    values = power(values) if linear else values
    middle = int(len(values) * 0.42)
    holed = values.copy()
    holed[middle : middle + 12, middle : middle + 60] = void
    wanted = read(image(tmp_path / "a.tif", values, scale), scene)
    found = read(image(tmp_path / "b.tif", holed, scale), scene)
    filled = np.median(found)
    same = np.abs(found - wanted) < 1e-3
    assert_array_equal(same | (np.abs(found - filled) < 0.2), True)
    assert (~same).sum() < 1.6 * 720 * (scale / 10) ** 2 + 1500


@pytest.mark.parametrize(("linear", "void"), [(False, -500.0), (False, 300.0), (True, -500.0)])
def test_values_that_no_echo_has_are_refused(tmp_path, scene, linear, void):
    values = power(backscatter()) if linear else backscatter()
    values[150:160, 180:190] = void
    with pytest.raises(
        ValueError, match=rf"a\.tif must hold .*; found {void:.0f}.*edit-info --nod"
    ):
        read(image(tmp_path / "a.tif", values), scene)
    read(image(tmp_path / "b.tif", values, nodata=void), scene)


def test_a_void_at_the_largest_number_is_refused(tmp_path, scene):
    numbers = np.rint(10 ** ((backscatter() + 70) / 20)).astype("uint16")
    numbers[200, 200] = 65535  # a single bright point may be
    assert read(image(tmp_path / "a.tif", numbers), scene).max() > 40
    numbers[100:180] = 65535
    with pytest.raises(
        ValueError, match=r"found \d+ % of its pixels at 65535, the largest of uint"
    ):
        read(image(tmp_path / "b.tif", numbers), scene)
