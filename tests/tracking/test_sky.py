"""Earth rotation, Sun and Moon against textbook series; places against the ellipsoid's formulas."""

from datetime import datetime

import numpy as np
import pytest

from navfilters.tracking import geodetic, sky

EPOCH = datetime(2010, 11, 2, 2, 56, 15, 690000)
UT1 = -0.0927264  # s behind UTC at 0 h, IERS Bulletin B 275


@pytest.fixture(scope="module")
def above():
    return sky(EPOCH, 6000.0)


def about(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[i, i] = R[j, j] = c
    R[i, j], R[j, i] = s, -s
    return R


def textbook_rotation(t):
    """IAU 1976 precession, four terms of nutation, IAU 1982 sidereal time; no polar motion."""
    seconds = (EPOCH - datetime(2000, 1, 1, 12)).total_seconds() + t
    T = (seconds + 66.184) / 86400 / 36525
    arc = np.radians(1 / 3600)
    zeta = (2306.2181 * T + 0.30188 * T**2) * arc
    z = (2306.2181 * T + 1.09468 * T**2) * arc
    theta = (2004.3109 * T - 0.42665 * T**2) * arc
    precession = about(2, -z) @ about(1, theta) @ about(2, -zeta)
    node, sun, moon = np.radians(
        [125.0445 - 1934.1363 * T, 280.4665 + 36000.7698 * T, 218.3165 + 481267.8813 * T]
    )
    lon = arc * (
        -17.20 * np.sin(node) - 1.32 * np.sin(2 * sun) - 0.23 * np.sin(2 * moon)
        + 0.21 * np.sin(2 * node)
    )  # fmt: skip
    tilt = arc * (
        9.20 * np.cos(node) + 0.57 * np.cos(2 * sun) + 0.10 * np.cos(2 * moon)
        - 0.09 * np.cos(2 * node)
    )  # fmt: skip
    obliquity = (84381.448 - 46.815 * T) * arc
    nutation = about(0, -(obliquity + tilt)) @ about(2, -lon) @ about(0, obliquity)
    U = (seconds + UT1) / 86400 / 36525
    sidereal = 67310.54841 + (876600 * 3600 + 8640184.812866) * U + 0.093104 * U**2
    angle = 2 * np.pi * (sidereal / 86400 % 1) + lon * np.cos(obliquity)
    return (about(2, angle) @ nutation @ precession).T


@pytest.mark.parametrize("t", [0.0, 1234.5, 6000.0])
def test_the_rotation_is_the_textbook_s_to_an_arc_second(above, t):
    found = above.at(t)[0]
    assert np.abs(found @ found.T - np.eye(3)).max() < 1e-10
    assert np.abs(found - textbook_rotation(t)).max() < np.radians(1 / 3600)


def test_interpolation_is_as_fine_as_the_table():
    """A table that begins at another second has its nodes elsewhere."""
    one, other = sky(EPOCH, 3000.0), sky(datetime(2010, 11, 2, 2, 57, 2, 690000), 2000.0)
    t = np.array([500.0, 1111.0, 1777.0])
    for a, b in zip(one.at(t), other.at(t - 47.0), strict=True):
        assert np.abs(a - b).max() < 1e-9 * np.abs(a).max()


def test_sun_and_moon_are_where_short_series_have_them(above):
    T = ((EPOCH - datetime(2000, 1, 1, 12)).total_seconds() + 66) / 86400 / 36525
    _, sun, moon = above.at(0.0)
    M = np.radians(357.5256 + 35999.049 * T)
    lon = np.radians(282.94) + M + np.radians(6892 * np.sin(M) + 72 * np.sin(2 * M)) / 3600
    r = (149.619 - 2.499 * np.cos(M) - 0.021 * np.cos(2 * M)) * 1e9
    tilt = np.radians(23.43929)
    expected = r * np.array([np.cos(lon), *(np.sin(lon) * np.array([np.cos(tilt), np.sin(tilt)]))])
    assert np.linalg.norm(sun - expected) < 0.001 * r
    assert 3.56e8 < np.linalg.norm(moon) < 4.07e8
    L, anomaly = np.radians([218.32 + 481267.881 * T, 135.0 + 477198.87 * T])
    turn = np.radians(6.29) * np.sin(anomaly)
    turn -= np.radians(1.27) * np.sin(np.radians(259.3 - 413335.36 * T))
    turn += np.radians(0.66) * np.sin(np.radians(235.7 + 890534.22 * T))
    pole = np.array([0.0, -np.sin(tilt), np.cos(tilt)])
    flat = moon - pole * (moon @ pole)
    y = np.array([0.0, np.cos(tilt), np.sin(tilt)])
    apart = np.arctan2(flat @ y, flat[0]) - (L + turn)
    assert abs((apart + np.pi) % (2 * np.pi) - np.pi) < np.radians(0.6)


def test_a_time_out_of_the_span_is_refused(above):
    with pytest.raises(ValueError, match="t must be between"):
        above.at(-500.0)
    with pytest.raises(ValueError, match="t must be between"):
        above.at(np.array([0.0, 9000.0]))


def test_places_are_on_the_ellipsoid():
    lat, lon, height = 0.7, -1.2, 2000.0
    position, axes = geodetic(lat, lon, height)
    a, f = 6378137.0, 1 / 298.257223563
    N = a / np.sqrt(1 - f * (2 - f) * np.sin(lat) ** 2)
    across = (N + height) * np.cos(lat)
    polar = ((1 - f) ** 2 * N + height) * np.sin(lat)
    expected = [across * np.cos(lon), across * np.sin(lon), polar]
    assert np.abs(position - expected).max() < 1e-6
    assert np.abs(axes @ axes.T - np.eye(3)).max() < 1e-15
    higher = geodetic(lat, lon, height + 10.0)[0]
    assert np.abs(axes @ (higher - position) - [0, 0, 10]).max() < 1e-6
    north = axes @ (geodetic(lat + 1e-6, lon, height)[0] - position)
    assert north[1] > 6
    assert np.abs(north[[0, 2]]).max() < 1e-5


def test_nothing_is_asked_of_the_network(monkeypatch):
    def refused(*args, **kwargs):
        raise OSError("no network")

    monkeypatch.setattr("socket.socket.connect", refused)
    monkeypatch.setattr("socket.getaddrinfo", refused)
    assert np.isfinite(sky(EPOCH, 600.0).at(0.0)[0]).all()
