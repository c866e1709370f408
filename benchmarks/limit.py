"""The practical limit: limit.c, compiled with -O3 and called through ctypes."""

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np

from navfilters import Gaussian

SOURCE = Path(__file__).with_name("limit.c")
FLAGS = ("-O3", "-shared", "-fPIC")


def compiler() -> str | None:
    """The C compiler's path, or None."""
    return shutil.which("cc") or shutil.which("gcc")


def compiled(folder: Path) -> dict[str, Callable]:
    """Compile the C filters.

    Parameters
    ----------
    folder : Path
        Where the library goes.

    Returns
    -------
    dict
        "EKF" and "UKF": (prior, z, R, steps) -> Gaussian, for mean (members, 2), cov (members,
        2, 2), z (2,) and R (2, 2).
    """
    library = Path(folder) / "limit.so"
    command = [compiler() or "cc", *FLAGS, str(SOURCE), "-o", str(library), "-lm"]
    subprocess.run(command, check=True)
    loaded = ctypes.CDLL(str(library))
    array = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")

    def wrapped(name: str) -> Callable:
        function = getattr(loaded, name)
        function.argtypes = [ctypes.c_long, ctypes.c_long, *(array,) * 4]
        function.restype = None

        def run(prior: Gaussian, z: np.ndarray, R: np.ndarray, steps: int) -> Gaussian:
            mean, cov = (np.array(part, float, order="C") for part in prior)
            function(len(mean), steps, mean, cov, z, R)
            return Gaussian(mean, cov)

        return run

    return {"EKF": wrapped("ekf"), "UKF": wrapped("ukf")}
