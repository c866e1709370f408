"""Folders of PALSAR products, any damage to their bytes, and the command that prints them."""

import re
import subprocess
import sys
import warnings

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from palsar_files import (
    IMAGE,
    IMAGE_ROWS,
    LEADER,
    LEADER_ROWS,
    LENGTH,
    LINE_ROWS,
    LINES,
    NAME,
    POSITION_ROWS,
    START_ATTITUDE,
    START_POSITION,
    START_SUMMARY,
    SUMMARY_ROWS,
    field,
    image_bytes,
    leader_bytes,
    position_rows,
    product,
    time_rows,
)
from palsar_products import (
    of_line,
    opened,
    refused,
)

from navfilters.sar.palsar.__main__ import main
from navfilters.sar.palsar.frames import open_frames
from navfilters.sar.palsar.opening import open_product


def test_folders_that_hold_no_product(tmp_path):
    with pytest.raises(ValueError, match=rf"{tmp_path} must hold one file IMG-\.\.\.; found none"):
        open_product(tmp_path)
    product(tmp_path)
    (tmp_path / "LED-other").write_bytes(LEADER)
    with pytest.raises(ValueError, match=r"one file LED-\.\.\.; found LED-ALPSRP.*, LED-other"):
        open_product(tmp_path)
    (tmp_path / f"LED-{NAME}").unlink()
    with pytest.raises(ValueError, match="image and leader of one scene"):
        open_product(tmp_path)
    (tmp_path / "LED-other").unlink()
    (tmp_path / f"LED-{NAME}").mkdir()
    with pytest.raises(ValueError, match=r"one file LED-\.\.\.; found none"):
        open_product(tmp_path)


BESIDE = [
    # what other programs leave in a product's folder
    ("IMG-HH-{}.aux.xml", "LED-{}.aux.xml"),
    ("IMG-HH-{}.raw", "IMG-HH-{}.PRM", "IMG-HH-{}.LED", "IMG-HH-{}.SLC"),
    ("IMG-HH-{}.ovr", "IMG-HH-{}.md5", "LED-{}.md5", "IMG-HH-{}~", "LED-{}.bak"),
    ("IMG-HH-{} (1)", "LED-{} (1)", "IMG-HH-{}:Zone.Identifier", "._IMG-HH-{}", "IMG-HH-{}.1"),
    ("VOL-{}", "TRL-{}", "summary.txt", "workreport", "IMG-HH.hdr", "LED-"),
]


@pytest.mark.parametrize("beside", BESIDE)
@pytest.mark.parametrize("options", [{}, {"polarisation": "HH"}])
@pytest.mark.parametrize("copy", [False, True])
def test_what_other_programs_leave_beside_the_files_hides_nothing(tmp_path, beside, options, copy):
    """Whether it is text or as good as the files themselves."""
    product(tmp_path)
    for name in beside:
        own = LEADER if name.startswith("LED") else IMAGE
        marked = name.startswith(("IMG-HH-{}", "LED-{}", "._"))
        (tmp_path / name.format(NAME)).write_bytes(own if copy and marked else b"<PAMDataset/>")
    for got in (open_product(tmp_path, **options), open_frames(tmp_path, **options)):
        assert (got.image.name, got.leader.name) == (f"IMG-HH-{NAME}", f"LED-{NAME}")
        assert got.lines == LINES


def test_two_scenes_whose_names_begin_alike_are_two(tmp_path):
    for scene in ("scene1", "scene10", "scene1-b", "scene1_b"):
        for name, data in ((f"IMG-HH-{scene}", IMAGE), (f"LED-{scene}", LEADER)):
            (tmp_path / name).write_bytes(data)
    with pytest.raises(
        ValueError, match=r"one file IMG-\.\.\.; found .*scene1, .*scene1-b, .*scene10"
    ):
        open_product(tmp_path)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("ALPSRP230940670.raw", "none, but GMTSAR"),
        ("ALPSRP230940670-L1.0.zip", "none, but GMTSAR"),
        ("scene.ZIP", "none, but an archive: unpack it"),
        ("VOL-X", "none, but a volume directory"),
        ("ALOS2015976960-140909_FBDR1.5GUA.kml", "none, but files of PALSAR-2"),
    ],
)
def test_a_folder_without_an_image_says_what_it_has(tmp_path, name, words):
    (tmp_path / name).write_bytes(b"?")
    with pytest.raises(ValueError, match=f"one file IMG-...; found {words}"):
        open_product(tmp_path)


KINDS = [
    (b"PK\3\4" + b"\0" * 900, "a zip archive: unpack it"),
    (b"\x1f\x8b\x08" + b"\0" * 900, "a gzip archive"),
    (b"\x89HDF\r\n\x1a\n" + b"\0" * 900, "an HDF5 file"),
    (b"II*\0" + b"\0" * 900, "a TIFF image, so of a processed level"),
    (b"<PAMDataset/>", "markup text"),
    (bytes([0, 0, 0, 1, 192, 192, 18, 18, 0, 0, 1, 104]) + b" " * 1788, "the volume directory"),
    (bytes([0, 0, 0, 1, 63, 192, 18, 18, 0, 0, 2, 208]) + b" " * 9000, "the trailer"),
]


@pytest.mark.parametrize(("data", "words"), KINDS)
def test_another_file_under_a_products_name_is_called_what_it_is(tmp_path, data, words):
    """Codes and lengths of volume directory and trailer as a product of ALOS-2 has them."""
    needed = "an image file IMG-... or a leader file LED-..."
    refused(tmp_path, 0, needed, words, image=data)
    refused(tmp_path, 0, needed, words, leader=data, file="LED")


@pytest.mark.parametrize("kind", ["VOL", "TRL"])
@pytest.mark.parametrize("data", [b"", b"\0" * 800, IMAGE])
def test_the_command_names_files_that_are_never_read(tmp_path, kind, data):
    path = tmp_path / f"{kind}-{NAME}"
    path.write_bytes(data)
    with pytest.raises(SystemExit) as ended:
        main([str(path)])
    assert f"({kind})" in ended.value.code
    assert "IMG-... or a leader file LED-..." in ended.value.code


@pytest.mark.parametrize(
    ("platform", "words"),
    [
        ("ALOS2", "'ALOS2': a product of PALSAR-2"),
        ("ALOS-2", "'ALOS-2': a product of PALSAR-2"),
        ("ALOS4", "'ALOS4': a product of PALSAR-3"),
        ("ALOSX", "'ALOSX'"),
        ("ADEOS", "'ADEOS'"),
        ("", "''"),
    ],
)
def test_another_satellite_is_refused_by_its_name(tmp_path, platform, words):
    """Before anything of its other records is read, which have another layout there."""
    leader = leader_bytes(
        summary=[(396, "A16", platform)], position=[(8, "B4", 4000), (144, "I4", 2015)]
    )
    refused(tmp_path, 720 + 396, "must be ALOS; found " + words, leader=leader, file="LED")


@pytest.mark.parametrize("level", ["1.1", "1.5", "1.5GUA", "2.0"])
def test_another_level_is_refused_before_its_other_records_are_read(tmp_path, level):
    leader = leader_bytes(summary=[(1094, "A16", level)], position=[(8, "B4", 4000)])
    words = ["1.0, raw signal data", f"found '{level}'"]
    words += ["focused already"] if level == "1.1" else []
    words += ["focused and projected already"] if "1.5" in level else []
    refused(tmp_path, 720 + 1094, *words, leader=leader, file="LED")


def survives(folder, image, leader):
    """Either a product, or a ValueError that names file, byte, need and finding."""
    message = ""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        try:
            got = opened(folder, image, leader)
            assert got.read(0, got.lines).shape == (got.lines, got.samples)
        except ValueError as error:
            message = f"{type(error).__name__}: {error}"
    needed = r"ValueError: .*(IMG-HH|LED)-ALP.*, byte \d+: .* must be .*; found "
    assert not message or re.match(needed, message), message


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("product")


HEADS = st.integers(0, 720 + 412) | st.integers(2, LINES).map(lambda n: of_line(n, n % 128))
USED = st.integers(0, START_ATTITUDE + 12)


@settings(max_examples=100)
@given(where=HEADS | st.integers(0, len(IMAGE) - 1), byte=st.integers(0, 255))
def test_any_byte_of_an_image_may_be_wrong(folder, where, byte):
    image = bytearray(IMAGE)
    image[where] = byte
    survives(folder, bytes(image), LEADER)


@settings(max_examples=100)
@given(where=USED | st.integers(0, len(LEADER) - 1), byte=st.integers(0, 255))
def test_any_byte_of_a_leader_may_be_wrong(folder, where, byte):
    leader = bytearray(LEADER)
    leader[where] = byte
    survives(folder, IMAGE, bytes(leader))


@given(size=st.integers(0, len(IMAGE)), rest=st.integers(0, len(LEADER)))
def test_any_part_of_the_files_may_be_lost(folder, size, rest):
    survives(folder, IMAGE[:size], LEADER[:rest])
    survives(folder, IMAGE[size:], LEADER)


@given(where=st.integers(0, 4000), some=st.binary(max_size=200))
def test_any_bytes_may_be_overwritten(folder, where, some):
    survives(folder, IMAGE[:where] + some + IMAGE[where + len(some) :], LEADER)
    survives(folder, IMAGE, LEADER[:where] + some + LEADER[where + len(some) :])


def test_every_field_is_printed_as_it_stands(tmp_path, capsys):
    """Each printed byte and value is a row of the tables above, amid digits that are in none."""
    product(tmp_path, image_bytes(filler=b"7"), leader_bytes(filler=b"7"))
    line = [(12, "B4", 1), *time_rows(0), *LINE_ROWS, (4, "A11", "50 10 18 20")]
    parts = {
        "IMG-HH": [(0, IMAGE_ROWS), (720, line)],
        "LED": [
            (0, LEADER_ROWS),
            (START_SUMMARY, SUMMARY_ROWS),
            (START_POSITION, [*POSITION_ROWS, *position_rows()]),
        ],
    }
    for file, rows in parts.items():
        written = {
            start + offset: (kind, value) for start, part in rows for offset, kind, value in part
        }
        main([str(tmp_path / f"{file}-{NAME}")])
        printed = capsys.readouterr().out.split("lines; smallest")[0]
        shown = re.findall(r"^ +(\d+)  (?!record)(.{38}) (.*)$", printed, re.M)
        assert len(shown) >= 30
        for byte, name, text in shown:
            kind, value = written[int(byte)]
            expected = field(kind, value).decode().strip() if kind[0] in "AEFI" else str(value)
            assert text == expected, name


def test_the_command_prints_fields_with_their_bytes(tmp_path, capsys):
    product(tmp_path)
    main([str(tmp_path / f"IMG-HH-{NAME}")])
    text = capsys.readouterr().out
    assert re.search(rf"^ +186 +signal record length +{LENGTH}$", text, re.M)
    assert re.search(r"^ +776 +PRF in mHz +2132196$", text, re.M)
    assert re.search(r"^ +724 +record codes +50 10 18 20$", text, re.M)
    assert re.search(r"^ +line number +1 to 64$", text, re.M)
    assert "slant range in m" in text
    main([str(tmp_path / f"LED-{NAME}")])
    text = capsys.readouterr().out
    assert re.search(r"^ +4816 +record 18 30 18 20, 4680 bytes$", text, re.M)
    assert re.search(r"^ +1220 +wavelength in m +0\.2360571$", text, re.M)
    assert re.search(r"^ +5020 +frame +ECR$", text, re.M)
    assert re.search(r"^ +30900 +record 18 200 18 20, 3072 bytes$", text, re.M)


def test_the_command_says_what_is_wrong(tmp_path):
    (tmp_path / "notes.txt").write_text("Not a SAR image.\n" * 99)
    for name, message in [
        ("notes.txt", "byte 8: length of the file descriptor"),
        ("no", "No such"),
    ]:
        with pytest.raises(SystemExit, match=message):
            main([str(tmp_path / name)])


def test_the_module_runs_as_a_command(tmp_path):
    product(tmp_path)
    command = [sys.executable, "-m", "navfilters.sar.palsar", str(tmp_path / f"LED-{NAME}")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "wavelength in m" in done.stdout
    assert done.stderr == ""
