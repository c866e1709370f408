"""Compute the whole table: ``python -m navfilters.problems``; ``--help`` for more."""

import argparse
import sys
from collections.abc import Iterable, Sequence
from typing import Any

from navfilters.numerics.extras import at_least, command
from navfilters.problems import stored
from navfilters.problems.catalogue import problems
from navfilters.problems.fresh import FRESH, fresh, fresh_report, write_fresh
from navfilters.problems.table import table


def main(arguments: Sequence[str] | None = None) -> None:
    """Compute the table at its full size, and store it; or try its best values again.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line by default.
    """
    parser = argparse.ArgumentParser(
        prog="navfilters cures", description="Every cure on every patient."
    )
    parser.add_argument("--runs", type=int, default=stored.RUNS, help="of each pair")
    parser.add_argument("--workers", type=int, help="processes; one per core by default")
    parser.add_argument("--quick", action="store_true", help="200 updates of the static fix")
    parser.add_argument(
        "--fresh", action="store_true", help="only the best scanned values, on other draws"
    )
    parser.add_argument("--out", help=f"file of the result: {stored.FILE}, or {FRESH} by default")
    chosen = parser.parse_args(arguments)
    at_least(parser, "--runs", chosen.runs, 2)
    if chosen.fresh:
        rows = fresh(stored.read(), problems(full=not chosen.quick), chosen.runs)
        write_fresh(chosen.out or FRESH, rows)
        sys.stdout.write(f"{fresh_report(rows)}\n")
        return
    found = table(
        chosen.runs,
        patients=problems(full=not chosen.quick),
        workers=chosen.workers,
        progress=_bar,
    )
    out = chosen.out or stored.FILE
    stored.write(out, found)
    sys.stdout.write(f"{len(found)} rows in {out}\n")


def _bar(parts: Iterable[Any], total: int | None = None) -> Iterable[Any]:
    try:
        from tqdm import tqdm
    except ImportError:
        return iter(parts)
    return tqdm(parts, total=total, unit=" parts", disable=None)


if __name__ == "__main__":
    command(main)
