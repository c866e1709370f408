"""Open a PALSAR level-1.0 product: its files, its polarisation, its windows."""

import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from navfilters.numerics.validation import real_array
from navfilters.sar.palsar.ceos_fields import SPEED_OF_LIGHT
from navfilters.sar.palsar.ceos_records import Record
from navfilters.sar.palsar.image_grid import grid
from navfilters.sar.palsar.image_headers import PREFIX, Headers, read_headers
from navfilters.sar.palsar.leader_file import read_leader
from navfilters.sar.palsar.orbit_and_pulse import pulse, state_vectors, wavelength
from navfilters.sar.palsar.product import _MARKS, Product

MIDDLE = 15.5
"""Zero signal, between the codes 15 and 16 of 0 to 31, where the leader gives none."""


def open_product(
    folder: str | Path,
    *,
    polarisation: str | None = None,
    records: tuple[int, int] | None = None,
    clock_offset: float = 0.0,
) -> Product:
    """Read and check everything of a product but the samples.

    Parameters
    ----------
    folder : str or Path
        Holds one leader file and the image files of one scene.
    polarisation : str, optional
        Such as "HV": which image file, where there are several.
    records : tuple of int, optional
        First and last signal record of the file, 0-based, half-open: one part of a product whose
        pulse repetition frequency changes, which is refused as a whole. All by default.
    clock_offset : float
        Added to the times of lines, s.

    Returns
    -------
    Product

    Raises
    ------
    ValueError
        A folder without exactly one image and leader file, or a file that is cut, damaged, another
        format's or of another mode, with the file, the byte, what must be there and what was found.
        ScanSAR bursts are refused.
    OSError
        A folder or file that cannot be read.

    Warns
    -----
    UserWarning
        Windows that move by parts of a sample, line times that scatter by more than their
        resolution, a flagged leap second.
    """
    return opened(*_files(Path(folder), polarisation), records, clock_offset)


def opened(
    image: Path,
    leader: Path,
    records: tuple[int, int] | None,
    clock_offset: float,
    first: Product | None = None,
) -> Product:
    """As ``open_product``, for known files.

    Parameters
    ----------
    image, leader : Path
    records, clock_offset
        See ``open_product``.
    first : Product, optional
        Of which the columns are taken instead of those of the first line.

    Returns
    -------
    Product

    Raises
    ------
    ValueError, OSError
    """
    offset = float(real_array("clock_offset", clock_offset, ""))
    said, headers = read_leader(leader), read_headers(image, records)
    lines = grid(headers, _without_echo(headers, said.summary))
    good, summary = lines.good, said.summary
    letters = _polarisation(headers, good)
    sampling_rate = 1e6 * summary.number("sampling rate in MHz")
    near_range, samples, shift, left, data = _windows(headers, good, sampling_rate, first)
    valid = np.zeros((lines.lines, 2), np.int64)
    valid[lines.rows] = np.clip(np.stack([shift, shift + data], axis=-1), 0, samples)
    origin = np.zeros(lines.lines, np.int64)
    origin[lines.rows] = headers.start(good) + PREFIX + 2 * (left - shift)
    missing = np.ones(lines.lines, bool)
    missing[lines.rows] = False
    dc = complex(*(summary.number(f"DC bias of {part}", blank=MIDDLE) for part in "IQ"))
    chirp_rate, pulse_length = pulse(summary, headers.record(int(good[0])), sampling_rate)
    times, vectors = lines.times + offset, state_vectors(said.position, lines.day)
    if not vectors.times[0] <= times[0] <= times[-1] <= vectors.times[-1]:
        found = f"state vectors from {vectors.times[0]:.3f} to {vectors.times[-1]:.3f} s"
        needed = f"such that they cover the lines, {times[0]:.3f} to {times[-1]:.3f} s"
        raise said.position.error("second of day", f"{found} of {lines.day}", needed)
    return Product(
        image=image,
        leader=leader,
        lines=lines.lines,
        samples=samples,
        day=lines.day,
        line_times=times,
        missing=missing,
        valid=valid,
        prf=1 / lines.interval,
        near_range=near_range,
        sampling_rate=sampling_rate,
        chirp_rate=chirp_rate,
        pulse_length=pulse_length,
        wavelength=wavelength(summary),
        dc=dc,
        polarisation=letters,
        state_vectors=vectors,
        _origin=origin,
        _frame=np.zeros(lines.lines, np.int64),
        _images=((image, dc),),
    )


def scenes(folder: Path, polarisation: str | None) -> list[tuple[Path, Path]]:
    """The image and the leader file of every scene of a folder.

    Parameters
    ----------
    folder : Path
    polarisation : str or None

    Returns
    -------
    list of (Path, Path)

    Raises
    ------
    ValueError, OSError
    """
    files = _listed(folder)
    leaders = _of_product(files, "LED-")
    ends = tuple(path.name.upper()[3:] for path in leaders)
    for image in _of_product(files, "IMG-"):
        if leaders and not image.name.upper().endswith(ends):
            needed = f"{folder} must hold a leader file LED-... of each scene"
            raise ValueError(f"{needed}; found none of {image.name}")
    names = [path.name[4:] for path in leaders] if len(leaders) > 1 else [""]
    return [_files(folder, polarisation, name) for name in names]


def _listed(folder: Path, scene: str = "") -> list[Path]:
    """The files of a folder, or those of one scene by the end of their names."""
    files = sorted(path for path in folder.iterdir() if path.is_file())
    end = f"-{scene.upper()}" if scene else ""
    return [path for path in files if path.name.upper().endswith(end)]


def _files(folder: Path, polarisation: str | None, scene: str = "") -> tuple[Path, Path]:
    """The image and the leader file of a folder, or of one of the scenes in it."""
    wanted = "IMG-" if polarisation is None else f"IMG-{polarisation.upper()}-"
    files = _listed(folder, scene)
    images, leaders = (_of_product(files, start) for start in (wanted, "LED-"))
    for found, name in ((images, wanted), (leaders, "LED-")):
        if len(found) != 1:
            names = ", ".join(path.name for path in found) or _instead(files)
            hint = ": open_frames joins frames of one pass" if len(leaders) > 1 else ""
            if len({path.name.upper()[4:6] for path in images}) > 1 and polarisation is None:
                hint = ": choose a polarisation"
            needed = f"{folder} must hold one file {name}...{scene}"
            raise ValueError(f"{needed}; found {names}{hint}")
    image, leader = images[0], leaders[0]
    if not image.name.upper().endswith(leader.name.upper()[4:]):
        raise ValueError(
            f"{folder} must hold image and leader of one scene; found {image.name}, {leader.name}"
        )
    return image, leader


def _of_product(files: Sequence[Path], start: str) -> list[Path]:
    """Files whose names begin so, without what other programs have put beside them.

    Such a side file has the name of another one, and more behind a mark: IMG-HH-NAME.aux.xml. Where
    several are left, those that do not begin as the format's files do are no choice.
    """
    found = [path for path in files if path.name.upper().startswith(start)]
    names = {path.name for path in found}
    found = [
        path
        for path in found
        if not any(path.name[:k] in names for k, mark in enumerate(path.name) if mark in _MARKS)
    ]
    begin = [path for path in found if len(found) > 1 and _begins(path)]
    return begin or found


def _begins(path: Path) -> bool:
    with open(path, "rb") as file:
        return file.read(8)[5:] == b"\xc0\x12\x12"


def _instead(files: Sequence[Path]) -> str:
    """None, and what there is that tells why."""
    names = [path.name for path in files]
    for start, hint in (
        ("ALPSR", "GMTSAR's or another program's files: the IMG- and LED- files are needed"),
        ("ALOS2", "files of PALSAR-2, another radar, which is not read"),
        ("VOL-", "a volume directory without the files that it lists"),
    ):
        if any(name.upper().startswith(start) for name in names):
            return f"none, but {hint}"
    if any(name.lower().endswith((".zip", ".gz", ".tgz", ".tar")) for name in names):
        return "none, but an archive: unpack it"
    return "none"


def _without_echo(headers: Headers, summary: Record) -> np.ndarray:
    """Which records (records,) are flagged as filled, or hold calibration data by the leader."""
    bad = headers.values["missing-line flag"] == 1
    if summary.integer("calibration data", blank=0):
        number = headers.values["line number"]
        for end in ("top", "bottom"):
            first, last = (
                summary.integer(f"{which} calibration line at the {end}", blank=0)
                for which in ("first", "last")
            )
            bad |= (first <= number) & (number <= last)
    return bad


def _polarisation(headers: Headers, good: np.ndarray) -> str:
    """Transmitted and received, as the lines say and the file's name must."""
    letters = ""
    named = headers.descriptor.path.name.upper().split("-")[1]
    for k, which in enumerate(("transmit", "receive")):
        field = f"{which} polarisation"
        letter = "HV"[headers.within(field, good)[0]]
        if named in ("HH", "HV", "VH", "VV") and named[k] != letter:
            needed = f"{'HV'.index(named[k])} ({named[k]}), as the file's name says"
            raise headers.record(int(good[0])).error(field, f"{'HV'.index(letter)}", needed)
        letters += letter
    return letters


def _windows(
    headers: Headers, good: np.ndarray, sampling_rate: float, first: Product | None
) -> tuple[float, int, np.ndarray, np.ndarray, np.ndarray]:
    """Near range, m, and samples of the first line; shift, left fill and data of each, samples."""
    slant = headers.within("slant range in m", good)
    left, data, right = (
        headers.within(f"{name} samples", good) for name in ("left fill", "data", "right fill")
    )
    room = (headers.length - PREFIX) // 2
    needed = f"at most {room} with the fill samples"
    headers.refuse("data samples", good, left + data + right > room, needed)
    near, samples, of = float(slant[0]), int(data[0]), ""
    if first is not None:
        near, samples, of = first.near_range, first.samples, f" of {first.image}"
    exact = 2 * sampling_rate / SPEED_OF_LIGHT * (slant - near)
    shift = np.rint(exact).astype(np.int64)
    apart = (shift >= samples) | (shift + data <= 0)
    needed = f"such that the window meets that of the first line{of}, at {near:.0f} m"
    headers.refuse("slant range in m", good, apart, needed)
    if (off := np.abs(exact - shift).max()) > 0.25:  # whole metres explain 0.21 at 32 MHz
        warnings.warn(
            f"{headers.descriptor.path}: the window moves by parts of a sample, up to {off:.2f}",
            stacklevel=3,
        )
    return near, samples, shift, left, data
