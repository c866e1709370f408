"""Run every notebook against its stored outputs once more, computing as other machines do."""

import os
import subprocess
import sys

from machines import Variant, variants

PYTEST = [
    "-m",
    "pytest",
    "book",
    "--nbval",
    "--nbval-current-env",
    "-n",
    "2",
    "--dist",
    "loadscope",
]


def chosen() -> list[Variant]:
    """NumPy without AVX-512; and another kernel of OpenBLAS on one thread."""
    by_name = {variant.name: variant for variant in variants()}
    kernel = next(v for name, v in by_name.items() if name.startswith("OpenBLAS"))
    single = Variant(
        f"{kernel.name}, one thread",
        kernel.environment | by_name["one BLAS thread"].environment,
        kernel.skipped,
    )
    return [by_name["NumPy without AVX-512"], single]


def main() -> None:
    """One run of nbval for each; a variant that would change nothing is skipped with a line."""
    bad = 0
    for variant in chosen():
        if variant.skipped:
            sys.stdout.write(f"skipped {variant.name}: {variant.skipped}\n")
            continue
        sys.stdout.write(f"{variant.name}: {variant.environment}\n")
        sys.stdout.flush()
        command = [sys.executable, *PYTEST, "-p", "no:cacheprovider"]
        bad |= subprocess.run(command, env=os.environ | variant.environment).returncode
    sys.exit(bad)


if __name__ == "__main__":
    main()
