"""A matrix of pairs, as numbers and marks."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from navfilters.book.plotting import honesty_matrix
from navfilters.book.printing import compact


@pytest.mark.parametrize(
    ("x", "text"),
    [
        (0.01, "<.1"),
        (0.1, "0.1"),
        (1.04, "1.0"),
        (9.96, "10"),
        (999.4, "999"),
        (1234.0, "1e3"),
        (np.inf, "∞"),
        (np.nan, ""),
    ],
)
def test_numbers_are_short(x, text):
    assert compact(x) == text


def test_a_cell_says_error_and_honesty_and_nothing_where_there_is_no_pair():
    ratio, honesty = [[1.0, 500.0, np.nan]], [[1.0, 1e6, np.nan]]
    figure, ax = honesty_matrix(["EKF"], ["a", "b", "c"], ratio, honesty, [[0, 1, 0]])
    words = [text.get_text() for text in ax.texts]
    assert words == ["1.0", "●1.0", "500", "▲>1000", "–"]
    assert ax.texts[-1].get_fontsize() == ax.texts[0].get_fontsize()
    frames = [patch for patch in ax.patches if not patch.get_fill()]
    assert len(frames) == 1
    light, dark = (np.mean(p.get_facecolor()[:3]) for p in ax.patches if p.get_fill())
    assert light > 0.95 > 0.5 > dark
    plt.close(figure)


def test_of_a_lost_pair_only_that_is_said():
    shown = [["EKF"], ["a", "b"], [[1.0, 2.0]], [[1.0, 1.0]], [[0, 0]]]
    figure, ax = honesty_matrix(*shown, lost=[[False, True]])
    assert [text.get_text() for text in ax.texts] == ["1.0", "●1.0", "lost"]
    assert len([patch for patch in ax.patches if not patch.get_fill()]) == 1
    light, dark = (np.mean(p.get_facecolor()[:3]) for p in ax.patches if p.get_fill())
    assert light > 0.95 > 0.5 > dark
    plt.close(figure)
