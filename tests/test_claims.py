"""The ledger's rules: which verdict a value gives, and what is refused."""

import math

import numpy as np
import pytest

from navfilters import claims
from navfilters.claims import (
    ESTABLISHED,
    IN_SHAPE,
    NOT_REPRODUCED,
    REPRODUCED,
    UNDERDETERMINED,
    Badge,
    Claim,
    ClaimError,
    Readings,
    derive,
)

PAPER = {"value": 10.0, "bound": {"at_most": 1.0}, "order": ["a", "b", "c"], "boolean": True}


def make(kind="value", **changes):
    """A claim of the kind, with the strictest rules."""
    fields = {
        "id": "some-claim",
        "chapter": "part/chapter",
        "source": "someone1999, Fig. 1",
        "statement": "It holds.",
        "kind": kind,
        "ours": 0,
        "verdict": NOT_REPRODUCED,
        "paper_value": PAPER.get(kind),
        "reason": "Because.",
    }
    if kind == "value":
        fields["reproduced_within"] = {"abs": 0.0}
    return Claim(**{**fields, **changes})


def finding(**changes):
    fields = {"verdict": ESTABLISHED, "paper_value": None, "agreement": {"rel": 1e-3}}
    return make(**{**fields, "reproduced_within": None, **changes})


# --- values -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rule", "inside", "outside"),
    [
        ({"abs": 0}, [10.0], [10.000001, 9.999999]),
        ({"abs": 0.5}, [9.5, 10.5], [9.49, 10.51]),
        ({"rel": 0.1}, [9.0, 11.0], [8.99, 11.01]),
        ({"abs": 0.5, "rel": 0.1}, [8.5, 11.5], [8.49, 11.51]),
        ({"factor": 2}, [5.0, 20.0], [4.99, 20.01, -10.0, 0.0]),
    ],
)
def test_value_within_its_rule(rule, inside, outside):
    strict = make(reproduced_within=rule)
    loose = make(shape_rule=rule)
    for value in inside:
        assert derive(strict, value) == REPRODUCED
        assert derive(loose, value) == (REPRODUCED if value == 10 else IN_SHAPE)
    for value in outside:
        assert derive(strict, value) == derive(loose, value) == NOT_REPRODUCED


def test_rel_and_factor_take_the_papers_value_as_their_measure():
    assert derive(make(paper_value=-10.0, reproduced_within={"rel": 0.1}), -11.0) == REPRODUCED
    assert derive(make(paper_value=-10.0, reproduced_within={"factor": 2}), -20.0) == REPRODUCED


def test_a_factor_between_tiny_numbers():
    """Their product is zero in floating point."""
    assert derive(make(paper_value=1e-200, reproduced_within={"factor": 2}), 2e-200) == REPRODUCED


@pytest.mark.parametrize("value", [[1.0, 2.0], (1, 2), np.array([1, 2]), [np.float64(1), 2]])
def test_value_of_several_numbers(value):
    claim = make(paper_value=[1.0, 2.05], reproduced_within={"abs": 0.1})
    assert derive(claim, value) == REPRODUCED
    assert derive(claim, [1.0, 2.2]) == NOT_REPRODUCED
    assert derive(claim, [1.0, 2.0, 3.0]) == derive(claim, 1.0) == NOT_REPRODUCED


# --- bounds -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("bound", "inside", "outside"),
    [
        ({"at_most": 1}, [1, -5, [0.5, 1.0]], [1.001, [0.5, 2.0]]),
        ({"at_least": 1}, [1, 5, np.array([1, 2])], [0.999, [0.5, 2.0]]),
        ({"at_least": 1, "at_most": 2}, [1, 2], [0.9, 2.1]),
    ],
)
def test_bound(bound, inside, outside):
    for value in inside:
        assert derive(make("bound", paper_value=bound), value) == REPRODUCED
    for value in outside:
        assert derive(make("bound", paper_value=bound), value) == NOT_REPRODUCED


def test_bound_in_shape():
    claim = make("bound", shape_rule={"at_most": 2.0})
    assert [derive(claim, x) for x in (1, 2, 3)] == [REPRODUCED, IN_SHAPE, NOT_REPRODUCED]


# --- orders and booleans ------------------------------------------------------------------------


def test_order_is_from_the_smallest_whatever_the_mappings_order():
    assert derive(make("order"), {"c": 3, "a": 1, "b": 2}) == REPRODUCED
    assert derive(make("order"), {"a": 1, "b": 1, "c": 3}) == NOT_REPRODUCED


@pytest.mark.parametrize(
    ("values", "swaps"), [((1, 2, 3), 0), ((2, 1, 3), 1), ((3, 1, 2), 2), ((3, 2, 1), 3)]
)
def test_order_in_shape_allows_swaps_of_neighbours(values, swaps):
    found = dict(zip("abc", values, strict=True))
    for allowed in (1, 2, 3):
        wanted = IN_SHAPE if swaps <= allowed else NOT_REPRODUCED
        claim = make("order", shape_rule={"swaps": allowed})
        assert derive(claim, found) == (wanted if swaps else REPRODUCED)


@pytest.mark.parametrize("names", ["ab", "abcd", "abx"])
def test_order_of_other_names_is_refused(names):
    with pytest.raises(ClaimError, match="some-claim"):
        derive(make("order"), dict.fromkeys(names, 1))


@pytest.mark.parametrize("truth", [True, False])
def test_boolean(truth):
    claim = make("boolean", paper_value=truth)
    for kind in (bool, np.bool_):
        assert derive(claim, kind(truth)) == REPRODUCED
        assert derive(claim, kind(not truth)) == NOT_REPRODUCED
    assert derive(claim, {"x": truth, "y": truth}) == REPRODUCED
    assert derive(claim, {"x": truth, "y": not truth}) == NOT_REPRODUCED


def test_boolean_in_shape_counts_the_parts_that_hold():
    claim = make("boolean", shape_rule={"holding": 2})
    assert derive(claim, {"x": True, "y": True, "z": False}) == IN_SHAPE
    assert derive(claim, {"x": True, "y": False, "z": False}) == NOT_REPRODUCED


# --- NaN ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("claim", "value"),
    [
        (make(reproduced_within={"abs": 1e9}, shape_rule={"rel": 1e9}), math.nan),
        (make(reproduced_within={"factor": 1e9}), math.nan),
        (make(reproduced_within={"abs": math.inf}), math.nan),
        (make(paper_value=[1.0, 2.0], reproduced_within={"abs": 9}), [1.0, math.nan]),
        (make("bound", shape_rule={"at_most": 9}), math.nan),
        (make("bound", paper_value={"at_least": 0}), [1.0, math.nan]),
        (make("order"), {"a": 1, "b": 2, "c": math.nan}),
        (make("order", shape_rule={"swaps": 3}), {"a": 1, "b": 2, "c": math.nan}),
        (make("boolean"), math.nan),
        (make("boolean"), {"x": True, "y": math.nan}),
    ],
    ids=lambda x: x.kind if isinstance(x, Claim) else str(x),
)
def test_nan_reproduces_nothing(claim, value):
    assert derive(claim, value) == NOT_REPRODUCED


def test_nan_agrees_with_nothing():
    with pytest.raises(ClaimError, match="differ"):
        derive(finding(agreement={"abs": 1e9}), math.nan, second=math.nan)


# --- readings and findings ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("values", "verdict"),
    [
        ((10, 10), REPRODUCED),
        ((11, 9), IN_SHAPE),
        ((99, 77), NOT_REPRODUCED),
        ((10, 11), UNDERDETERMINED),
        ((10, 99), UNDERDETERMINED),
    ],
)
def test_readings_share_a_verdict_or_leave_it_open(values, verdict):
    claim = make(shape_rule={"abs": 1})
    assert derive(claim, Readings(zip("xy", values, strict=True))) == verdict


def test_a_finding_needs_its_second_computation_and_their_agreement():
    assert derive(finding(), 1000.0, second=1000.9) == ESTABLISHED
    assert derive(finding(), [1.0, 2.0], second=np.array([1.0, 2.0])) == ESTABLISHED
    with pytest.raises(ClaimError, match="needs second"):
        derive(finding(), 1000.0)
    for second in (1002.0, [1000.0, 1000.0]):
        with pytest.raises(ClaimError, match="differ"):
            derive(finding(), 1000.0, second=second)


# --- malformed entries --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"kind": "number"}, "kind must be one of"),
        ({"verdict": "true"}, "verdict must be one of"),
        ({"verdict": NOT_REPRODUCED, "reason": ""}, "needs a reason"),
        ({"verdict": ESTABLISHED}, "a finding of the book's own"),
        ({"paper_value": None}, "a finding of the book's own"),
        ({"agreement": {"abs": 1}}, "a finding of the book's own"),
        ({"verdict": ESTABLISHED, "paper_value": None}, "a finding of the book's own"),
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
        ("value", {"reproduced_within": {"absolute": 1.0}}),
        ("value", {"shape_rule": {"at_most": 1.0}}),
        ("value", {"tolerance": {"digits": 3}}),
    ],
)
def test_a_rule_that_its_kind_does_not_know_is_refused(kind, changes):
    """A misspelt bound would hold for every value."""
    with pytest.raises(ClaimError, match="some-claim"):
        make(kind, **changes)


# --- the file -----------------------------------------------------------------------------------

ENTRY = """
[[claim]]
id = "{id}"
chapter = "part/chapter"
source = "someone1999, Fig. 1"
statement = "It is ten."
kind = "value"
paper_value = 10
reproduced_within = {{ abs = 1 }}
ours = 10.5
tolerance = {{ abs = 0.1 }}
verdict = "reproduced"
"""


@pytest.fixture
def ledger(tmp_path, monkeypatch):
    """Write a ledger in a folder above the working one."""
    (tmp_path / "book" / "part").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "book" / "part")
    path = tmp_path / "book" / "claims.toml"

    def write(*texts):
        path.write_text("".join(texts), encoding="utf-8")
        return path

    return write


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
    ],
)
def test_a_malformed_ledger_is_refused(ledger, texts, message):
    path = ledger(*texts)
    with pytest.raises(ClaimError, match=message):
        claims.load(path)


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
        .replace("paper_value = 10", "paper_value = true\nshape_rule = { holding = 1 }")
        .replace("ours = 10.5", "ours = { x = true, y = false }\nreason = 'One part.'")
        .replace('verdict = "reproduced"', 'verdict = "reproduced in shape"')
    )
    claims.check("parts", {"y": False, "x": True})
    for other in ({"x": False, "y": True}, {"x": True, "z": False}):
        with pytest.raises(ClaimError, match="recorded"):
            claims.check("parts", other)


def test_check_of_readings_compares_each_by_name(ledger):
    """Also the names within a reading."""
    ledger(
        ENTRY.format(id="open")
        .replace('"value"', '"order"')
        .replace("paper_value = 10", "paper_value = ['a', 'b']")
        .replace("ours = 10.5", "ours = { r = { a = 1, b = 2 }, s = { a = 2, b = 1 } }")
        .replace('verdict = "reproduced"', "verdict = 'underdetermined'\nreason = 'Two readings.'")
    )
    claims.check("open", Readings(s={"b": 1, "a": 2}, r={"b": 2, "a": 1}))
    with pytest.raises(ClaimError, match="found"):
        claims.check("open", Readings(r={"a": 1, "b": 3}, s={"a": 2, "b": 1}))


# --- what is shown ------------------------------------------------------------------------------

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


def test_summary_and_scorecard_count_and_list(ledger):
    own = "source = 'this book'\nagreement = { abs = 0 }\nreason = 'Two ways.'"
    ledger(
        ENTRY.format(id="ten"),
        ENTRY.format(id="own")
        .replace('source = "someone1999, Fig. 1"', own)
        .replace("paper_value = 10", "")
        .replace('"reproduced"', '"established here"'),
    )
    lines = repr(claims.summary()).splitlines()
    assert lines[0] == "reproduced: {'someone1999': 1, 'this book': 0}"
    assert lines[4:] == [
        "established here: {'someone1999': 0, 'this book': 1}",
        "all: {'someone1999': 1, 'this book': 1}",
    ]
    assert claims.summary()._repr_html_().count("<tr") == 7
    page = claims.scorecard("someone1999")._repr_html_()
    assert '<a href="part/chapter.html#claim-ten">Fig. 1</a>' in page
    assert "claim-own" not in page
    assert repr(claims.scorecard("this book")) == "[established here] own: paper none, ours 10.5"
    with pytest.raises(ClaimError, match="nobody"):
        claims.scorecard("nobody")
