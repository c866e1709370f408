"""The version is said in several places, once each, and it is the same."""

import re
from pathlib import Path

import pytest

from navfilters.version import __version__

ROOT = Path(__file__).resolve().parent.parent
PLACES = {
    "CHANGELOG.md": r"^## (\d+\.\d+\.\d+)",
    "CITATION.cff": r"^version: (\S+)",
    "_config.yml": r"navfilters (\d+\.\d+\.\d+)",
    "book/notation.md": r"navfilters (\d+\.\d+\.\d+)",
}


@pytest.mark.parametrize("name", PLACES)
def test_the_version_is_the_librarys(name):
    found = re.search(PLACES[name], (ROOT / name).read_text(encoding="utf-8"), re.MULTILINE)
    assert found[1] == __version__
