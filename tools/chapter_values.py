"""Run one chapter without its pictures, and store what it checks and prints.

Every ``claims.check`` is noted instead of obeyed, so that one claim that fails hides no other.
"""

import argparse
import json
import os
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("agg")
import last_bits
import nbformat
from IPython.core.interactiveshell import InteractiveShell
from IPython.utils.capture import capture_output
from matplotlib import pyplot as plt

from navfilters.book import claims
from navfilters.book.claims.verdicts import numbers


def noting(notes: dict[str, Any]) -> Any:
    """A check that writes down the value and the verdict that it gives."""

    def check(claim_id: str, value: Any, *, second: Any = None) -> None:
        try:
            verdict = claims.derive(claims.load()[claim_id], value, second=second)
        except claims.ClaimError as error:
            verdict = f"refused: {error}"
        notes[claim_id] = {"value": numbers(sort_like(claim_id, value)), "verdict": verdict}

    return check


def sort_like(claim_id: str, value: Any) -> Any:
    """A mapping in the order of the ledger's entry, so that numbers can be compared by place."""
    return _like(value, claims.load()[claim_id].ours)


def _like(value: Any, recorded: Any) -> Any:
    if isinstance(value, dict) and isinstance(recorded, dict) and set(value) == set(recorded):
        return {key: _like(value[key], recorded[key]) for key in recorded}
    return value


def run(path: Path, seed: int | None) -> dict[str, Any]:
    """Values of claims by id, and by its cell's id the text that each prints or shows."""
    shell = InteractiveShell.instance(colors="NoColor")
    shell.user_ns["__name__"] = "__main__"
    notes: dict[str, Any] = {}
    printed: dict[str, str] = {}
    claims.check = noting(notes)
    if seed is not None:
        last_bits.install(seed, shell)
    os.chdir(path.parent)
    for cell in nbformat.read(path, as_version=4).cells:
        if cell.cell_type != "code":
            continue
        with capture_output(display=False) as captured:
            result = shell.run_cell(cell.source)
        plt.close("all")
        if not result.success:
            raise SystemExit(f"{path}, cell {cell.id}: {captured.stdout[-2000:]}")
        printed[cell.id] = captured.stdout
    return {"claims": notes, "printed": printed}


def main() -> None:
    """Read notebook, result and seed from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("notebook", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, help="nudge every input by one unit in the last place")
    arguments = parser.parse_args()
    out = arguments.out.resolve()
    found = run(arguments.notebook.resolve(), arguments.seed)
    out.write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main()
