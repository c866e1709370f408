"""Sentences with the ledger's numbers."""

import pytest
from entries import ENTRY

from navfilters.book import claims
from navfilters.book.claims import ClaimError

PARTS = ENTRY.format(id="parts").replace("ours = 10.5", 'ours = { a = 1.5, "b/c" = [2, 3] }')


@pytest.fixture(autouse=True)
def _written(ledger):
    ledger(ENTRY.format(id="ten"), PARTS)


@pytest.mark.parametrize(
    ("written", "read"),
    [
        ("It is {ten}.", "It is 10.5."),
        ("{ten!paper} is printed", "10 is printed"),
        ("{parts|a} and {parts|b/c|1}", "1.5 and 3"),
        ("it {ten=holds}", "it holds"),
    ],
)
def test_a_place_is_filled_and_linked(written, read):
    page = claims.told(written)
    assert repr(page) == read
    assert 'href="part/chapter.html#claim-' in page._repr_html_()


@pytest.mark.parametrize("written", ["{eleven}", "{parts|d}", "{parts|b/c|7}", "{ten|0}"])
def test_what_the_ledger_lacks_is_refused(written):
    with pytest.raises(ClaimError, match=r"no claim|no part"):
        claims.told(written)


def test_a_table_of_omissions_has_a_row_each():
    page = claims.omissions([("units", "they scale", "{ten}"), ("seeds", "one is none", "{ten}")])
    assert page._repr_html_().count("<tr>") == 3
    assert "units | they scale | 10.5" in repr(page)


def test_verdicts_are_counted():
    assert claims.verdicts_of("someone1999") == "someone1999: of 2 claims, 2 reproduced"
    with pytest.raises(ClaimError, match="no claim"):
        claims.verdicts_of("nobody")
