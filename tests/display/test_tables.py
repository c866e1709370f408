"""Tables of results: what a page shows, what a terminal and nbval see."""

import numpy as np
import pytest
from bs4 import BeautifulSoup
from IPython.core.formatters import DisplayFormatter

from navfilters.book import table

ROWS = [("EKF", -0.51234, 12, True), ("UKF, <turned>", 1.5e-7, 3, None)]
COLUMNS = {"filter": "", "error (m)": ".2e", "runs": "", "healthy": ""}


@pytest.fixture
def shown():
    return table(ROWS, COLUMNS, caption='Errors & "claims"')


def test_plain_text_is_aligned_and_ends_no_line_in_blanks(shown):
    assert repr(shown).splitlines() == [
        'Errors & "claims"',
        "filter         error (m)  runs  healthy",
        "EKF            -5.12e-01    12  yes",
        "UKF, <turned>   1.50e-07     3",
    ]


def test_html_has_a_caption_and_scopes_and_numbers_to_the_right(shown):
    soup = BeautifulSoup(shown._repr_html_(), "html.parser")
    assert soup.caption.get_text() == soup.find(role="group")["aria-label"] == 'Errors & "claims"'
    assert [th["scope"] for th in soup.select("thead th")] == ["col"] * 4
    assert [th.get_text() for th in soup.select('th[scope="row"]')] == ["EKF", "UKF, <turned>"]
    for row in soup.select("tr"):
        assert ["number" in cell.get("class", ()) for cell in row.find_all(["th", "td"])] == [
            False,
            True,
            True,
            False,
        ]
    assert soup.select("td")[0].decode_contents() == "−5.12\u2009×\u200910<sup>-1</sup>".replace(
        "-", "−"
    )


def test_rows_that_share_their_heading_are_a_group():
    rows = [("EKF", "A", 1.0), ("EKF", "B", 2.0), ("UKF", "A", 3.0), ("EKF", "A", 4.0)]
    shown = table(rows, ("filter", "reading", "error"), caption="c")
    soup = BeautifulSoup(shown._repr_html_(), "html.parser")
    headings = soup.select("tbody th")
    assert [th.get_text() for th in headings] == ["EKF", "UKF", "EKF"]
    assert [(th["scope"], th.get("rowspan")) for th in headings] == [
        ("rowgroup", "2"),
        ("row", None),
        ("row", None),
    ]
    assert [len(row.find_all(["th", "td"])) for row in soup.select("tbody tr")] == [3, 2, 3, 3]
    assert [line.split()[0] for line in repr(shown).splitlines()[2:]] == [
        "EKF",
        "EKF",
        "UKF",
        "EKF",
    ]


def test_a_notebook_stores_both_forms(shown):
    data, _ = DisplayFormatter().format(shown)
    assert data["text/plain"] == repr(shown)
    assert "<caption>" in data["text/html"]


def test_numbers_of_numpy_are_printed_as_numbers():
    shown = table([("a", np.float64(2.0), np.bool_(False), np.int64(7))], "xyzw", caption="c")
    assert repr(shown).splitlines()[-1].split() == ["a", "2", "no", "7"]


@pytest.mark.parametrize(
    ("rows", "says"), [([], "rows: found none"), ([("a",)], r"rows: found 1 .* need 2")]
)
def test_refuses_what_is_no_table(rows, says):
    with pytest.raises(ValueError, match=says):
        table(rows, ("x", "y"), caption="c")


@pytest.mark.parametrize(
    ("written", "shown"),
    [
        ("6.6e+04", "66,000"),
        ("2e+01", "20"),
        ("1.25e+01", "12.5"),
        ("-1.5e+02", "-150"),
        ("1e+06", "1e+06"),
        ("3.4e-01", "3.4e-01"),
        ("as 1e+02", "as 1e+02"),
    ],
)
def test_numbers_below_a_million_are_written_out(written, shown):
    assert repr(table([(written,)], ("x",), caption="c")).splitlines()[-1] == shown
