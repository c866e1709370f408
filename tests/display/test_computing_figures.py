"""The place of a figure that computes: what it is told, and what it refuses."""

import json
from dataclasses import dataclass

import pytest
from bs4 import BeautifulSoup

from navfilters.book import figures
from navfilters.estimators import FILTERS


@dataclass(frozen=True)
class Start:
    x0: tuple[float, float] = (20.0, 80.0)
    words: str = "</script><b>"


def parsed(*given, **settings):
    soup = BeautifulSoup(figures.computing(*given, **settings).data, "html.parser")
    return soup.figure, json.loads(soup.figure.script.string)


def test_a_dataclass_and_settings_reach_the_script():
    figure, told = parsed("two-updates", "a < b", Start(), steps=3)
    assert figure["data-figure"] == "two-updates"
    assert figure.figcaption.get_text() == "a < b"
    assert figure.find(class_="stage").get_text() == ""
    assert told["x0"] == [20.0, 80.0]
    assert told["steps"] == 3


def test_no_text_ends_the_script():
    _, told = parsed("start", "", {"words": "</script><b>"})
    assert told["words"] == Start.words
    assert "</script><b>" not in figures.computing("start", "", Start()).data


def test_every_filter_has_a_stroke_of_its_own():
    _, told = parsed("start", "", {})
    strokes = {(style["color"], style["dash"]) for style in told["styles"].values()}
    assert set(told["styles"]) == set(FILTERS)
    assert len(strokes) == len(FILTERS)
    assert told["styles"]["EKF"]["dash"] == ""


@pytest.mark.parametrize(("instead", "kept"), [(0, None), (True, "1"), (2, "2")])
def test_it_takes_the_place_of_cells_before_it(instead, kept):
    figure, _ = parsed("start", "", {}, instead=instead)
    assert figure.get("data-instead") == kept


def test_what_is_plain_stands_in_the_page():
    figure, _ = parsed("cures", "", {}, plain="<table><tr><td>1</td></tr></table>")
    assert figure.table.td.get_text() == "1"


@pytest.mark.parametrize("name", ["", "Start", "../start", None])
def test_a_name_that_is_none_is_refused(name):
    with pytest.raises(ValueError, match="name must be that of a script"):
        figures.computing(name, "", {})


@pytest.mark.parametrize("setup", [3, Start, [1.0]])
def test_a_setup_must_be_a_dataclass_or_a_mapping(setup):
    with pytest.raises(TypeError, match="setup must be a dataclass or a mapping; found"):
        figures.computing("start", "", setup)


def test_a_negative_number_of_cells_is_refused():
    with pytest.raises(ValueError, match="instead"):
        figures.computing("start", "", {}, instead=-1)


@pytest.mark.parametrize(
    ("value", "error"), [(float("nan"), ValueError), ([float("inf")], ValueError), (1j, TypeError)]
)
def test_what_a_script_cannot_read_is_named(value, error):
    with pytest.raises(error, match="noise must be finite numbers, texts and tuples"):
        figures.computing("start", "", {}, noise=value)
