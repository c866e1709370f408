"""Crash test: what this book knows about filters, asked of yours."""

from navfilters.crash.adapters import Adapted, from_functions
from navfilters.crash.check import Case, Check
from navfilters.crash.filter_py import from_filterpy
from navfilters.crash.planted import FAULTS, textbook_ekf
from navfilters.crash.report import Finding, Report
from navfilters.crash.stone_soup import from_stonesoup
from navfilters.crash.suite import CHECKS, SUITES, crash_test

__all__ = [
    "CHECKS",
    "FAULTS",
    "SUITES",
    "Adapted",
    "Case",
    "Check",
    "Finding",
    "Report",
    "crash_test",
    "from_filterpy",
    "from_functions",
    "from_stonesoup",
    "textbook_ekf",
]
