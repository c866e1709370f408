"""What the sources say, counted in their texts, against what the ledger checks and pages show."""

import re
import tomllib
from collections import Counter, defaultdict

import nbformat
import pytest
from browser import ROOT

BOOK = ROOT / "book"
STATEMENTS = tomllib.loads((BOOK / "statements.toml").read_text(encoding="utf-8"))["statement"]
CLAIMS = {
    claim["id"]: claim["source"]
    for claim in tomllib.loads((BOOK / "claims.toml").read_text(encoding="utf-8"))["claim"]
}
ANSWERS = ("claims", "set_aside", "open")
KINDS = ("statement", "figure", "table", "number", "equation")

# The figures and tables of each section, counted in the texts. The lecture has none.
FIGURES = {
    ("perea2007", "II"): ["Fig. 1"],
    ("perea2007", "IV"): ["Fig. 2(a)", "Fig. 2(b)", "Fig. 3"],
    ("perea2007", "IV.A"): ["Fig. 4"],
    ("perea2007", "V"): ["Fig. 5"],
    ("perea2007", "VI"): ["Fig. 6", "Fig. 7", *(f"Fig. 8({part})" for part in "abcd")],
    ("perea2007", "VI.A.1"): ["Fig. 9"],
    ("perea2007", "VII"): [f"Fig. 10({part})" for part in "abcde"],
    ("xiong2009", "4"): ["Fig. 1"],
    ("xiong2009", "5"): ["Fig. 2", "Fig. 3", "Fig. 4", "Fig. 5"],
    ("pogorelsky2020", "system-overview"): ["Figure 1"],
    ("pogorelsky2020", "image-formation"): ["Figure 2", "Figure 3", "Figure 4"],
    ("pogorelsky2020", "image-geolocation"): ["Figure 5"],
    ("pogorelsky2020", "filter"): ["Figure 6"],
    ("pogorelsky2020", "measurement-model"): ["Figure 7"],
    ("pogorelsky2020", "monte-carlo"): [f"Figure {n}({p})" for n in range(8, 12) for p in "abc"],
}
TABLES = {
    ("xiong2009", "5"): ["Table 1"],
    ("pogorelsky2020", "filter"): ["Table 1"],
    ("pogorelsky2020", "simulation-data"): ["Table 2"],
    ("pogorelsky2020", "parameters"): ["Table 3"],
    ("pogorelsky2020", "test-cases"): ["Table 4"],
}

# How many entries each section has, in the order of the text.
SECTIONS = {
    "perea2007": {
        "abstract": 3,
        "I": 6,
        "II": 11,
        "III": 6,
        "IV": 29,
        "IV.A": 29,
        "V": 15,
        "V.A": 5,
        "VI": 24,
        "VI.A": 1,
        "VI.A.1": 4,
        "VI.A.2": 9,
        "VII": 36,
        "VIII": 12,
    },
    "xiong2009": {
        "1": 12,
        "2.1": 8,
        "2.2": 21,
        "3": 27,
        "4": 13,
        "5": 43,
        "6": 5,
        "7.1": 10,
        "7.2": 3,
    },
    "pogorelsky2020": {
        "abstract": 3,
        "introduction": 6,
        "system-overview": 5,
        "image-formation": 19,
        "image-geolocation": 10,
        "filter": 11,
        "time-propagation": 5,
        "measurement-model": 8,
        "measurement-update": 15,
        "simulation-data": 11,
        "open-loop": 8,
        "parameters": 17,
        "test-cases": 3,
        "monte-carlo": 30,
        "conclusion": 3,
    },
    "lecture16": {
        "introduction": 4,
        "CT-LKF": 16,
        "CT-EKF": 10,
        "DT-EKF": 17,
        "algorithm": 6,
    },
}

# Checkable and not checked. A claim that closes one lowers its count; nothing may raise it unseen.
OPEN = {"perea2007": 3, "xiong2009": 12, "pogorelsky2020": 1, "lecture16": 0}

every_work = pytest.mark.parametrize("work", SECTIONS)


def labels():
    """The names that a chapter gives to its figures, and the targets in its text."""
    for path in BOOK.rglob("*.ipynb"):
        for cell in nbformat.read(path, as_version=4).cells:
            yield cell.metadata.get("mystnb", {}).get("figure", {}).get("name")
            if cell.cell_type == "markdown":
                yield from re.findall(r"^\(([\w-]+)\)=$", cell.source, re.M)


def entries(work, **wanted):
    return [
        entry
        for entry in STATEMENTS
        if entry["work"] == work and all(entry[key] == value for key, value in wanted.items())
    ]


def of_source(work):
    return {name for name, source in CLAIMS.items() if source.startswith(work)}


def test_every_entry_is_whole_and_has_one_answer():
    for entry in STATEMENTS:
        assert sum(answer in entry for answer in ANSWERS) == 1, entry["id"]
        assert entry.keys() - {*ANSWERS, "shown"} == {"id", "work", "section", "what", "text"}
        assert entry["what"] in KINDS, entry["id"]
        assert entry.get("claims", [1]), entry["id"]
        assert len(entry.get("set_aside", entry.get("open", "long enough"))) > 10, entry["id"]


def test_ids_are_unique_and_number_each_section_in_order():
    ids = [entry["id"] for entry in STATEMENTS]
    assert sorted(ids) == sorted(set(ids))
    numbers = defaultdict(list)
    for entry in STATEMENTS:
        head, _, number = entry["id"].rpartition("-")
        assert head.endswith(entry["section"].replace(".", "-")), entry["id"]
        numbers[entry["work"], entry["section"]].append(int(number))
    assert all(found == list(range(1, len(found) + 1)) for found in numbers.values())


@every_work
def test_each_section_has_its_count_in_the_order_of_the_text(work):
    found = Counter(entry["section"] for entry in entries(work))
    assert list(found.items()) == list(SECTIONS[work].items())


@pytest.mark.parametrize(("what", "table"), [("figure", FIGURES), ("table", TABLES)])
def test_figures_and_tables_are_those_of_the_texts(what, table):
    found = defaultdict(list)
    for entry in STATEMENTS:
        if entry["what"] == what:
            found[entry["work"], entry["section"]].append(entry["text"].partition(":")[0])
    assert found == table


def test_what_the_pages_show_is_there():
    known = set(labels())
    shown = {entry["id"]: entry["shown"] for entry in STATEMENTS if "shown" in entry}
    assert {name: label for name, label in shown.items() if label not in known} == {}


def test_every_figure_and_table_is_checked_shown_or_set_aside():
    for entry in STATEMENTS:
        if entry["what"] in ("figure", "table"):
            assert {"claims", "shown", "set_aside"} & entry.keys(), entry["id"]


def test_every_claim_named_is_in_the_ledger():
    named = {name for entry in STATEMENTS for name in entry.get("claims", ())}
    assert named - CLAIMS.keys() == set()


@every_work
def test_every_claim_of_a_source_checks_one_of_its_statements(work):
    named = {name for entry in entries(work) for name in entry.get("claims", ())}
    assert of_source(work) - named == set(), "name it in statements.toml"


@every_work
def test_no_statement_rests_on_another_source(work):
    other = set().union(*(of_source(source) for source in SECTIONS if source != work))
    named = {name for entry in entries(work) for name in entry.get("claims", ())}
    assert named & other == set()


@every_work
def test_what_is_open_is_counted(work):
    """Run with -s for the table of each section: entries, checked, set aside, open, claims."""
    print(f"\n{work}")  # noqa: T201, the table is for whoever runs it with -s
    for section in SECTIONS[work]:
        here = entries(work, section=section)
        answers = Counter(answer for entry in here for answer in ANSWERS if answer in entry)
        claims = {name for entry in here for name in entry.get("claims", ())}
        counts = [len(here), *(answers[answer] for answer in ANSWERS), len(claims)]
        print(f"  {section:20}" + "".join(f"{count:6}" for count in counts))  # noqa: T201
    assert sum("open" in entry for entry in entries(work)) == OPEN[work]
