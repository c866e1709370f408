"""One hand for every figure: styles that differ, labels that do not touch."""

from itertools import combinations

import matplotlib as mpl
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

mpl.use("Agg")
from matplotlib import pyplot as plt

from navfilters import FILTERS
from navfilters.book import plotting
from navfilters.book.plotting.styles import STYLES
from navfilters.estimators import LATER_FILTERS


@pytest.fixture
def ax():
    figure, ax = plt.subplots(figsize=(6, 4))
    yield ax
    plt.close(figure)


def test_every_filter_has_a_style():
    assert set(FILTERS | LATER_FILTERS) <= set(STYLES)


@pytest.mark.parametrize(("one", "other"), list(combinations(STYLES, 2)))
def test_no_two_filters_look_alike(one, other):
    a, b = STYLES[one], STYLES[other]
    assert a != b
    if a["color"] == b["color"]:
        assert a["linestyle"] != b["linestyle"]
        assert a["marker"] != b["marker"]


@pytest.mark.parametrize(("log_x", "scale"), [(True, "log"), (False, "linear")])
def test_a_sweep_may_be_over_decades(log_x, scale):
    x = [1.0, 10.0, 100.0]
    results = dict.fromkeys(FILTERS, np.ones(3))
    _, axes = plotting.sweep_panels(x, results, "x", floor=1e-3, log_x=log_x)
    assert {ax.get_xscale() for ax in axes} == {scale}


@pytest.mark.parametrize(
    "ends",
    [[0.2, 0.5, 0.8], [0.5] * 4, [0.98, 0.99, 1.0], [0.0, 0.0, 0.01], [-3.0, 0.5, 4.0]],
    ids=["apart", "equal", "top", "bottom", "outside"],
)
def test_labels_of_curves_are_apart_and_inside(ax, ends):
    for i, end in enumerate(ends):
        ax.plot([0, 1], [0.5, end], label=f"curve {i}")
    ax.set(xlim=(0, 1), ylim=(0, 1))
    plotting.label_ends(ax, gap=11.0, names={"curve 0": "first"})
    assert {t.get_text() for t in ax.texts} == {
        "first",
        *(f"curve {i}" for i in range(1, len(ends))),
    }
    heights = np.sort([t.xy[1] for t in ax.texts])
    assert np.diff(heights).min() * ax.bbox.height * 72 / ax.figure.dpi > 11.0 - 0.1
    assert heights[0] >= -1e-9
    assert heights[-1] <= 1 + 1e-9


def test_labels_skip_what_has_no_name_or_no_end(ax):
    ax.plot([0, 1], [0, 1])
    ax.plot([0, 1], [np.nan, np.nan], label="nothing")
    ax.plot([0, 1, 2], [0.5, 0.5, np.nan], label="ends early")
    plotting.label_ends(ax)
    assert [t.get_text() for t in ax.texts] == ["ends early"]


def test_ellipse_points_lie_on_the_ellipse():
    mean, cov = np.array([3.0, -1.0]), np.array([[4.0, 1.9], [1.9, 1.0]])
    points = plotting.ellipse_points(mean, cov, 2.5, 50)
    assert points.shape == (50, 2)
    away = points - mean
    assert_allclose(np.einsum("ki,ij,kj->k", away, np.linalg.inv(cov), away), 2.5**2, rtol=1e-10)
    assert_allclose(points[0], points[-1], atol=1e-12)


def test_only_exact_zeros_go_to_the_floor():
    found = plotting.at_floor([0, -0.0, 1e-300, 2, np.nan], 1e-20)
    assert_array_equal(found, [1e-20, 1e-20, 1e-300, 2, np.nan])


def test_failures_are_marked_and_counted(ax):
    assert plotting.mark_failures(ax, [1, 2, 3, 4], [0, 1, 0, 1], "UKF", row=2) == 2
    (marks,) = ax.get_lines()
    assert_array_equal(marks.get_xdata(), [2, 4])
    assert marks.get_color() == STYLES["UKF"]["color"]
    assert plotting.mark_failures(ax, [1, 2], [False, False], "UKF") == 0


def test_each_row_of_failures_lies_below_the_one_before(ax):
    for row in range(5):
        plotting.mark_failures(ax, [1.0], [True], "UKF", row=row)
    heights = np.array([marks.get_ydata()[0] for marks in ax.get_lines()])
    assert 1 > heights[0] > heights[-1] > 0.8
    assert_allclose(np.diff(heights), np.diff(heights)[0])


@pytest.mark.parametrize("log_k", [True, False])
def test_a_curve_wears_its_style_and_few_markers(ax, log_k):
    k = np.arange(1, 1001)
    plotting.error_axes(ax, log_k=log_k)
    plotting.curve(ax, "B-EKF 2", k, 1.0 / k, linewidth=3)
    (line,) = ax.get_lines()
    marks = line.get_markevery()
    assert line.get_label() == "B-EKF 2"
    assert line.get_marker() == STYLES["B-EKF 2"]["marker"]
    assert line.get_linewidth() == 3
    assert 8 <= len(marks) <= 12
    assert {marks[0], marks[-1]} == {0, 999}


def test_panels_are_a_flat_list():
    figure, axes = plotting.panels(2, 3)
    assert len(axes) == 6
    plt.close(figure)


@pytest.mark.parametrize("log", [False, True])
def test_maps_show_what_is_above_the_scale_and_what_failed(log):
    values = np.array([[1e-9, 1e-3, 2.0], [1.0, np.nan, np.inf]])
    figure, axes = plotting.map_panels(
        [1, 2, 3],
        [1, 2],
        {"one": values, "two": values.T.reshape(2, 3)},
        "I",
        (1e-6, 1),
        labels=("east", "north"),
        log=log,
    )
    assert (figure.get_supxlabel(), figure.get_supylabel()) == ("east", "north")
    assert [ax.get_title() for ax in axes] == ["one", "two"]
    figure.draw_without_rendering()
    found = [mpl.colors.to_hex(c) for c in axes[0].collections[0].get_facecolors()]
    black, failed = "#000000", plotting.EKF.lower()
    assert [c == black for c in found] == [False, False, True, False, False, True]
    assert [c == failed for c in found] == [False, False, False, False, True, False]
    grey = [mpl.colors.to_rgb(found[i]) @ np.array([0.3, 0.59, 0.11]) for i in (0, 1, 3)]
    assert grey[0] > grey[1] > grey[2] > 0.1
    assert axes[1].get_xscale() == ("log" if log else "linear")
    plt.close(figure)


def test_coastlines_of_a_window():
    """Galveston stands on the coast, and every coast has a point on each side that it must."""
    coasts = plotting.coastlines(-98, -92, 27, 31)
    to_galveston = np.concatenate(coasts) - [-94.79, 29.30]
    assert np.hypot(*to_galveston.T).min() < 0.2
    for coast in coasts:
        (left, bottom), (right, top) = coast.min(axis=0), coast.max(axis=0)
        assert left <= -92
        assert right >= -98
        assert bottom <= 31
        assert top >= 27
    assert plotting.coastlines(-40, -35, 30, 35) == []  # the open Atlantic


def test_arrows_of_a_diagram_run_level_or_upright_from_edge_to_edge(ax):
    boxes = {"a": (0, 0), "b": (3, 0), "c": (3, 2)}
    arrows = [("a", "b", "go", "-", 0.0), ("b", "a", "back", "-", 0.1), ("c", "b", "", "--", 0.2)]
    plotting.block_diagram(ax, boxes, arrows, inputs=["a"])
    assert ax.patches[0].get_facecolor() != ax.patches[1].get_facecolor()
    spans = [(t.xyann, t.xy) for t in ax.texts if getattr(t, "arrow_patch", None)]
    wanted = [((0.55, 0), (2.45, 0)), ((2.45, -0.1), (0.55, -0.1)), ((3.2, 1.68), (3.2, 0.32))]
    assert_allclose(spans, wanted, atol=1e-12)
    assert {"a", "b", "c", "go", "back"} <= {t.get_text() for t in ax.texts}


def test_nine_errors_of_runs_and_their_deviations():
    """Rows are position, velocity and misalignment; three deviations to each side; degrees."""
    times, rng = np.array([0.0, 10.0, 20.0]), np.random.default_rng(0)
    errors = rng.normal(size=(3, 5, 9))
    predicted, sample = np.full((3, 9), 2.0), np.full((3, 9), 1.0)
    both = {"predicted": predicted, "sample": sample}
    figure = plotting.nine_errors(times, errors, errors.mean(axis=1), both, (10, 20, 30))
    axes = figure.axes
    assert len(axes) == 9
    assert [ax.get_ylim()[1] for ax in axes[::3]] == [10, 20, 30]
    for ax in axes:  # one time for all
        assert ax.get_shared_x_axes().joined(ax, axes[0])
    for i, scale in ((1, 1.0), (5, 1.0), (8, np.rad2deg(1.0))):
        lines = axes[i].get_lines()
        assert len(lines) == 5 + 1 + 4  # runs, mean, both deviations to each side
        assert_allclose(lines[2].get_ydata(), scale * errors[:, 2, i])
        assert_allclose(
            [line.get_ydata()[0] for line in lines[6:]], scale * np.array([6, -6, 3, -3])
        )
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["mean", *both]
    plt.close(figure)


def test_tails_of_the_nees():
    values = {"one": np.array([3.0, 1.0, 2.0, 40.0]), "two": np.array([5.0])}
    figure = plotting.nees_tails(
        values, {"one": {"color": "red"}, "two": {"linestyle": "--"}}, dof=2
    )
    chi_square, one, two, bound = figure.axes[0].get_lines()
    assert_allclose(chi_square.get_ydata(), np.exp(-chi_square.get_xdata() / 2))
    assert_allclose(one.get_xdata(), [1, 2, 3, 40])
    assert_allclose(one.get_ydata(), [1, 0.75, 0.5, 0.25])
    assert (one.get_color(), two.get_linestyle()) == ("red", "--")
    assert_allclose(bound.get_xdata(), -2 * np.log(0.01))
    ax = figure.axes[0]  # where a run in 500, and a NEES of 150, can be read
    assert (ax.get_yscale(), ax.get_xscale()) == ("log", "linear")
    assert ax.get_ylim()[0] < 1 / 500 < 1 < ax.get_ylim()[1]
    assert ax.get_xlim()[0] == 0
    assert ax.get_xlim()[1] > 150
    plt.close(figure)


def test_a_cell_draws_its_figures_only_to_show_them():
    """To the pixel as if pyplot had drawn them before, which it does where it is connected."""
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    figure = "_, axes = plt.subplots(2, 2)\n_ = axes[0, 1].semilogy([1, 1e9], label='a')"
    cells = (
        "from matplotlib.backends.backend_agg import FigureCanvasAgg as Canvas\n"
        "from matplotlib import pyplot as plt\n"
        "from navfilters.book import plotting\n"
        "drawn = []\n"
        "Canvas.draw_idle = lambda canvas: (drawn.append(canvas), canvas.draw())\n"
        "plotting.use_style()",
        figure,
        "print(len(drawn))\nplt.install_repl_displayhook()\n"
        "hooks = get_ipython().events.callbacks['post_execute']\n"
        "hooks.insert(0, hooks.pop())\nhooks.remove(plotting.styles._lay_all_out)",
        figure,
        "print(len(drawn))",
    )
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    nbclient.NotebookClient(notebook, timeout=120).execute()
    _, (here,), (none,), (as_ever,), (one,) = (cell.outputs for cell in notebook.cells)
    assert (none.text, one.text) == ("0\n", "1\n")
    assert here.data["image/png"] == as_ever.data["image/png"]
