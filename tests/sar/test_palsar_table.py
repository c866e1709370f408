"""The table of fields in the book: those that the reader uses, as its own lists have them."""

from pathlib import Path

import pytest
from palsar_files import leader_bytes
from palsar_frames import frame_bytes, shifted, write

from navfilters.sar.palsar.ceos_records import Record
from navfilters.sar.palsar.frames import open_frames
from navfilters.sar.palsar.image_headers import IMAGE, LINE, Headers
from navfilters.sar.palsar.leader_records import LEADER, POSITION, SUMMARY

PAGE = Path(__file__).parents[2] / "book/api/sar.md"
RECORDS = {
    "image: file descriptor": IMAGE,
    "image: line": LINE,
    "leader: file descriptor": LEADER,
    "leader: data set summary": SUMMARY,
    "leader: platform position": POSITION,
}


def rows():
    """Of the table: byte from the record's start, type, field, grade."""
    for record, fields in RECORDS.items():
        for name, field in fields.items():
            if field.seen:
                yield f"| {record} | {field.offset} | {field.kind} | {name} | {field.seen} |"


def test_the_books_table_is_the_readers():
    text = PAGE.read_text(encoding="utf-8")
    table = text.split("| record | byte | type | field | grade |\n|---|---|---|---|---|\n")[1]
    assert table.split("\n\n")[0].rstrip("\n").split("\n") == list(rows())


def test_graded_fields_are_those_that_are_used(tmp_path, monkeypatch):
    """Whatever is asked for while frames are joined, or refused for a gap or for their orbits."""
    used = set()

    def watch(kind, method, fields):
        plain = getattr(kind, method)

        def watched(self, name, *rest, **options):
            used.add((id(fields(self)), name))
            return plain(self, name, *rest, **options)

        monkeypatch.setattr(kind, method, watched)

    for method in ("text", "number"):
        watch(Record, method, lambda self: self.fields)
    for method in ("within", "refuse"):
        watch(Headers, method, lambda _: LINE)
    calibrated = leader_bytes(summary=[(1766, "I4", 1)])
    first = write(tmp_path / "0", 0, frame_bytes(0, 120), calibrated)
    assert open_frames([first, write(tmp_path / "1", 1, frame_bytes(90, 200))]).lines == 200
    for cut, leader, words in [((150, 200), {}, "gap"), ((90, 200), shifted(x=9.0), "orbit kind")]:
        later = write(tmp_path / "1", 1, frame_bytes(*cut), leader_bytes(**leader))
        with pytest.raises(ValueError, match=words):
            open_frames([first, later])
    for fields in RECORDS.values():
        graded = {name for name, field in fields.items() if field.seen}
        assert {name for kind, name in used if kind == id(fields)} == graded
        assert {field.seen for field in fields.values()} <= {"", "A", "B", "C"}
