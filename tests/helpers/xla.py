"""How XLA compiles in tests.

A test's program is compiled once and runs for milliseconds. Without XLA's optimisations it is there
in a fifth of the time, and its numbers keep within the same tolerances of NumPy's. Where bits are
promised, and once for every filter, tests compile as users do.
"""

AS_USERS_DO = {
    "xla_backend_optimization_level": 3,
    "xla_llvm_disable_expensive_passes": False,
    "xla_cpu_use_fusion_emitters": True,
}
QUICKLY = (
    "--xla_backend_optimization_level=0",
    "--xla_llvm_disable_expensive_passes=true",
    "--xla_cpu_use_fusion_emitters=false",
    "--xla_cpu_parallel_codegen_split_count=1",
)
