"""What a reader sees of the ledger."""

import re

import pytest
from entries import ENTRY, finding, make

from navfilters.book import claims
from navfilters.book.claims import Badge, ClaimError

# --- what is shown ------------------------------------------------------------------------------

OURS = {"threshold": "ours", "own_rule": "A test."}
SHOWN = {
    "value": (
        make(ours=1.23456789e-7),
        "paper 10, ours 1.2346e-07",
        "1.2346&thinsp;×&thinsp;10<sup>-7",
    ),
    "bound": (make("bound", ours=[1, 2.5]), "at_most: 1, ours 1, 2.5", "paper ≤ 1 · ours 1, 2.5"),
    "order": (
        make("order", ours={"a": 1, "b": 0}),
        "paper a, b, c",
        "paper a, b, c · ours a: 1; b: 0",
    ),
    "boolean": (make("boolean", ours=False), "paper yes, ours no", "paper yes · ours no"),
    "reading": (
        make("bound", ours=2, **OURS),
        "read as at_most: 1, ours 2",
        "read as ≤ 1 · ours 2",
    ),
    "finding": (finding(ours=3), "paper none, ours 3", 'numbers">ours 3<'),
}


@pytest.mark.parametrize("kind", SHOWN)
def test_the_badge_shows_both_values_and_the_verdict(kind):
    claim, plain, rich = SHOWN[kind]
    assert repr(Badge(claim)).startswith(f"[{claim.verdict}] some-claim: ")
    assert plain in repr(Badge(claim))
    html = Badge(claim)._repr_html_()
    assert rich in html
    assert f'class="claim claim-{claim.verdict.replace(" ", "-")}" id="claim-some-claim"' in html
    for text in (claim.verdict, claim.statement, claim.source, claim.reason):
        assert f">{text}<" in html or f" {text} <" in html


def test_the_badge_escapes_what_it_shows():
    claim = make("order", statement="a < b & c", source="x, <i>", reason="<b>", ours={"<s>": 1})
    html = Badge(claim)._repr_html_()
    for text in ("a &lt; b &amp; c", "x, &lt;i&gt;", "&lt;b&gt;", "&lt;s&gt;: 1"):
        assert text in html
    assert not any(tag in html for tag in ("<i>", "<b>", "<s>"))


@pytest.mark.parametrize(
    ("source", "read"),
    [
        ("perea2007, Eq. (1)", "Perea et al. 2007, Eq. (1)"),
        (
            "this book, on xiong2009 and sarkka2009",
            "this book, on Xiong et al. 2009 and Särkkä and",
        ),
        ("someone1999, Fig. 1", "someone1999, Fig. 1"),
    ],
)
def test_a_work_is_called_by_its_name(source, read):
    assert f">{read}" in Badge(make(source=source))._repr_html_()


def test_no_claim_of_the_book_shows_a_key_of_the_bibliography():
    text = claims.find().with_name("references.bib").read_text(encoding="utf-8")
    keys = re.compile("|".join(re.findall(r"^@\w+{([\w-]+),", text, re.M)))
    shown = [Badge(c)._repr_html_() for c in claims.load().values()]
    assert [html for html in shown if keys.search(html)] == []


def test_summary_and_scorecard_count_and_list(ledger):
    own = "source = 'this book'\nagreement = { abs = 0 }\nroute = 'Two ways.'"
    ledger(
        ENTRY.format(id="ten"),
        ENTRY.format(id="own")
        .replace('source = "someone1999, Fig. 1"', own)
        .replace("paper_value = 10", "")
        .replace('threshold = "printed"', "")
        .replace('"reproduced"', '"established here"'),
        ENTRY.format(id="word").replace('"printed"', '"ours"\nown_rule = "A test."'),
    )
    counts = "{'reproduced': 1, 'reproduced in shape': 0, 'underdetermined': 0, "
    counts += "'not reproduced': 0, 'all': 1}"
    assert repr(claims.summary()).splitlines() == [
        f"someone1999 printed: {counts}",
        f"someone1999 ours: {counts}",
        "established here, as findings of this book's own: 1",
    ]
    assert claims.summary()._repr_html_().count("<tr") == 3
    page = claims.scorecard("someone1999")._repr_html_()
    assert '<a href="part/chapter.html#claim-ten">Fig. 1</a>' in page
    assert "claim-own" not in page
    assert "<summary>2 claims: " in page
    assert "<summary>1 claim: " in claims.scorecard("this book")._repr_html_()
    assert repr(claims.scorecard("this book")) == "[established here] own: paper none, ours 10.5"
    with pytest.raises(ClaimError, match="nobody"):
        claims.scorecard("nobody")


def test_under_a_claim_stands_whatever_its_verdict_hangs_on():
    claim = make(
        left_open="The unit.", revised=[{"was": "a factor of 5", "why": "One rule a word."}]
    )
    html = Badge(claim)._repr_html_()
    for text in ("Left open: The unit.", "The rule was a factor of 5; changed: One rule a word."):
        assert f'<div class="claim-reason">{text}</div>' in html
    assert "Twice: Another way." in Badge(finding())._repr_html_()


def test_rules_lists_every_word_with_those_that_depart_from_it(ledger):
    bound = ENTRY.replace("reproduced_within = {{ abs = 1 }}", "").replace('"value"', '"bound"')
    word = "[word.much]\nmeaning = 'a ratio'\nrule = {at_least = 10}\n"
    same = bound.replace("= 10\n", "= {{at_least = 10}}\n").replace(
        '"printed"', '"ours"\nword = "much"'
    )
    other = same.replace("at_least = 10", "at_least = 3").replace(
        "word =", "own_rule = 'Four.'\nword ="
    )
    ledger(word, same.format(id="ten"), other.format(id="three"))
    assert repr(claims.rules()).splitlines() == [
        "much: 1 and 1 others",
        "printed numbers: 0 and 0 others",
        "readings of another kind: 0 and 0 others",
    ]
    html = claims.rules()._repr_html_()
    assert "much: a ratio" in html
    assert "three (at_least: 3): Four." in html
    assert "<td>≥ 10</td><td>1</td><td>1</td>" in html


STATEMENT = """
[[statement]]
id = "{id}"
work = "someone1999"
section = "II"
what = "number"
text = "It is <ten>."
{state}
"""


def test_statements_counts_what_is_checked_set_aside_and_open(ledger, tmp_path):
    ledger(ENTRY.format(id="ten"))
    states = ("claims = ['ten']", "set_aside = 'A definition.'", "open = 'The sum.'")
    texts = [STATEMENT.format(id=f"s-{i}", state=s) for i, s in enumerate(states)]
    (tmp_path / "book" / "statements.toml").write_text("".join(texts), encoding="utf-8")
    page = claims.statements()
    assert repr(page) == "someone1999: {'all': 3, 'checked': 1, 'set aside': 1, 'open': 1}"
    assert "<td>3</td><td>1</td><td>1</td><td>1</td>" in page._repr_html_()
    assert "section II: It is &lt;ten&gt;. A claim would compute: The sum." in page._repr_html_()


@pytest.mark.parametrize(
    ("states", "message"),
    [
        ((("a", ""),), "a: exactly one"),
        ((("a", "open = 'x'\nset_aside = 'y'"),), "a: exactly one"),
        ((("a", "open = 'x'"), ("a", "open = 'y'")), "two statements of one id"),
    ],
)
def test_a_malformed_list_of_statements_is_refused(tmp_path, states, message):
    path = tmp_path / "statements.toml"
    path.write_text("".join(STATEMENT.format(id=i, state=s) for i, s in states), encoding="utf-8")
    with pytest.raises(ClaimError, match=message):
        claims.load_statements(path)
