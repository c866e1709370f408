"""``navfilters crash-test MODULE:NAME``."""

import argparse
import importlib
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from textwrap import fill
from typing import Any

from navfilters.crash.suite import CHECKS, SUITES, crash_test
from navfilters.runs import stored_arrays


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
        epilog="checks, and what passes:\n" + "\n".join(_rules()),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "filter", metavar="MODULE:NAME", help="importable from here: mine:my_filter"
    )
    parser.add_argument("--suite", default="quick", choices=SUITES)
    parser.add_argument(
        "--check",
        action="append",
        choices=CHECKS,
        metavar="NAME",
        help="only this, of those below, as in --check 'fix, noisy'; repeatable",
    )
    parser.add_argument(
        "--workers", type=int, help="processes for a filter of one state; one per core by default"
    )
    parser.add_argument("--html", type=Path, help="write a page to this file")
    parser.add_argument("--json", type=Path, help="write the numbers to this file")
    chosen = parser.parse_args(arguments)
    for option, path in (("--html", chosen.html), ("--json", chosen.json)):
        if path and (path.is_dir() or not path.parent.is_dir()):
            parser.error(f"{option}: a file in a folder that exists is needed; found {path}")
    try:
        filter = imported(chosen.filter)
        asked = chosen.check or chosen.suite
        report = crash_test(filter, asked, name=chosen.filter, workers=chosen.workers)
    except (ValueError, TypeError) as error:
        parser.error(str(error))
    report = replace(report, where=chosen.filter)
    sys.stdout.write(f"{report}\n")
    try:
        if chosen.html:
            stored_arrays.write(chosen.html, report.html().encode())
        if chosen.json:
            stored_arrays.write(chosen.json, report.json().encode())
    except OSError as error:
        parser.error(str(error))
    return int(not report.passed)


def _rules() -> Iterator[str]:
    """The names of checks of one rule, and the rule."""
    for rule, checks in groupby(CHECKS.values(), key=lambda check: check.rule):
        yield fill("; ".join(check.name for check in checks), 79, initial_indent="  ")
        yield fill(rule, 79, initial_indent=" " * 6, subsequent_indent=" " * 6)


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
