"""The closed loop on a strip whose three patches no single frame holds."""

import re
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from palsar_files import NAME, put
from palsar_scene import CENTRES, COLUMNS, SMALL

from navfilters.papers import pogorelsky2020
from navfilters.papers.pogorelsky2020 import __main__ as command
from navfilters.papers.pogorelsky2020.real_patches import cut_patches
from navfilters.sar.palsar.frames import open_frames
from navfilters.sar.palsar.opening import open_product

RECORD = 412 + 2 * COLUMNS
CUT, OVERLAP = (CENTRES[1] + CENTRES[2]) // 2, 2500
"""Line at which the first frame ends; lines that the second has in common with it."""


@pytest.fixture(scope="module")
def frames(folder, tmp_path_factory):
    """Two folders: the records of one file, numbered from 1 in each."""
    whole = (folder / f"IMG-HH-{NAME}").read_bytes()
    starts = range(720, len(whole), RECORD)
    lines = np.array([int.from_bytes(whole[s + 12 : s + 16], "big") - 1 for s in starts])
    made = []
    for k, (first, last) in enumerate([(0, CUT), (CUT - OVERLAP, lines[-1] + 1)]):
        image = bytearray(whole[:720])
        for line, start in zip(lines, starts, strict=True):
            if first <= line < last:
                record = bytearray(whole[start : start + RECORD])
                put(record, [(12, "B4", line - first + 1)])
                image += record
        count = (len(image) - 720) // RECORD
        put(image, [(180, "I6", count), (236, "I8", count)])
        made.append(tmp_path_factory.mktemp(f"frame{k}"))
        scene = NAME.replace("0670", f"{670 + 10 * k:04}")
        (made[k] / f"IMG-HH-{scene}").write_bytes(image)
        (made[k] / f"LED-{scene}").write_bytes((folder / f"LED-{NAME}").read_bytes())
    return made


@pytest.mark.slow
def test_two_frames_hold_the_three_patches(folder, frames, product, patches):
    files = folder / "dem.tif", folder / "reference.tif"
    alone = [len(cut_patches(open_product(f), *files, imaging=SMALL)) for f in frames]
    assert max(alone) < 3
    joined = open_frames(frames)
    assert_array_equal(joined.missing, product.missing)
    for centre in CENTRES:
        at = centre - 100, centre + 100
        assert_array_equal(joined.read(*at), product.read(*at))
    found = cut_patches(joined, *files, imaging=SMALL)
    assert len(found) == len(patches) == 3
    for one, other in zip(found, patches, strict=True):
        assert_allclose(one.time, other.time, rtol=0, atol=2e-6)
        assert (one.pulses, one.missing) == (other.pulses, other.missing)
        assert_allclose(one.doppler_centroid, other.doppler_centroid)
        assert_allclose(one.acquired.r_f, other.acquired.r_f, rtol=0, atol=0.02)


@pytest.mark.slow
def test_the_command_joins_frames(folder, frames, capsys, monkeypatch):
    monkeypatch.setattr(command, "report", partial(pogorelsky2020.report, imaging=SMALL))
    command.main(
        f"--closed-loop --palsar {frames[1]} {frames[0]} --dem {folder}/dem.tif --reference "
        f"{folder}/reference.tif --case TC-2".split()
    )
    out = capsys.readouterr().out
    assert re.match(r"IMG-HH-\S+0670\S+ \+ IMG-HH-\S+0680\S+, 2008-03-05, 3 of 3 patches\n", out)
    errors = re.findall(r"^ +1 +\d .* ([\d.]+) m ", out, re.M)
    assert len(errors) == 3
    assert max(map(float, errors)) < 12.0
