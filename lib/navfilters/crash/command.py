"""``navfilters crash-test MODULE:NAME``."""

import argparse
import importlib
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from navfilters.crash.suite import CHECKS, SUITES, crash_test


def main(arguments: Sequence[str] | None = None) -> int:
    """Import a filter, test it, report.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line by default.

    Returns
    -------
    int
        0 if it passed, 1 if it failed or was interrupted.
    """
    parser = argparse.ArgumentParser(
        prog="navfilters crash-test",
        description="Put a filter through what this book knows.",
        epilog="Checks: " + "; ".join(f"{c.name}: {c.rule}" for c in CHECKS.values()),
    )
    parser.add_argument(
        "filter", metavar="MODULE:NAME", help="importable from here: mine:my_filter"
    )
    parser.add_argument("--suite", default="quick", choices=SUITES)
    parser.add_argument("--check", action="append", choices=CHECKS, help="only this; repeatable")
    parser.add_argument(
        "--workers", type=int, help="processes for a filter of one state; one per core by default"
    )
    parser.add_argument("--html", type=Path, help="write a page to this file")
    parser.add_argument("--json", type=Path, help="write the numbers to this file")
    chosen = parser.parse_args(arguments)
    try:
        filter = imported(chosen.filter)
        asked = chosen.check or chosen.suite
        report = crash_test(filter, asked, name=chosen.filter, workers=chosen.workers)
    except (ValueError, TypeError) as error:
        parser.error(str(error))
    report = replace(report, where=chosen.filter)
    sys.stdout.write(f"{report}\n")
    if chosen.html:
        chosen.html.write_text(report.html(), encoding="utf-8")
    if chosen.json:
        chosen.json.write_text(report.json(), encoding="utf-8")
    return int(not report.passed)


def imported(where: str) -> Any:
    """What ``module:name`` stands for; modules of the working folder are found.

    Parameters
    ----------
    where : str

    Returns
    -------
    object

    Raises
    ------
    ValueError
        No colon, no such module, no such name.
    """
    module, colon, name = where.partition(":")
    if not (module and colon and name):
        raise ValueError(f"MODULE:NAME is needed, such as mine:my_filter; found {where!r}")
    if "" not in sys.path and str(Path.cwd()) not in sys.path:
        sys.path.insert(0, str(Path.cwd()))
    try:
        found: Any = importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name and f"{module}.".startswith(f"{error.name}."):
            raise ValueError(f"no module {module} in {Path.cwd()} or installed") from None
        raise
    for part in name.split("."):
        if not hasattr(found, part):
            raise ValueError(f"{module} has no {name}")
        found = getattr(found, part)
    return found
