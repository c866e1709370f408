"""The practical limit: limit*.c and vectorised.c, compiled and called through ctypes."""

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from problems import Coasting, Images

from navfilters import Gaussian
from navfilters.space.gravity import Gravity

SOURCES = sorted(Path(__file__).parent.glob("limit*.c"))
VECTORISED = Path(__file__).with_name("vectorised.c")
FLAGS = ("-O3", "-shared", "-fPIC")
WIDE = ("-march=native", "-ffast-math", "-fopenmp-simd")


class Flight(ctypes.Structure):
    """The C header's ``flight``."""

    _fields_ = (
        ("mu", ctypes.c_double),
        ("k", ctypes.c_double),
        ("rate", ctypes.c_double),
        ("step", ctypes.c_double),
        ("substeps", ctypes.c_long),
    )


def compiler() -> str | None:
    """The C compiler's path, or None."""
    return shutil.which("cc") or shutil.which("gcc")


def compiled(folder: Path) -> dict[str, Callable[..., Gaussian]]:
    """Compile the C filters.

    Parameters
    ----------
    folder : Path
        Where the library goes.

    Returns
    -------
    dict
        (prior, z, model, steps) -> Gaussian, for mean (members, n) and cov (members, n, n) or
        (n, n). "EKF" and "UKF": n = 2, z (2,), and the model is R (2, 2). "orbit EKF" and "MEKF": n
        = 6 and 9, the model is ``Coasting`` or ``Images``, and z as the problem has it. "EKF,
        vectorised" and "UKF, vectorised" are as "EKF" and "UKF".
    """
    loaded = _library(Path(folder) / "limit.so", FLAGS, SOURCES)
    wide = _library(Path(folder) / "vectorised.so", FLAGS + WIDE, [VECTORISED])
    return {
        "EKF": partial(_static, loaded.ekf),
        "UKF": partial(_static, loaded.ukf),
        "EKF, vectorised": partial(_static, wide.ekf),
        "UKF, vectorised": partial(_static, wide.ukf),
        "orbit EKF": partial(_orbit, loaded.orbit_ekf),
        "MEKF": partial(_images, loaded.mekf),
    }


def _library(path: Path, flags: tuple[str, ...], sources: list[Path]) -> ctypes.CDLL:
    command = [compiler() or "cc", *flags, *map(str, sources), "-o", str(path), "-lm"]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(path))


def _static(function: Callable, prior: Gaussian, z, R, steps: int) -> Gaussian:
    return _called(function, prior, steps, z, R)


def _orbit(function: Callable, prior: Gaussian, z, model: Coasting, steps: int) -> Gaussian:
    orbit, sensor = model.orbit, model.sensor
    flight = _flight(orbit.gravity, 0.0, orbit.step, orbit.substeps)
    return _called(function, prior, steps, z[:steps], sensor.R, model.Q, sensor.stars, flight)


def _images(function: Callable, prior: Gaussian, z, model: Images, steps: int) -> Gaussian:
    orbit, geometry = model.orbit, model.geometry
    flight = _flight(orbit.gravity, orbit.rate, orbit.step, model.steps)
    axes = geometry.T_b_s @ geometry.T_e_b
    return _called(function, prior, steps, z[:steps], geometry.R, geometry.D, orbit.Q, axes, flight)


def _flight(gravity: Gravity, rate: float, step: float, substeps: int) -> Flight:
    return Flight(gravity.mu, 1.5 * gravity.J2 * gravity.radius**2, rate, step, substeps)


def _called(function: Callable, prior: Gaussian, steps: int, *model) -> Gaussian:
    """Copies of the prior, updated; every other argument is an array or a flight."""
    mean = np.array(prior.mean, float, order="C")
    cov = np.broadcast_to(prior.cov, (*mean.shape, mean.shape[-1])).astype(float, order="C")
    given = [a if isinstance(a, Flight) else np.ascontiguousarray(a, float) for a in model]
    pointers = [
        ctypes.byref(a) if isinstance(a, Flight) else ctypes.c_void_p(a.ctypes.data)
        for a in (mean, cov, *given)
    ]
    function.restype = None
    function(ctypes.c_long(len(mean)), ctypes.c_long(steps), *pointers)
    return Gaussian(mean, cov)
