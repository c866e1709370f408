"""The ledger as the scorecard's data, and as the front page's bars."""

import json
from urllib.parse import parse_qs, urlsplit

from bs4 import BeautifulSoup
from entries import ENTRY

from navfilters.book import claims

SOURCE = '"perea2007, Fig. 1"'


def entries():
    one = ENTRY.replace('"someone1999, Fig. 1"', SOURCE)
    read = one.replace('"printed"', '"ours"\nown_rule = "A <test>."')
    return one.format(id="one"), one.format(id="two"), read.format(id="read")


def parsed(page):
    return BeautifulSoup(page._repr_html_(), "html.parser")


def test_the_data_hold_every_claim_and_end_no_script(ledger):
    ledger(*entries())
    soup = parsed(claims.database())
    rows = json.loads(soup.find("script", id="ledger").string)
    assert [row["id"] for row in rows] == ["one", "two", "read"]
    assert {row["paper"] for row in rows} == {"perea2007"}
    assert {row["source"] for row in rows} == {"Perea et al. 2007, Fig. 1"}
    assert [row["limit"] for row in rows] == ["printed", "printed", "ours"]
    assert rows[2]["rule"].startswith("A <test>.; ")
    assert rows[0]["page"] == "part/chapter.html#claim-one"
    assert json.loads(soup.div["data-names"])["perea2007"] == "Perea et al. 2007"
    assert repr(claims.database()) == "3 claims"


def test_a_bars_parts_are_as_long_as_their_counts_and_lead_to_them(ledger):
    ledger(*entries())
    soup = parsed(claims.bars())
    found = []
    for part in soup.find_all(class_="bar-part"):
        chosen = parse_qs(urlsplit(part["href"]).fragment)
        assert part["style"] == f"flex-grow: {part.get_text()}"
        found.append((chosen["paper"], chosen["limit"], chosen["verdict"], part.get_text()))
    assert found == [
        (["perea2007"], ["printed"], ["reproduced"], "2"),
        (["perea2007"], ["ours"], ["reproduced"], "1"),
    ]
    assert repr(claims.bars()).splitlines() == [
        "Perea et al. 2007 printed: {'reproduced': 2}",
        "Perea et al. 2007 ours: {'reproduced': 1}",
        "this book: 0",
    ]
