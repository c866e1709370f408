"""Arrays in files that are whole or absent, and that know what they belong to."""

import io
import os
import zipfile
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np


def save(path: Path, job: str, **arrays: Any) -> None:
    """Store arrays, all or none.

    Parameters
    ----------
    path : Path
        Replaced if it exists.
    job : str
        All that decides what the arrays hold.
    **arrays : array-like
    """
    content = io.BytesIO()
    np.savez(content, job=np.array(job), **arrays)
    write(path, content.getvalue())


def write(path: Path, content: bytes) -> None:
    """Store bytes, all or none, also if the process ends on the way.

    Parameters
    ----------
    path : Path
    content : bytes

    Raises
    ------
    OSError
        They cannot be written; naming the file, which is as it was.
    """
    unfinished = path.with_name(path.name + ".part")
    try:
        with unfinished.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())  # else a power cut may leave the name without the content
        os.replace(unfinished, path)
    except OSError as error:
        with suppress(OSError):
            unfinished.unlink()
        why = "what was stored before is whole; call again once this can be written"
        raise OSError(error.errno, f"{error.strerror or error}; {why}", str(path)) from error


def load(
    path: Path, job: str, names: Iterable[str], *, kind: str, remedy: str
) -> list[np.ndarray] | None:
    """Stored arrays; None if there is no file.

    Parameters
    ----------
    path : Path
    job : str
        As it was stored.
    names : iterable of str
        Of the arrays that are wanted.
    kind, remedy : str
        What the job is, and what deleting a damaged file costs: for the messages.

    Returns
    -------
    list of ndarray, or None

    Raises
    ------
    ValueError
        The file is damaged, or another job's; naming it.
    OSError
        It is there and cannot be read.
    """
    try:
        content = io.BytesIO(path.read_bytes())
    except FileNotFoundError:
        return None
    try:
        with zipfile.ZipFile(content) as archive:
            damaged = archive.testzip()
        if damaged:
            raise zipfile.BadZipFile(f"bad checksum of {damaged}")
        content.seek(0)
        with np.load(content, allow_pickle=False) as file:
            ours = str(file["job"]) == job
            arrays = [file[name] for name in names if ours]
    except Exception as error:  # zipfile and NumPy raise nearly anything
        raise ValueError(
            f"{path} is damaged ({type(error).__name__}: {error}); delete it, and {remedy}"
        ) from error
    if not ours:
        raise ValueError(
            f"{path} belongs to another {kind}: other arguments or another version; use another "
            "folder for this one"
        )
    return arrays
