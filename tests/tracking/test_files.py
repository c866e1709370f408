"""Files of tracking: what is read, and what a wrong line is answered."""

from datetime import datetime

import numpy as np
import pytest

from navfilters.tracking import read_coefficients, read_observations, read_settings
from navfilters.tracking.w3b import FOLDER

EPOCH = datetime(2010, 11, 2, 3)
RANGE = "2010-11-02T03:00:10.5  RANGE  Uralla  38014.9488"
ANGLES = "2010-11-02T03:00:05  AZ_EL  Kumsan  180.0  45.0"


def written(tmp_path, *lines):
    path = tmp_path / "some.txt"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_observations_come_in_the_order_of_time_and_in_si_units(tmp_path):
    path = written(tmp_path, "# a comment", "", RANGE, ANGLES)
    found = read_observations(path, ("Uralla", "Kumsan"), EPOCH)
    assert found.time.tolist() == [5.0, 10.5]
    assert found.station.tolist() == [1, 0]
    assert found.z[0, 1:].tolist() == [np.pi, np.pi / 4]
    assert found.z[1, 0] == pytest.approx(38014948.8, abs=1e-6)
    assert np.isnan(found.z).tolist() == [[True, False, False], [False, True, True]]


@pytest.mark.parametrize(
    ("line", "needed"),
    [
        ("2010-11-02T03:00:10 DOPPLER Uralla 1.0", "a kind of .*found 'DOPPLER'"),
        ("2010-11-02T03:00:10", "a kind of .*found ''"),
        ("2010-11-02T03:00:10 AZ_EL Uralla 1.0", "2 values are needed for AZ_EL; found 4 words"),
        ("2010-11-02T03:00:10 RANGE Uralla 1.0 2.0", "1 values are needed for RANGE"),
        ("2010-11-02T03:00:10 RANGE Madrid 1.0", "a station of .*found Madrid"),
        ("2010-11-02T03:00:10 RANGE Uralla far", "a finite number is needed; found 'far'"),
        ("2010-11-02T03:00:10 RANGE Uralla nan", "a finite number is needed; found 'nan'"),
        ("yesterday RANGE Uralla 1.0", "a date as .*found 'yesterday'"),
        ("2010-11-02T03:00:10+01:00 RANGE Uralla 1.0", "a date as "),
    ],
)
def test_a_wrong_measurement_is_named_by_file_and_line(tmp_path, line, needed):
    path = written(tmp_path, "# a comment", RANGE, line)
    with pytest.raises(ValueError, match=f"some.txt, line 3: .*{needed}"):
        read_observations(path, ("Uralla", "Kumsan"), EPOCH)


def test_a_file_without_measurements_is_refused(tmp_path):
    with pytest.raises(ValueError, match="at least one measurement is needed; found none"):
        read_observations(written(tmp_path, "# nothing"), ("Uralla",), EPOCH)


def test_settings_are_found_by_key_and_index(tmp_path):
    lines = ("mass = 5.5", "site.name [0] = A", "site.x   [0] = 1", "site.x [1]=2;", "# no = 1")
    found = read_settings(written(tmp_path, *lines))
    assert found.number("mass") == 5.5
    assert found.text("site.name", 0) == "A"
    assert found.numbers("site.x").tolist() == [1.0, 2.0]
    with pytest.raises(ValueError, match=r"some.txt: a line 'site.x \[2\] = ...' is needed"):
        found.number("site.x", 2)
    with pytest.raises(ValueError, match=r"some.txt, site.name: a finite number is needed"):
        found.number("site.name", 0)


@pytest.mark.parametrize(
    ("lines", "needed"),
    [
        (("a = 1", "b"), "line 2: 'key = value'.*found b"),
        (("a = 1", "a = 2"), "line 2: .*a again"),
        ((f"a[{5000 * '1'}] = 1",), "some.txt, line 1: .*at most 9 digits is needed; found 5000"),
    ],
)
def test_a_wrong_setting_is_named_by_file_and_line(tmp_path, lines, needed):
    with pytest.raises(ValueError, match=needed):
        read_settings(written(tmp_path, *lines))


@pytest.mark.parametrize(
    ("lines", "needed"),
    [
        (("0 0 1 0", "2 0 x 0"), "line 2: a finite number is needed; found 'x'"),
        (("0 0 1",), "line 1: degree, order, C and S are needed"),
        (("1 2 0 0",), "line 1: an order of at most the degree 1 is needed; found 2"),
        ((5000 * "2" + " 0 1 0",), "some.txt, line 1: .*at most 9 digits is needed; found 5000"),
        (("0 0 1 0",), "coefficients to degree 2 are needed; found 0"),
    ],
)
def test_a_wrong_coefficient_is_named(tmp_path, lines, needed):
    with pytest.raises(ValueError, match=needed):
        read_coefficients(written(tmp_path, *lines), 2)


def test_the_flight_is_as_its_header_says():
    text = (FOLDER / "W3B.aer").read_text(encoding="utf-8")
    assert "Copyright 2011 Telespazio" in text
    assert "Apache License" in (FOLDER / "LICENSE.txt").read_text(encoding="utf-8")
    assert "CS GROUP" in (FOLDER / "NOTICE.txt").read_text(encoding="utf-8")
    settings = read_settings(FOLDER / "od_test_W3.in")
    names = tuple(settings.text("ground.station.name", i) for i in range(5))
    found = read_observations(FOLDER / "W3B.aer", names, settings.date("orbit.date"))
    assert np.sum(~np.isnan(found.z), axis=0).tolist() == [182, 339, 339]
    assert found.time[-1] == pytest.approx(57077.8756, abs=1e-4)
