"""PALSAR files that are cut, exchanged or claim too much: each is refused with its byte."""

import tracemalloc

import pytest
from palsar_files import (
    IMAGE,
    LEADER,
    LENGTH,
    LINES,
    MS,
    NAME,
    image_bytes,
    product,
    put,
)
from palsar_products import (
    of_line,
    opened,
    refused,
)

from navfilters.sar.palsar import leader_file
from navfilters.sar.palsar.leader_file import read_leader
from navfilters.sar.palsar.opening import open_product

IMAGE_FAULTS = [
    ((5, "B1", 10), 4, "any 192 18 18; found 50 10 18 18"),
    ((8, "B4", 412), 8, "720; found 412"),
    ((8, "A4", b"\xd0\2\0\0"), 8, "wrong byte order"),
    ((8, "B4", 16252), 8, "ERSDAC"),
    ((180, "I6", 63), 720 + 63 * LENGTH, f"{720 + 63 * LENGTH} bytes"),
    ((180, "I6", 65), 720 + 64 * LENGTH, f"found {720 + 64 * LENGTH} bytes"),
    ((180, "I6", 1), 180, "2 to 999999"),
    ((180, "I6", ""), 180, "2 to 999999"),
    ((180, "I6", "-64"), 180, "2 to 999999"),
    ((180, "I6", 999999), 720 + 64 * LENGTH, f"{720 + 999999 * LENGTH} bytes"),
    ((186, "I6", LENGTH - 1), 186, f"{LENGTH}, as the first record says"),
    ((186, "I6", 999999), 186, f"{LENGTH}, as the first record says"),
    ((236, "I8", 63), 236, "64"),
    ((276, "I4", 292), 276, "must be 412; found"),
]
LINE_FAULTS = [
    ((4, "B1", 51), 4, "50 10 18 20; found 51 10 18 20"),
    ((5, "B1", 11), 4, "50 10 18 20; found 50 11 18 20"),
    ((7, "B1", 0), 4, "found 50 10 18 0"),
    ((8, "B4", LENGTH + 1), 8, f"{LENGTH}"),
    ((20, "B4", 5), 24, "at most 52"),
    ((20, "B4", 0xFFFFFFFF), 20, "found 4294967295"),
    ((24, "B4", 0), 24, "1 to"),
    ((24, "B4", 53), 24, "at most 52"),
    ((24, "A4", b"\x30\0\0\0"), 24, "found 805306368"),
    ((28, "B4", 0x80000000), 28, "found 2147483648"),
    ((36, "B4", 2005), 36, "2006 to 2011"),
    ((36, "B4", 2009), 36, "2008: 2008-03-05, to which the lines before lead; found 2009"),
    ((40, "B4", 66), 40, "65: 2008-03-05, to which the lines before lead; found 66"),
    ((40, "B4", 0), 40, "1 to 366"),
    ((40, "B4", 367), 40, "1 to 366"),
    ((44, "B4", 86401000), 44, "0 to 86400999"),
    ((44, "B4", MS - 5), 44, "2 ms"),
    ((44, "B4", 86_399_999), 44, "2 ms"),
    ((52, "B2", 2), 52, ""),
    ((56, "B4", 2132197), 56, "2132196"),
    ((56, "A4", b"\xe4\x88\x20\0"), 56, "2132196"),
    ((60, "B4", 3), 60, "must be 0; found 3: the bursts of ScanSAR are not read"),
    ((64, "B2", 1), 64, "must be 0; found 1"),
    ((66, "B2", 1), 66, "must be 0; found 1"),
    ((96, "B4", 2), 96, "0 to 1"),
    ((116, "B4", 599999), 116, "600000 to 1300000"),
    ((116, "A4", b"\xcb\xf8\x0c\0"), 116, "600000 to 1300000"),
]


@pytest.mark.parametrize(("row", "byte", "word"), IMAGE_FAULTS)
def test_images_that_are_refused(tmp_path, row, byte, word):
    refused(tmp_path, byte, word, image=image_bytes(rows=[row]))


@pytest.mark.parametrize("number", [2, 40, 64])
@pytest.mark.parametrize(("row", "byte", "word"), LINE_FAULTS)
def test_lines_that_are_refused(tmp_path, number, row, byte, word):
    refused(tmp_path, of_line(number, byte), word, image=image_bytes(line={number: [row]}))


@pytest.mark.parametrize(
    ("row", "byte", "word"),
    [
        ((56, "A4", b"\xe4\x88\x20\0"), 56, "1000000 to 5000000"),
        ((52, "B2", 2), 52, "0 to 1"),
        ((54, "B2", 2), 54, "0 to 1"),
        ((68, "B4", 100001), 68, "0 to 100000"),
        ((68, "B4", 16000), 68, "within 1 %"),
        ((76, "S4", -518518), 76, "within 1 %"),
    ],
)
def test_what_every_line_says_can_be_wrong_too(tmp_path, row, byte, word):
    refused(tmp_path, of_line(1, byte), word, image=image_bytes(each=[row]))


@pytest.mark.parametrize("size", [0, 1, 11, 12, 719])
def test_files_without_a_descriptor(tmp_path, size):
    refused(tmp_path, size, "at least 720 bytes", image=IMAGE[:size])
    refused(tmp_path, size, "at least 720 bytes", leader=LEADER[:size], file="LED")


@pytest.mark.parametrize("record", range(6))
def test_leaders_cut_about_each_record(tmp_path, record):
    """Cut at a boundary, the next record is missing; elsewhere the one before it is not whole."""
    starts = [720, 4816, 9496, 17688, 30900, 33972]
    start = starts[record]
    if record > 0:
        refused(tmp_path, starts[record - 1] + 8, leader=LEADER[: start - 1], file="LED")
    if record < 5:
        for cut, byte in [(0, start), (1, start), (11, start), (12, start + 8)]:
            refused(tmp_path, byte, leader=LEADER[: start + cut], file="LED")


@pytest.mark.parametrize("record", [1, 2, 63])
def test_images_cut_about_each_record(tmp_path, record):
    for cut in (0, 1, 11, 12, 411, 412, LENGTH - 1):
        size = 720 + record * LENGTH + cut
        refused(tmp_path, size, f"found {size} bytes", image=IMAGE[:size])


def test_images_cut_about_the_first_record(tmp_path):
    for cut, byte in [(0, 720), (11, 720), (12, 728), (412, 728), (LENGTH - 1, 728)]:
        refused(tmp_path, byte, image=IMAGE[: 720 + cut])


def test_an_image_with_more_after_its_end(tmp_path):
    refused(tmp_path, len(IMAGE), "64 records", image=IMAGE + b"\0")


def test_exchanged_names(tmp_path):
    refused(tmp_path, 4, "11 192 18 18", leader=IMAGE, image=LEADER, file="LED")
    refused(tmp_path, 724, "50 10 18 20, raw signal data; found 18 10 18 20", image=LEADER)


def test_processed_data_under_a_raw_name(tmp_path):
    image = image_bytes(each=[(5, "B1", 11)])
    refused(tmp_path, 724, "50 11 18 20, processed data", image=image)


@pytest.mark.parametrize("text", [b"Not a SAR image.\n" * 99, b"\0" * 5000, b"\xff" * 5000])
def test_files_of_another_kind(tmp_path, text):
    refused(tmp_path, 8, "720", image=text)
    refused(tmp_path, 8, "720", leader=text, file="LED")


def sparse(path, start, size):
    with open(path, "wb") as file:
        file.write(start)
        file.truncate(size)


def test_absurd_claims_allocate_nothing(tmp_path):
    """Claims of 1 TB in a small file, and files of 100 GB that hold next to nothing."""
    huge, large = 100 << 30, (4 << 30) - 1
    claim = image_bytes(rows=[(180, "I6", 999999), (186, "I6", 999999)], each=[(8, "B4", 999999)])
    product(tmp_path)
    image, leader = tmp_path / f"IMG-HH-{NAME}", tmp_path / f"LED-{NAME}"
    one_record = bytearray(IMAGE[: 720 + 412])
    put(one_record, [(8, "B4", large)], 720)
    two = bytearray(LEADER[:4816])
    put(two, [(8, "B4", huge // 64)], 720)
    tracemalloc.start()
    try:
        for path, start, size, byte in [
            (image, claim, len(claim), 728),
            (image, IMAGE, huge, len(IMAGE)),
            (image, one_record, huge, 186),
            (image, IMAGE[:720], huge, 728),
            (leader, two, huge, 728),
            (leader, LEADER[:720], huge, 728),
        ]:
            product(tmp_path)
            sparse(path, start, size)
            tracemalloc.reset_peak()
            before = tracemalloc.get_traced_memory()[0]
            with pytest.raises(ValueError, match=rf"{path.name}, byte {byte}: .*must be"):
                open_product(tmp_path)
            assert tracemalloc.get_traced_memory()[1] - before < 300_000
    finally:
        tracemalloc.stop()
        image.unlink()
        leader.unlink()


def test_an_image_of_another_radar_or_level_says_so_by_its_descriptor(tmp_path):
    """As those of a genuine level-1.5 product of ALOS-2 do."""
    rows = [(48, "A16", "AL2 SARCIMOP"), (216, "I4", 16)]
    refused(tmp_path, 48, "'AL2 SARCIMOP': an image of PALSAR-2", image=image_bytes(rows=rows))
    refused(tmp_path, 216, "16: an image of a processed", image=image_bytes(rows=rows[1:]))
    for bits in (5, 8, ""):
        assert opened(tmp_path, image_bytes(rows=[(216, "I4", bits)])).lines == LINES


def facilities(*lengths, extra=b""):
    """A leader with more records of facilities than the one that the descriptor counts first."""
    data = bytearray(LEADER)
    for length in lengths:
        record = bytearray(length)
        put(
            record, [(4, "B1", 18), (5, "B1", 200), (6, "B1", 18), (7, "B1", 70), (8, "B4", length)]
        )
        data += record
    return bytes(data) + extra


def counted(data, *lengths):
    data = bytearray(data)
    for k, length in enumerate(lengths):
        put(data, [(434 + 14 * k, "I6", 1), (440 + 14 * k, "I8", length)])
    return bytes(data)


def test_a_leader_is_walked_to_its_end(tmp_path):
    """Genuine ones have a pair of count and length for each kind of facility, or none."""
    for leader in (facilities(5000, 728), counted(facilities(5000, 728), 5000, 728)):
        (tmp_path / f"LED-{NAME}").write_bytes(leader)
        records = read_leader(tmp_path / f"LED-{NAME}").records
        assert [(start, length) for start, _, length in records[-3:]] == [
            (30900, 3072), (33972, 5000), (38972, 728),
        ]  # fmt: skip
        assert opened(tmp_path, leader=leader).lines == LINES


@pytest.mark.parametrize("left", [12, 13, 700, 4999])
def test_a_leader_cut_in_a_record_that_is_not_used(tmp_path, left):
    leader = facilities(5000)[: 33972 + left]
    words = (
        "record 7 (facility related), codes 18 200 18 70,",
        f"from 12 to the {left} bytes that the file has left; found 5000",
        f"{5000 - left} bytes are missing, the file is cut",
    )
    refused(tmp_path, 33980, *words, leader=leader, file="LED")
    leader = counted(leader, 5000)
    refused(tmp_path, 33980, "record 7 of 7 (facility", leader=leader, file="LED")


@pytest.mark.parametrize("size", [33972, 38972])
def test_a_leader_cut_between_records_that_are_not_used(tmp_path, size):
    leader = counted(facilities(5000, 728), 5000, 728)[:size]
    number = 7 if size == 33972 else 8
    refused(
        tmp_path, size, f"record {number} of 8 must be there; found the end of the file",
        leader=leader, file="LED",
    )  # fmt: skip


@pytest.mark.parametrize("extra", [b"\0" * 5, b"\0" * 4096, b" " * 100, b"end of file\n" * 9])
def test_what_follows_the_last_record_is_told(tmp_path, extra):
    found = rf"LED-{NAME}, byte 33972: {len(extra)} bytes after the last of 6 records"
    with pytest.warns(UserWarning, match=found):
        assert opened(tmp_path, leader=LEADER + extra).lines == LINES


def test_errors_of_the_system_stay_its_own(tmp_path, monkeypatch):
    with pytest.raises(FileNotFoundError):
        open_product(tmp_path / "nowhere")
    product(tmp_path)
    with pytest.raises(NotADirectoryError):
        open_product(tmp_path / f"LED-{NAME}")

    def deny(path, *_, **__):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(leader_file, "open", deny, raising=False)
    with pytest.raises(PermissionError, match=f"LED-{NAME}"):
        open_product(tmp_path)


@pytest.mark.parametrize("more", range(1, 12))
def test_a_leader_that_ends_within_a_records_header_is_named(tmp_path, more):
    """After the header's first byte of codes, too, where its kind is not yet known."""
    product(tmp_path, IMAGE, LEADER[: 720 + more])
    with pytest.raises(ValueError, match=f"LED-{NAME}, byte 720: "):
        open_product(tmp_path)
