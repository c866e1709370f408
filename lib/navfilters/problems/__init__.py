"""Patients for filters, and what became of them."""

from navfilters.problems.catalogue import problems
from navfilters.problems.outcome import Outcome, treat
from navfilters.problems.problem import LOST, Draw, Problem

__all__ = ["LOST", "Draw", "Outcome", "Problem", "problems", "treat"]
