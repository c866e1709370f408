"""Entries that are not one, the file, and what a chapter calls."""

import pytest
from entries import ENTRY, finding, make

from navfilters.book import claims
from navfilters.book.claims import ESTABLISHED, NOT_REPRODUCED, ClaimError, Readings

# --- malformed entries --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"kind": "number"}, "kind must be one of"),
        ({"verdict": "true"}, "verdict must be one of"),
        ({"verdict": NOT_REPRODUCED, "reason": ""}, "needs a reason"),
        ({"verdict": ESTABLISHED}, "a finding of the book's own"),
        ({"verdict": ESTABLISHED, "paper_value": None}, "a finding of the book's own"),
        ({"paper_value": None}, "has a paper_value and no agreement"),
        ({"agreement": {"abs": 1}}, "has a paper_value and no agreement"),
        ({"threshold": None}, "threshold must be"),
        ({"threshold": "theirs"}, "threshold must be"),
        ({"threshold": "ours"}, "needs the word that it reads"),
        ({"word": "much"}, "reads no word"),
        ({"shape_rule": {"factor": 10}}, "a printed number's shape_rule"),
        ({"quantifier": "all"}, "quantifier can only be"),
        ({"revised": [{"was": "5"}]}, "revised is a list"),
        ({"reproduced_within": None}, "needs reproduced_within"),
    ],
)
def test_a_malformed_entry_is_refused(changes, message):
    with pytest.raises(ClaimError, match=f"some-claim: .*{message}"):
        make(**changes)


@pytest.mark.parametrize(
    ("kind", "changes"),
    [
        ("bound", {"paper_value": {"atmost": 1.0}}),
        ("bound", {"paper_value": {}}),
        ("bound", {"paper_value": 1.0}),
        ("bound", {"shape_rule": {"abs": 1.0}}),
        ("order", {"shape_rule": {"swap": 1}}),
        ("boolean", {"shape_rule": {"swaps": 1}}),
        ("boolean", {"shape_rule": {"holding": 1}}),
        ("value", {"reproduced_within": {"absolute": 1.0}}),
        ("value", {"shape_rule": {"at_most": 1.0}}),
        ("value", {"tolerance": {"digits": 3}}),
    ],
)
def test_a_rule_that_its_kind_does_not_know_is_refused(kind, changes):
    """A misspelt bound would hold for every value."""
    with pytest.raises(ClaimError, match="some-claim"):
        make(kind, **changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"route": ""}, "route"),
        ({"threshold": "ours"}, "neither"),
        ({"agreement": None}, "agreement"),
    ],
)
def test_a_finding_without_its_route_or_with_a_threshold_is_refused(changes, message):
    with pytest.raises(ClaimError, match=f"some-claim: .*{message}"):
        finding(**changes)


# --- the file -----------------------------------------------------------------------------------


def test_the_ledger_is_found_in_the_folder_or_above_it(ledger, tmp_path):
    path = ledger(ENTRY.format(id="ten"))
    assert claims.find() == claims.find(tmp_path) == claims.find(tmp_path / "book") == path
    assert list(claims.load()) == list(claims.load(path)) == ["ten"]


def test_no_ledger_is_an_error(tmp_path):
    with pytest.raises(ClaimError, match=r"no book/claims\.toml"):
        claims.find(tmp_path)


def test_a_changed_ledger_is_read_again(ledger):
    path = ledger(ENTRY.format(id="ten"))
    assert "ten" in claims.load(path)
    ledger(ENTRY.format(id="ten"), ENTRY.format(id="eleven"))
    assert "eleven" in claims.load(path)


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        ((ENTRY.format(id="ten"),) * 2, "ten: two entries"),
        ((ENTRY.format(id="ten"), "color = 'red'"), "ten: .*color"),
        (("[[claim]]\nid = 'ten'",), "ten: .*missing"),
        (("[[claim]]\nkind = 'value'",), "an entry without id"),
        (("\na" + 3000 * ".a" + " = 1",), r"claims.toml must be .*more than 200 dots in line 2"),
    ],
)
def test_a_malformed_ledger_is_refused(ledger, texts, message):
    path = ledger(*texts)
    with pytest.raises(ClaimError, match=message):
        claims.load(path)


WORDS = """
[word.much]
meaning = "a ratio"
rule = { at_least = 10 }

[word.similar]
meaning = "a ratio"
rule = { factor = 1.5 }
"""


def reads(word, rule, kind="bound", more=""):
    """An entry that reads a word by a rule."""
    value = "paper_value = 10\nreproduced_within" if kind == "value" else "paper_value"
    return (
        ENTRY.format(id="ten")
        .replace('"printed"', f'"ours"\nword = "{word}"\n{more}')
        .replace('kind = "value"', f'kind = "{kind}"')
        .replace("paper_value = 10\nreproduced_within = { abs = 1 }", f"{value} = {rule}")
    )


@pytest.mark.parametrize(
    "entry",
    [
        reads("much", "{ at_least = 10 }"),
        reads("similar", "{ factor = 1.5 }", "value"),
        reads("much", "{ at_least = 3 }", more='own_rule = "There are only four."'),
    ],
)
def test_an_entry_reads_its_word_as_the_table_does_or_says_why_not(ledger, entry):
    path = ledger(WORDS, entry)
    assert claims.load(path)["ten"].threshold == "ours"
    assert list(claims.load_words(path)) == ["much", "similar"]


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        (reads("much", "{ at_least = 3 }"), "'much' is read as"),
        (reads("similar", "{ factor = 2 }", "value"), "'similar' is read as"),
        (reads("huge", "{ at_least = 10 }"), "no word 'huge'"),
        (reads("much", "{ at_least = 10 }\nshape_rule = { at_least = 2 }"), "'much' is read as"),
    ],
)
def test_another_reading_of_a_word_is_refused(ledger, entry, message):
    with pytest.raises(ClaimError, match=f"ten: {message}"):
        claims.load(ledger(WORDS, entry))


# --- check --------------------------------------------------------------------------------------


def test_check_accepts_the_recorded_verdict_and_value(ledger):
    ledger(ENTRY.format(id="ten"))
    assert claims.check("ten", 10.59) is None


def test_check_of_an_unknown_claim(ledger):
    ledger(ENTRY.format(id="ten"))
    with pytest.raises(ClaimError, match="no claim 'nine'"):
        claims.check("nine", 9)


def test_check_refuses_another_verdict_and_names_both(ledger):
    ledger(ENTRY.format(id="ten"))
    with pytest.raises(ClaimError, match=r"ten: recorded as 'reproduced'.*12.*'not reproduced'"):
        claims.check("ten", 12.0)


@pytest.mark.parametrize("value", [10.39, 10.61, [10.5, 10.5]])
def test_check_refuses_a_value_that_drifted(ledger, value):
    text = ENTRY.format(id="ten").replace("paper_value = 10", "paper_value = [10, 10]")
    ledger(text if isinstance(value, list) else ENTRY.format(id="ten"))
    with pytest.raises(ClaimError, match=r"ten: found .* recorded 10\.5"):
        claims.check("ten", value)


def test_check_compares_exactly_without_tolerance(ledger):
    ledger(ENTRY.format(id="ten").replace("tolerance = { abs = 0.1 }", ""))
    claims.check("ten", 10.5)
    with pytest.raises(ClaimError, match="found"):
        claims.check("ten", 10.5 + 1e-12)


def test_check_compares_parts_by_name(ledger):
    ledger(
        ENTRY.format(id="parts")
        .replace('"value"', '"boolean"')
        .replace("paper_value = 10", "paper_value = true")
        .replace("ours = 10.5", "ours = { x = true, y = false }\nreason = 'One part.'")
        .replace('verdict = "reproduced"', 'verdict = "not reproduced"')
    )
    claims.check("parts", {"y": False, "x": True})
    for other in ({"x": False, "y": True}, {"x": True, "z": False}):
        with pytest.raises(ClaimError, match="recorded"):
            claims.check("parts", other)


OPEN = "verdict = 'underdetermined'\nreason = 'Two readings.'\nleft_open = 'The order.'"


def test_check_of_readings_compares_each_by_name(ledger):
    """Also the names within a reading."""
    ledger(
        ENTRY.format(id="open")
        .replace('"value"', '"order"')
        .replace("paper_value = 10", "paper_value = ['a', 'b']")
        .replace("ours = 10.5", "ours = { r = { a = 1, b = 2 }, s = { a = 2, b = 1 } }")
        .replace('verdict = "reproduced"', OPEN)
    )
    claims.check("open", Readings(s={"b": 1, "a": 2}, r={"b": 2, "a": 1}))
    with pytest.raises(ClaimError, match="found"):
        claims.check("open", Readings(r={"a": 1, "b": 3}, s={"a": 2, "b": 1}))
