"""Ways to make this machine compute in the last bits as another one does."""

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
    """The machine as it is, two that differ in one thing, and one that is old throughout."""
    no_avx512 = _numpy_without("NumPy without AVX-512", "X86_V4")
    no_avx2 = _numpy_without("NumPy without AVX2", "X86_V3")
    kernel = _other_kernel()
    one_thread = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    c_library = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F"}
    opencv = {"OPENCV_CPU_DISABLE": "AVX2,AVX512-SKX,FP16", "OPENCV_IPP": "disabled"}
    oldest_kernel = {"OPENBLAS_CORETYPE": "Nehalem"}
    old = () if no_avx2.skipped else (no_avx2.environment, oldest_kernel)
    everything: dict[str, str] = {}
    for environment in (*old, one_thread, c_library, opencv):
        everything |= environment
    return [
        Variant("as it is", {}),
        no_avx512,
        Variant(f"{kernel.name}, one thread", kernel.environment | one_thread, kernel.skipped),
        Variant("an old machine", everything),
    ]
