"""The picture and the lines of a diagnosis."""

from dataclasses import replace

import numpy as np
from logs import kalman_log
from numpy.testing import assert_allclose

from navfilters.diagnosis import diagnose
from navfilters.diagnosis.report import figure, text


def test_each_window_is_a_level_line_at_its_mean():
    found = diagnose(kalman_log(steps=100))
    lines = figure(found).axes[0].lines[1:-1]  # between the updates and the line at 1
    assert len(lines) == len(found.windows) > 0
    value = found.nis / found.dof
    for line, (first, last, *_) in zip(lines, found.windows, strict=True):
        assert line.get_xdata().tolist() == [first, last]
        within = (found.time >= first) & (found.time <= last)
        assert_allclose(line.get_ydata(), np.mean(value[within]))


def test_times_are_rounded_and_have_the_unit_of_the_log():
    log = kalman_log(steps=100)
    hours = replace(log, time=0.0660264 + 0.16 * np.arange(100))
    first, *_ = text(diagnose(hours)).splitlines()
    assert first == "100 updates from 0.07 to 15.91, in the log's unit of time"
