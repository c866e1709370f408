"""Patients for filters, cures for them, and what became of each pair."""

from navfilters.problems.catalogue import problems
from navfilters.problems.cures import Cure, UnfitError
from navfilters.problems.evaluations import evaluations
from navfilters.problems.fresh import Fresh, fresh, fresh_report, read_fresh, write_fresh
from navfilters.problems.later_cures import CURES, LATER
from navfilters.problems.noisier import Noisier
from navfilters.problems.outcome import Outcome, treat
from navfilters.problems.problem import LOST, Draw, Problem
from navfilters.problems.reading import Row, best, elsewhere, listing, own, reasons, rows
from navfilters.problems.static_fix import static_fix
from navfilters.problems.stored import RUNS, read
from navfilters.problems.table import Cell, cells, table
from navfilters.problems.units import in_units

__all__ = [
    "CURES",
    "LATER",
    "LOST",
    "RUNS",
    "Cell",
    "Cure",
    "Draw",
    "Fresh",
    "Noisier",
    "Outcome",
    "Problem",
    "Row",
    "UnfitError",
    "best",
    "cells",
    "elsewhere",
    "evaluations",
    "fresh",
    "fresh_report",
    "in_units",
    "listing",
    "own",
    "problems",
    "read",
    "read_fresh",
    "reasons",
    "rows",
    "static_fix",
    "table",
    "treat",
    "write_fresh",
]
