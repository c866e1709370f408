"""Metadata of each replication: ReScience's fields, and what the book says elsewhere."""

import re

import pytest
import yaml
from browser import ROOT

from navfilters.book import claims
from navfilters.version import __version__

FOLDER = ROOT / "book" / "rescience"
WORKS = sorted(
    {c.source.split(",")[0] for c in claims.load(ROOT / "book" / "claims.toml").values()}
    - {"this book"}
)
PLAIN = {"title", "keywords", "abstract", "bibliography", "type", "domain", "language"}
LISTS = {
    "authors": {"name", "orcid", "email", "affiliations"},
    "affiliations": {"code", "name", "address"},
    "code": {"url", "doi", "swh"},
    "data": {"url", "doi"},
    "replication": {"cite", "bib", "url", "doi"},
    "review": {"url"},
    "contributors": {"name", "orcid", "role"},
    "dates": {"received", "accepted", "published"},
    "article": {"number", "doi", "url"},
    "journal": {"name", "issn", "volume", "issue"},
}


def read(work):
    return yaml.safe_load((FOLDER / f"{work}.yaml").read_text(encoding="utf-8"))


def joined(entries):
    """A list of small tables as one."""
    return {key: value for entry in entries for key, value in entry.items()}


def test_every_source_of_the_ledger_has_its_file():
    assert sorted(p.stem for p in FOLDER.glob("*.yaml")) == WORKS


@pytest.mark.parametrize("work", WORKS)
def test_its_fields_are_there(work):
    found = read(work)
    assert set(found) == PLAIN | set(LISTS)
    assert [name for name in PLAIN if not found[name]] == []
    for name, fields in LISTS.items():
        assert fields <= set(joined(found[name]))
    assert found["title"].startswith("[Re] ")
    assert found["type"] == "Replication"


@pytest.mark.parametrize("work", WORKS)
def test_it_says_what_the_book_says(work):
    found = read(work)
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    code = joined(found["code"])
    assert code["version"] == __version__ == citation["version"]
    assert code["license"] in citation["license"]
    assert [a["name"] for a in found["authors"]] == [a["name"] for a in citation["authors"]]
    bibliography = (FOLDER / found["bibliography"]).resolve().read_text(encoding="utf-8")
    entry = bibliography[bibliography.index(f"{{{joined(found['replication'])['bib']},") :]
    title = re.search(r"title\s*=\s*\{(.*)\}", entry)[1].replace("{", "").replace("}", "")
    assert found["title"] == f"[Re] {title}"
