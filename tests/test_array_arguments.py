"""Public functions of arrays, argument by argument: the right answer, or an error that names it."""

import importlib
import inspect
import pkgutil
import re
import warnings

import numpy as np
import pytest
from array_calls import CALLS
from numpy.testing import assert_allclose

import navfilters

STAGE = "the stages of a filter, which looks at the estimate first: test_plain_arrays.py"
EXPERIMENT = "one experiment's own quantities: its functions are in tests/papers"
VALUE = "a value that the library makes"
OTHERWISE = {
    "book.plotting": "draws what a chapter computed",
    "diagnosis": "Log looks at its arrays: tests/diagnosis",
    "estimators": STAGE,
    "estimators.continuous": STAGE,
    "estimators.discrete": STAGE,
    "models.Augmented": "tests/models/test_augmented.py",
    "numerics.complex_step": "gives a function to the caller: tests/numerics/test_analytic.py",
    "numerics.runge_kutta": "what the caller's function makes of x",
    "papers.lecture16": EXPERIMENT,
    "papers.perea2007.false_information": EXPERIMENT,
    "papers.perea2007.improvement": EXPERIMENT,
    "papers.pogorelsky2020": EXPERIMENT,
    "papers.xiong2009": EXPERIMENT,
    "problems": "patients of the table of cures: tests/problems",
    "runs.Distance": "test_plain_arrays.py",
    "runs.chi_square_band": "counts: tests/runs/test_consistency.py",
    "runs.run": "tests/runs/test_loop_refusals.py",
    "runs.sweep": "tests/runs/test_sweep.py",
    "sar.ground.LandCover": VALUE,
    "sar.ground.Points": VALUE,
    "sar.ground.Terrain": "tests/sar/test_scene.py",
    "sar.ground.terrain_hit": "what the caller's terrain makes of a ray",
    "sar.images.GroundImage": VALUE,
    "sar.images.Image": VALUE,
    "sar.matching": VALUE,
    "sar.palsar": VALUE,
    "sar.raw": VALUE,
    "space.EarthFixedOrbit": "tests/space/test_earth_fixed_orbit.py",
    "space.ManoeuvringOrbit": "tests/space/test_manoeuvring_orbit.py",
    "space.Measurement": VALUE,
    "space.NavigationState": VALUE,
    "space.Orbit": "tests/space/test_inertial_orbit.py",
    "space.Pixel": "tests/space/test_image_measurement.py",
    "space.SarGeometry": "tests/space/test_image_measurement.py",
    "space.SarPass": "tests/space/test_image_measurement.py",
    "space.StarEarthSensor": "tests/space/test_star_earth_sensor.py",
    "space.TimedMeasurement": VALUE,
    "space.ZeroDoppler": "tests/space/test_zero_doppler.py",
    "space.manoeuvring": "tests/space/test_manoeuvring_orbit.py",
    "tracking": "a real satellite's data and their fit: tests/tracking",
}
"""Packages and functions that have no row, and why."""

TAKES_ANY = {
    ("papers.perea2007.deviations", "cov"): "whatever a filter that diverged has left",
    ("sar.ground.lambert", "cosine"): "more than 1 is 1",
    ("space.rotation_vector", "q"): "an infinite scalar part is no rotation",
    ("runs.mean_nees", "error"): "runs that are not finite are left out and counted",
    ("runs.mean_nees", "cov"): "runs that are not finite are left out and counted",
}
"""Arguments of which NaN, infinite or indefinite ones have an answer that is finite."""

OF_ANY_SIZE = {("models.Linear", "H"), ("papers.perea2007.isotropic", "mean")}


class Odd(np.ndarray):
    """A subclass with rules of its own."""


def read_only(a):
    a = a.copy()
    a.flags.writeable = False
    return a


def with_last(value):
    def made(a):
        a = a.copy()
        a[(-1,) * a.ndim] = value
        return a

    return made


def masked(a):
    mask = np.zeros(a.shape, bool)
    mask[(-1,) * a.ndim] = True
    return np.ma.array(a, mask=mask)


SAME = {
    "a list": lambda a: a.tolist(),
    "float32": lambda a: a.astype(np.float32),
    "whole numbers": lambda a: a.astype(int),
    "read-only": read_only,
    "not contiguous": lambda a: np.repeat(a, 2, -1)[..., ::2] if a.ndim else a,
    "columns first": np.asfortranarray,
    "a subclass": lambda a: a.view(Odd),
    "one of a batch": lambda a: a[None],
}
WRONG = {
    "masked": masked,
    "one more in the last axis": lambda a: np.concatenate([a, a[..., :1]], -1),
    "an axis less": lambda a: a[0],
}
TELLING = {"NaN": with_last(np.nan), "infinite": with_last(np.inf)}
ASYMMETRIC = {"not symmetric": lambda a: a + np.triu(np.ones(a.shape), 1)}
INDEFINITE = {"not definite": lambda a: a - 10 * np.eye(a.shape[-1])}


def parts(value):
    """Every array of an answer."""
    if isinstance(value, tuple | list):
        return [array for part in value for array in parts(part)]
    return [] if value is None else [np.asarray(value)]


def asked(row, name, value):
    """The answer to one changed argument, or None where an error names an argument."""
    call = CALLS[row]
    arguments = dict(call.arguments) | {name: value}
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings(action="ignore"):
            return parts(call.function(**arguments))
    except ValueError as error:
        named = rf"(estimate\.)?({'|'.join(arguments)})"
        at_fault = rf"{named} must |leading \(batch\) axes must broadcast; found {named}"
        assert re.match(at_fault, str(error)), error  # noqa: PT017
        return None


def equal(found, wanted, rtol=1e-13):
    assert len(found) == len(wanted)
    for a, b in zip(found, wanted, strict=True):
        assert a.shape in (b.shape, (1, *b.shape))
        assert_allclose(a.reshape(b.shape), b, rtol=rtol, atol=rtol * np.abs(b).max(initial=0.0))


def right(row):
    return parts(CALLS[row].function(**CALLS[row].arguments))


def doors(*kinds):
    return pytest.mark.parametrize(
        ("row", "name"),
        [
            (row, name)
            for row, call in CALLS.items()
            for name, kind in call.kinds.items()
            if not kinds or kind in kinds
        ],
    )


@doors()
@pytest.mark.parametrize("kind", SAME)
def test_the_same_numbers_give_the_same_answer(row, name, kind):
    value = CALLS[row].arguments[name]
    if kind == "whole numbers" and (value != np.round(value)).any():
        pytest.skip("no whole numbers")
    if kind == "one of a batch" and CALLS[row].kinds[name] == "one":
        pytest.skip("has no batch")
    found = asked(row, name, SAME[kind](value))
    if found is None:
        assert kind in ("a subclass", "one of a batch")
    else:
        equal(found, right(row), 1e-5 if kind == "float32" else 1e-13)


@doors("cov", "symmetric", "root", "vector", "numbers")
def test_an_empty_batch_gives_none(row, name):
    found = asked(row, name, CALLS[row].arguments[name][None][:0])
    assert found is None or any(array.size == 0 for array in found)


@doors("cov", "symmetric", "root", "vector")
@pytest.mark.parametrize("kind", WRONG)
def test_another_shape_and_what_is_masked_are_refused_by_name(row, name, kind):
    if (row, name) in OF_ANY_SIZE and kind == "one more in the last axis":
        pytest.skip("of any size")
    assert asked(row, name, WRONG[kind](CALLS[row].arguments[name])) is None


@doors()
@pytest.mark.parametrize("kind", TELLING)
def test_what_is_not_finite_does_not_vanish(row, name, kind):
    """It is refused, or the answer is not finite either, or is another."""
    found = asked(row, name, TELLING[kind](CALLS[row].arguments[name]))
    if found is None or (row, name) in TAKES_ANY:
        return
    finite = all(np.isfinite(array).all() for array in found if array.dtype.kind == "f")
    if finite:
        with pytest.raises(AssertionError):
            equal(found, right(row))


@doors("cov", "symmetric")
@pytest.mark.parametrize("kind", ASYMMETRIC)
def test_what_is_not_symmetric_is_refused_or_half_of_it_is_read(row, name, kind):
    found = asked(row, name, ASYMMETRIC[kind](CALLS[row].arguments[name]))
    if found is not None and (row, name) not in TAKES_ANY:
        assert "lower triangle is read" in re.sub(r"\s+", " ", CALLS[row].function.__doc__)
        equal(found, right(row))


@doors("cov")
@pytest.mark.parametrize("kind", INDEFINITE)
def test_what_is_not_definite_is_refused_or_told(row, name, kind):
    found = asked(row, name, INDEFINITE[kind](CALLS[row].arguments[name]))
    if found is not None and (row, name) not in TAKES_ANY:
        assert any(not array.all() or np.isnan(array).any() for array in found)


def test_every_public_function_of_arrays_has_a_row_or_a_reason():
    """By its docstring, which says what is an array."""
    public, without = set(), []
    for package in pkgutil.walk_packages(navfilters.__path__, "navfilters."):
        if not package.ispkg or re.search(r"oracles|crash", package.name):
            continue
        module = importlib.import_module(package.name)
        for name in getattr(module, "__all__", ()):
            value = getattr(module, name)
            doc = re.split(r"\n *(?:Returns|Raises)\n", inspect.getdoc(value) or "")[0]
            place = package.name.removeprefix("navfilters.")
            if callable(value) and re.search(r"^ *[\w, ]+ : .*(array|Gaussian)", doc, re.MULTILINE):
                public |= {f"{place}.{name}", place}
                if not {f"{place}.{name}", place} & (CALLS.keys() | OTHERWISE):
                    without.append(f"{place}.{name}")
    assert without == []
    assert OTHERWISE.keys() <= public
    assert CALLS.keys() <= public
