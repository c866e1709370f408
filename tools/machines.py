"""Ways to make this machine compute in the last bits as another one does."""

import os
from dataclasses import dataclass

import numpy as np
from numpy._core import _multiarray_umath as core


@dataclass(frozen=True)
class Variant:
    """One way to compute; ``skipped`` says why it would change nothing here."""

    name: str
    environment: dict[str, str]
    skipped: str = ""


def numpy_features(level: str) -> list[str]:
    """What NumPy can switch off: ``level`` and all above it, as far as this processor has it."""
    dispatched = list(getattr(core, "__cpu_dispatch__", ()))
    if level not in dispatched:
        return []
    return [f for f in dispatched[dispatched.index(level) :] if core.__cpu_features__.get(f)]


def _numpy_without(name: str, level: str) -> Variant:
    features = numpy_features(level)
    why = "" if features else f"NumPy {np.__version__} dispatches on nothing of that kind here"
    return Variant(name, {"NPY_DISABLE_CPU_FEATURES": " ".join(features)}, why)


def blas_kernels() -> set[str]:
    """Names of the OpenBLAS kernels that NumPy and SciPy have loaded."""
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_info

    return {lib.get("architecture") for lib in threadpool_info() if lib["user_api"] == "blas"}


def _other_kernel() -> Variant:
    here = blas_kernels() - {None}
    other = "Nehalem" if "Haswell" in here else "Haswell"
    is_x86 = bool(numpy_features("X86_V3"))
    why = "" if here and is_x86 else "no OpenBLAS with another kernel here"
    return Variant(f"OpenBLAS as on {other}", {"OPENBLAS_CORETYPE": other}, why)


def variants() -> list[Variant]:
    """All of them; the first is the machine as it is."""
    one_thread = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    c_library = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F"}
    opencv = {"OPENCV_CPU_DISABLE": "AVX2,AVX512-SKX,FP16", "OPENCV_IPP": "disabled"}
    has_glibc = "gnu_get_libc_version" in _c_library_symbols()
    return [
        Variant("as it is", {}),
        _numpy_without("NumPy without AVX-512", "X86_V4"),
        _numpy_without("NumPy without AVX2", "X86_V3"),
        Variant("one BLAS thread", one_thread, "" if os.cpu_count() != 1 else "one core here"),
        _other_kernel(),
        Variant("C library without FMA", c_library, "" if has_glibc else "no GNU C library here"),
        Variant("OpenCV without AVX2", opencv),
    ]


def _c_library_symbols() -> set[str]:
    import ctypes

    try:
        library = ctypes.CDLL(None)
    except (OSError, TypeError):
        return set()
    return {"gnu_get_libc_version"} if hasattr(library, "gnu_get_libc_version") else set()
