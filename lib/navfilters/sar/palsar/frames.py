"""Consecutive frames of one pass as one PALSAR product."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.interpolate import BarycentricInterpolator

from navfilters.sar.palsar.ceos_fields import fault
from navfilters.sar.palsar.leader_file import read_leader
from navfilters.sar.palsar.leader_records import _DAY
from navfilters.sar.palsar.opening import opened, scenes
from navfilters.sar.palsar.product import Product

_MODE = ("sensor and mode", "off-nadir angle in deg", "beam number")

_OFF_GRID = 0.25  # line: the times of thousands of lines tell the start of each frame much better

_SAME = 1e-6  # relative: what files give of pulse and carrier has no more digits

_ORBITS = {"positions": (slice(3), 1.0, "m"), "velocities": (slice(3, 6), 0.01, "m/s")}
"""Largest differences of two orbits: precise ones are alike, predicted ones are far off."""

_BLOCK = 256  # lines that are compared at once


def open_frames(
    folders: str | Path | Sequence[str | Path],
    *,
    polarisation: str | None = None,
    records: tuple[int, int] | None = None,
    clock_offset: float = 0.0,
) -> Product:
    """Frames of one pass, each of which overlaps or touches the next, as one product.

    Parameters
    ----------
    folders : str or Path, or sequence of them
        Each holds the files of one frame or of several; in any order.
    polarisation : str, optional
        See ``open_product``.
    records : tuple of int, optional
        See ``open_product``; of a single frame.
    clock_offset : float
        Added to the times of lines, s.

    Returns
    -------
    Product
        Its lines are counted on from the first frame's, by their times. Where frames overlap,
        those of the earlier one count; lines that it misses are taken from the later one. Columns
        are those of the first frame, orbit and wavelength too.

    Raises
    ------
    ValueError
        As ``open_product``; frames of different modes, passes, orbits, pulses or windows; a gap,
        with its lines and seconds; a frame that adds no line; or an overlap that is not the same
        data.
    OSError
        A folder or file that cannot be read.

    Notes
    -----
    Nothing of the samples is read but where frames overlap, and of that few lines at once.
    """
    given = [folders] if isinstance(folders, str | Path) else list(folders)
    found = [scene for folder in given for scene in scenes(Path(folder), polarisation)]
    if not found:
        raise ValueError("folders must name at least one folder; found none")
    if len(found) > 1 and records is not None:
        raise ValueError(
            f"records must come with a single frame, whose records they are; found {len(found)} "
            "frames: leave out those before or after the change"
        )
    frames = sorted((opened(*scene, records, clock_offset) for scene in found), key=_start)
    whole, last = frames[0], frames[0]
    for frame in frames[1:]:
        whole, last = _joined(whole, last, frame, clock_offset), frame
    return whole


def _start(product: Product) -> float:
    """UTC of the first line, s."""
    return float(_DAY * product.day.toordinal() + product.line_times[0])


def _joined(whole: Product, last: Product, frame: Product, clock_offset: float) -> Product:
    """A product, the last frame of which is given, and one more."""
    _check_mode(last, frame)
    row = _row(whole, last, frame)
    _check_orbit(whole, frame)
    if (frame.near_range, frame.samples) != (whole.near_range, whole.samples):
        frame = opened(frame.image, frame.leader, None, clock_offset, whole)
    _check_overlap(whole, frame, row)
    lines = row + frame.lines
    times = whole.line_times[0] + np.arange(lines) / whole.prf
    vectors = whole.state_vectors
    if times[-1] > vectors.times[-1]:
        raise read_leader(whole.leader).position.error(
            "number of points",
            f"{len(vectors.times)}, the last at {vectors.times[-1]:.3f} s of {whole.day}",
            f"enough to cover the lines of all frames, which end at {times[-1]:.3f} s",
        )
    # lines that the earlier frames miss come from the later one
    taken = np.r_[whole.missing[row:], np.ones(lines - whole.lines, bool)]
    taken &= ~np.r_[frame.missing[: whole.lines - row], np.zeros(lines - whole.lines, bool)]

    def both(of_whole: np.ndarray, of_frame: np.ndarray) -> np.ndarray:
        grown = np.zeros((lines, *of_whole.shape[1:]), of_whole.dtype)
        grown[: whole.lines] = of_whole
        grown[row:][taken] = of_frame[taken]
        return grown

    return replace(
        whole,
        lines=lines,
        line_times=times,
        missing=both(whole.missing, frame.missing),
        valid=both(whole.valid, frame.valid),
        _origin=both(whole._origin, frame._origin),
        _frame=both(whole._frame, frame._frame + len(whole._images)),
        _images=(*whole._images, *frame._images),
    )


def _check_mode(last: Product, frame: Product) -> None:
    """Raise unless two frames were made in the same way."""
    before, after = read_leader(last.leader).summary, read_leader(frame.leader).summary
    for name in _MODE:
        first, second = before.text(name), after.text(name)
        if first and second and first != second:
            needed = f"{first!r} as in {last.leader}, to be joined with it"
            raise after.error(name, repr(second), needed)
    for name, unit in (
        ("polarisation", ""),
        ("sampling_rate", " Hz"),
        ("prf", " Hz"),
        ("chirp_rate", " Hz/s"),
        ("pulse_length", " s"),
        ("wavelength", " m"),
    ):
        one, other = getattr(last, name), getattr(frame, name)
        if one != other if isinstance(one, str) else abs(other - one) > _SAME * abs(one):
            one, other = (x if isinstance(x, str) else f"{x:.9g}" for x in (one, other))
            raise ValueError(
                f"{frame.image}: {name.replace('_', ' ')} must be {one}{unit} as in "
                f"{last.image}, to be joined with it; found {other}{unit}"
            )


def _row(whole: Product, last: Product, frame: Product) -> int:
    """Line of a product at which a frame begins, by their times."""
    exact = (_start(frame) - _start(whole)) * whole.prf
    row = round(exact)
    if (gap := row - whole.lines) > 0:
        orbits = [read_leader(each.leader).summary.text("orbit number") for each in (last, frame)]
        hint = ": the frame between them is needed"
        if orbits[0] != orbits[1]:
            hint = f", from orbit {orbits[0]} to {orbits[1]}: only frames of one pass can be joined"
        raise ValueError(
            f"{frame.image} must overlap or touch {last.image}; found a gap of {gap} lines, "
            f"{gap / whole.prf:.6g} s{hint}"
        )
    if row + frame.lines <= whole.lines:
        raise ValueError(
            f"{frame.image} must go on after the end of {last.image}; found its {frame.lines} "
            f"lines within it, from line {row}: leave one of the two out"
        )
    if abs(exact - row) > _OFF_GRID:
        raise ValueError(
            f"{frame.image} must begin on a line of {last.image}, or up to {_OFF_GRID} of a line "
            f"beside one, by the times of their lines; found {abs(exact - row):.2f} of a line"
        )
    return row


def _check_orbit(whole: Product, frame: Product) -> None:
    """Raise unless the state vectors of two leaders tell of the same motion, where they meet."""
    days = _DAY * (frame.day.toordinal() - whole.day.toordinal())
    at = float(frame.line_times[0])
    states = np.stack([_state(whole, at + days), _state(frame, at)])
    for name, (part, most, unit) in _ORBITS.items():
        if (off := float(np.linalg.norm(np.diff(states[:, part], axis=0)))) > most:
            before, after = (read_leader(each.leader).position for each in (whole, frame))
            kinds = f"{after.text('orbit kind')!r} and {before.text('orbit kind')!r}"
            raise after.error(
                "x in m" if unit == "m" else "vx in m/s",
                f"{off:.3g} {unit} (orbit kinds {kinds})",
                f"within {most:g} {unit} of the {name} in {whole.leader}, to be joined with it",
            )


def _state(product: Product, time: float) -> np.ndarray:
    """Position and velocity (6,) by eight points: good to 0.1 mm for points 60 s apart."""
    vectors = product.state_vectors
    near = np.sort(np.argsort(np.abs(vectors.times - time))[:8])
    states = np.hstack([vectors.positions[near], vectors.velocities[near]])
    return np.asarray(BarycentricInterpolator(vectors.times[near] - time, states)(0.0))


def _check_overlap(whole: Product, frame: Product, row: int) -> None:
    """Raise for the first sample that two products have, and that is not the same in both."""
    for start in range(row, whole.lines, _BLOCK):
        stop = min(start + _BLOCK, whole.lines)
        theirs = dict(frame._codes(start - row, stop - row))
        for line, codes in sorted(whole._codes(start, stop)):
            mine, other = whole.valid[line], frame.valid[line - row]
            low = max(mine[0], other[0])
            high = max(low, min(mine[1], other[1]))
            one = codes[low - mine[0] : high - mine[0]]
            two = theirs[line - row][low - other[0] : high - other[0]]
            differ = (one != two).any(axis=1)
            if differ.any():
                k = int(np.argmax(differ))
                byte = int(frame._origin[line - row] + 2 * (low + k))
                path, _ = whole._images[whole._frame[line]]
                at = int(whole._origin[line] + 2 * (low + k))
                needed = f"{one[k].tolist()} as the same line has it in {path}, byte {at}"
                found = f"{two[k].tolist()}, and {int(differ.sum())} of {len(differ)} differ"
                raise fault(frame.image, byte, f"sample of line {line - row}", found, needed)
