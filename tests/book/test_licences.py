"""The list of licences on the page, held against every file that is shipped."""

import subprocess
import tomllib
from fnmatch import fnmatchcase
from importlib import metadata

import pytest
from browser import ROOT

WORKS = tomllib.loads((ROOT / "book" / "licences.toml").read_text(encoding="utf-8"))["work"]
SAID = {  # words of a package's metadata for what the list calls by its name in SPDX
    "Apache-2.0": "apache",
    "BSD-2-Clause": "bsd",
    "BSD-3-Clause": "bsd",
    "MIT": "mit",
}
SHIPPED = ("lib/", "book/_static/")  # as files of their own; the rest of book/ is text and figures


def owners(kind, file):
    return [w["what"] for w in WORKS if any(fnmatchcase(file, p) for p in w.get(kind, []))]


def source():
    """Files of the project, as far as they are not made anew."""
    command = ["git", "ls-files", "-z", *SHIPPED]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("needs a checkout")
    return listed.stdout.rstrip("\0").split("\0")


def pages(html):
    below = html / "_static"
    files = [p.relative_to(below).as_posix() for p in below.rglob("*") if p.is_file()]
    return [file for file in files if not file.startswith("licences/")]


def check(kind, files):
    assert [file for file in files if len(owners(kind, file)) != 1] == []
    patterns = [pattern for work in WORKS for pattern in work.get(kind, [])]
    assert [p for p in patterns if not any(fnmatchcase(file, p) for file in files)] == []


def test_every_file_of_the_project_has_one_licence():
    check("source", source())


def test_every_file_of_the_pages_has_one_licence(html):
    check("pages", pages(html))


def test_packages_say_the_same_licence():
    for work in (w for w in WORKS if "package" in w):
        found = metadata.metadata(work["package"])
        said = [found.get(key) or "" for key in ("License", "License-Expression")]
        said += [c for c in found.get_all("Classifier") or [] if c.startswith("License")]
        assert SAID[work["licence"]] in " ".join(said).lower(), work


def test_the_texts_of_the_licences_are_shipped_with_the_pages(html):
    """Each as the package has it; with a word that its licence, and no other of them, has."""
    words = {"MIT": "Permission is hereby granted", "Apache-2.0": "Apache License"}
    for work in (w for w in WORKS if "package" in w):
        text = (html / "_static" / "licences" / f"{work['package']}.txt").read_text("utf-8")
        assert words.get(work["licence"], "Redistribution and use in source") in text, work
        assert "text" in work or work["holder"].split()[-1] in text, work


def test_a_file_without_licence_is_seen():
    assert owners("pages", "some/new.js") == []
    with pytest.raises(AssertionError):
        check("source", [*source(), "lib/navfilters/new.bin"])


def test_data_of_others_have_their_licence_beside_them():
    for work in WORKS:
        others = "navfilters" not in work["holder"]
        for pattern in work.get("source", []) if others else []:
            folder = (ROOT / pattern).parent
            assert {"LICENSE.txt", "NOTICE.txt"} <= {path.name for path in folder.iterdir()}
