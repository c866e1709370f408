"""The rivals of the paper's filters: their models, and flights against those of the paper."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_equal

from navfilters import run
from navfilters.estimators import Modes, Robust
from navfilters.oracles import xiong_orbit as oracle
from navfilters.papers.xiong2009 import (
    ESTIMATORS,
    RIVALS,
    OtherUnits,
    Rival,
    Setup,
    course,
    fly,
    fly_rival,
    fly_rivals,
    measurements,
    one_direction,
    truth,
)
from navfilters.papers.xiong2009.__main__ import main
from navfilters.space import manoeuvring

SHORT = Setup(duration=2000, window=500, burns=((700, 900),), thrust=0.45)


def test_a_course_is_the_same_noise_with_burns_and_without():
    flights = course(SHORT, range(3))
    assert flights.z.shape == (20, 2, 3, 2)
    assert flights.states.shape == (21, 2, 1, 6)
    assert_allclose(flights.z[:7, 0], flights.z[:7, 1], rtol=1e-12)
    assert np.abs(flights.states[-1, 0] - flights.states[-1, 1]).max() > 1e4
    assert_allclose(flights.z[:, 0], measurements(SHORT, range(3)))


@pytest.mark.parametrize("name", ["EKF", "AREKF"])
def test_the_papers_filters_fly_as_they_do_in_steps_of_a_second(name):
    flights = course(SHORT, range(2))
    flown = fly_rival(RIVALS[name], flights, SHORT)
    assert flown.error.shape == (21, 1, 2, 2, 6)
    wanted = truth(SHORT).states[::100, None] - fly(ESTIMATORS[name].filter, SHORT, range(2)).mean
    error = flown.error[:, 0, 0]
    assert np.abs(error - wanted)[..., :3].max() < 0.02 * np.abs(wanted)[..., :3].max()


@pytest.mark.parametrize("name", list(RIVALS))
def test_every_rival_flies_and_its_model_is_the_one_it_says(name):
    flown = fly_rival(RIVALS[name], course(SHORT, range(2)), SHORT)
    assert np.isfinite(flown.error).all()
    assert (flown.nees > 0).all()
    assert flown.rms(slice(15, 21)).shape == (1, 2)


def test_a_scan_is_its_members():
    flights = course(SHORT, range(2))
    q = np.array([0.1, 1.0])
    scan = fly_rival(Rival(q_v=q[:, None, None]), flights, SHORT)
    for i in range(2):
        one = fly_rival(Rival(q_v=q[i]), flights, SHORT)
        assert_allclose(scan.error[:, i], one.error[:, 0], rtol=1e-6, atol=1e-6)


def test_told_rivals_follow_the_arcs_that_they_are_told():
    flights = course(SHORT, range(4), burns=(True,))
    rival = RIVALS["timed strength"]
    right, wrong = (fly_rival(rival, flights, SHORT, arcs) for arcs in (None, ((100, 300),)))
    assert right.rms(slice(7, 21))[0, 0] < 0.5 * wrong.rms(slice(7, 21))[0, 0]


def test_an_oracle_without_random_numbers_expects_the_same():
    """RMS and NEES of a timed filter through the whole flight, 40 runs."""
    A = Setup()
    flown = fly_rival(RIVALS["timed Q"], course(A, range(40), burns=(True,)), A)
    error, ratio = oracle.expected(float(A.sigma), arcs=oracle.BURNS, q_v=3.0)
    for part in (slice(20, 73), slice(73, 141), slice(180, 201)):
        ours = flown.rms(part)[0, 0]
        assert_allclose(ours, np.sqrt(np.mean(error[part] ** 2)), rtol=0.15)
        assert_allclose(flown.nees[part].mean(), ratio[part].mean(), rtol=0.15)


def test_one_direction_is_what_two_displaced_angles_are():
    perfect = replace(SHORT, star_noise=1e-6, earth_noise=1e-9)
    states = truth(SHORT).states[100::100]
    turned = one_direction(perfect, range(1), (0.02, 0.0))[:, 0]
    later = states[:, :3] + np.deg2rad(0.02) * np.linalg.norm(
        states[:, :3], axis=1, keepdims=True
    ) * _along(states)
    u = perfect.sensor.stars
    wanted = np.arccos(-(later @ u.T) / np.linalg.norm(later, axis=1, keepdims=True))
    assert_allclose(turned, wanted, atol=1e-9)


def _along(states):
    r = states[:, :3] / np.linalg.norm(states[:, :3], axis=1, keepdims=True)
    v = states[:, 3:] - np.sum(states[:, 3:] * r, axis=1, keepdims=True) * r
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def test_the_spread_of_one_direction_is_that_of_its_components():
    """Each angle has the Earth sensor's variance and the star's, and the two are correlated."""
    seen = one_direction(SHORT, range(800))
    off = seen - SHORT.sensor.h(truth(SHORT).states[100::100])[:, None]
    assert_allclose(off.std(), float(SHORT.sigma), rtol=0.02)
    assert abs(np.corrcoef(off[3].T)[0, 1]) > 0.1


@pytest.mark.parametrize("scale", [(1e-3, 1e-3), (1e-3, 1.0)])
def test_other_units_are_the_same_flight(scale):
    scale = np.repeat(scale, 3)
    motion = manoeuvring(SHORT.orbit())
    z, sensor = measurements(SHORT, range(2)), OtherUnits(SHORT.sensor, scale)
    here = {"dynamics": motion, "z_per_step": True}
    there = {"dynamics": OtherUnits(motion, scale), "z_per_step": True}
    for rule, same in ((RIVALS["gate"].filter.rule, True), (Robust(6000.0), False)):
        ours = replace(RIVALS["EKF"].filter, rule=rule)
        first = run(ours, SHORT.prior, z, SHORT.sensor, **here).mean
        other = run(ours, sensor.prior(SHORT.prior), z, sensor, **there).mean / scale
        assert (np.abs(other - first)[..., :3].max() < 1e-4) == same


def test_several_units_at_once_are_each_alone():
    scales = np.repeat([(1.0, 1.0), (1e-3, 1e-3), (1e-3, 1.0)], 3, axis=1)
    z = measurements(SHORT, range(2))

    def flown(scale):
        sensor, motion = (OtherUnits(x, scale) for x in (SHORT.sensor, manoeuvring(SHORT.orbit())))
        rule = Robust(6000.0 * scale[..., 0])
        first, told = sensor.prior(SHORT.prior), {"dynamics": motion, "z_per_step": True}
        return run(replace(RIVALS["EKF"].filter, rule=rule), first, z, sensor, **told).mean

    found = flown(scales[:, None])
    for i, scale in enumerate(scales):
        assert_allclose(found[:, i], flown(scale), rtol=1e-12)


def test_the_command_prints_a_line_for_each_rival(capsys, monkeypatch):
    few = {name: RIVALS[name] for name in ("EKF", "timed Q")}
    monkeypatch.setattr("navfilters.papers.xiong2009.__main__.RIVALS", few)
    main(["--rivals", "--seeds", "1", "--variant", "D"])
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "variant D, 1 seeds"
    assert [line[:7].strip() for line in lines[2:]] == ["EKF", "timed Q"]


def test_two_models_that_are_one_are_that_one():
    """Also where the model differs from step to step: each is asked for its step once."""
    flights = course(SHORT, range(2))
    one = RIVALS["timed Q"]
    flown = fly_rival(one, flights, SHORT)
    motion = one.dynamics(SHORT)
    twice = run(
        RIVALS["IMM"].filter,
        one.prior(SHORT),
        flights.z[:, 0],
        SHORT.sensor,
        dynamics=Modes((motion, motion)),
        z_per_step=True,
    ).mean
    assert_allclose(flights.states[:, 0] - twice, flown.error[:, 0, 0], rtol=1e-6, atol=1e-5)


def test_an_imm_written_apart_flies_the_same():
    """Metres apart at the end; in the burns the probabilities magnify small differences."""
    A = Setup()
    flights = course(A, range(2), burns=(True,))
    flown = fly_rival(RIVALS["IMM"], flights, A).error[:, 0, 0, :, :3]
    x = oracle.two_models(flights.z[:, 0], float(A.sigma), 0.9999, 0.999, 10.0)
    apart = flown - (flights.states[:, 0] - x)[..., :3]
    assert np.abs(apart).max() < 0.03 * np.abs(flown).max()
    assert np.abs(apart[180:]).max() < 20


def test_rivals_of_one_model_fly_as_they_do_alone():
    names = ("gate", "constant Q", "EKF", "strong tracking", "AEKF", "IMM", "REKF")
    some, flights = {name: RIVALS[name] for name in names}, course(SHORT, [3, 4])
    found = fly_rivals(some, flights, SHORT)
    assert tuple(found) == names
    for name, flown in found.items():
        assert_equal(flown, fly_rival(some[name], flights, SHORT))
