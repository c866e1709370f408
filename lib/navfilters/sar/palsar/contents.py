"""What a file of an ALOS PALSAR level-1.0 product holds, in words."""

from collections.abc import Iterator
from pathlib import Path

from navfilters.sar.palsar.ceos_records import Record
from navfilters.sar.palsar.image_headers import LINE, read_headers
from navfilters.sar.palsar.leader_file import read_leader


def contents(path: Path) -> str:
    """The fields of an image or leader file as they stand, each after its byte.

    Parameters
    ----------
    path : Path

    Returns
    -------
    str

    Raises
    ------
    ValueError
        Neither file of a level-1.0 product, or one that is cut.
    OSError
    """
    with open(path, "rb") as file:
        is_leader = file.read(6)[4:] == b"\x0b\xc0"
    return "\n".join(_leader(path) if is_leader else _image(path))


def _fields(record: Record) -> Iterator[str]:
    for name, field in record.fields.items():
        yield f"{record.start + field.offset:10}  {name:38} {record.text(name)}"


def _leader(path: Path) -> Iterator[str]:
    leader = read_leader(path)
    for start, codes, length in leader.records:
        yield f"{start:10}  record {codes}, {length} bytes"
    for record in (leader.descriptor, leader.summary, leader.position):
        yield from _fields(record)


def _image(path: Path) -> Iterator[str]:
    headers = read_headers(path)
    yield from _fields(headers.descriptor)
    yield from _fields(headers.record(0))
    yield f"{len(headers.values)} lines; smallest and largest of what varies:"
    for name in LINE:
        values = headers.values[name]
        if (values != values[0]).any():
            yield f"{'':10}  {name:38} {values.min()} to {values.max()}"
