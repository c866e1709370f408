"""The checks, and a filter put through them."""

import time
from collections.abc import Iterable, Sequence
from contextlib import nullcontext
from functools import cache
from typing import Any

import numpy as np

from navfilters.crash import linear_checks, problem_checks
from navfilters.crash.adapters import Adapted
from navfilters.crash.check import Case, Check
from navfilters.crash.problem_checks import on_problem
from navfilters.crash.report import Finding, Report
from navfilters.crash.subject import Subject, nobody
from navfilters.estimators.any_filter import as_filter
from navfilters.estimators.state import FilterState, first_state
from navfilters.numerics import validation
from navfilters.runs.progress import bar
from navfilters.runs.sweeping import SweepError
from navfilters.types import Array, Gaussian

LINEAR = "on linear problems it is the Kalman filter, to 1e-7 of a deviation"
HONEST = (
    "at most 5 % of the runs lost, median error at most twice the best honest one's, NEES at most "
    "a quarter above the band of an honest filter"
)
FIX, ORBIT = "range-bearing/noise", "orbit-manoeuvre/fair-comparisons"

CHECKS: dict[str, Check] = {
    check.name: check
    for check in (
        Check("linear", LINEAR, "foundations/kalman-type-filters", linear_checks.linear_updates),
        Check("motion", LINEAR, "foundations/first-filter", linear_checks.linear_motion),
        Check(
            "missing",
            "what was not measured is left out; nothing measured changes nothing",
            "foundations/first-filter",
            linear_checks.not_measured,
        ),
        Check(
            "exact",
            "what has no variance stays as it is, and disturbs nothing",
            "range-bearing/unscented-filter",
            linear_checks.known_exactly,
        ),
        Check(
            "decades",
            "with ten decades between prior and sensor P stays definite and right",
            "range-bearing/second-order-filter",
            linear_checks.ten_decades,
        ),
        Check(
            "members",
            "a member's result does not depend on the others",
            "architecture",
            problem_checks.one_by_one,
        ),
        Check(
            "covariance",
            "P is symmetric and positive definite at every step",
            "range-bearing/second-order-filter",
            problem_checks.sound_covariances,
        ),
        Check(
            "jump",
            "a bearing of 179 degrees and one of -179 are two degrees apart",
            "range-bearing/sensitivity",
            problem_checks.behind_the_jump,
        ),
        Check(
            "units",
            "in other units it is the same estimate",
            "beyond/every-cure",
            problem_checks.other_units,
        ),
        Check(
            "last bits",
            "the last bit of the start does not decide",
            "beyond/divergence-maps",
            problem_checks.last_bits,
        ),
        Check(
            "axes",
            "with turned axes it is the same estimate, to a tenth of a deviation",
            "range-bearing/unscented-filter",
            problem_checks.turned_axes,
        ),
        Check(
            "fix, perfect", HONEST, "range-bearing/ekf-divergence", on_problem("fix, perfect", 20)
        ),
        Check("fix, noisy", HONEST, FIX, on_problem("fix, noisy", 20)),
        Check(
            "starts",
            "from at least 95 % of the starts it gains a decimal digit in 100 updates",
            "beyond/divergence-maps",
            problem_checks.starts,
        ),
        Check(
            "sweeps",
            "over 13 deviations of the start and 15 ratios of the noises it gains a decimal digit "
            "in 100 updates, or half of what the exact linear filter gains, in at least 95 %",
            "range-bearing/sensitivity",
            problem_checks.sweeps,
        ),
        Check("pendulum", HONEST, "foundations/extended-kalman-filter", on_problem("pendulum", 20)),
        Check("orbit, quiet", HONEST, ORBIT, on_problem("orbit, quiet", 20)),
        Check("burns, A", HONEST, ORBIT, on_problem("burns, A", 20)),
        Check("burns, B", HONEST, ORBIT, on_problem("burns, B", 20)),
        Check(
            "images, TC-1",
            HONEST,
            "sar-navigation/consistency",
            on_problem("images, TC-1", 40),
            vector=False,
        ),
        Check(
            "images, TC-2",
            HONEST,
            "sar-navigation/consistency",
            on_problem("images, TC-2", 40),
            vector=False,
        ),
    )
}
"""Every check by name, cheap ones first."""

_NAMES = list(CHECKS)
SUITES: dict[str, list[str]] = {
    "correct": _NAMES[: _NAMES.index("axes")],
    "quick": _NAMES[: _NAMES.index("pendulum")],
    "all": _NAMES,
}
"""Names of the checks of each suite."""


def crash_test(
    filter: Any,
    suite: str | Iterable[str] = "all",
    *,
    name: str = "",
    workers: int | None = None,
    progress: bool = True,
) -> Report:
    """Put a filter through the book's checks.

    Parameters
    ----------
    filter : Filter, or whatever ``run`` takes, or what an adapter gives
        It is given each problem's model and dynamics.
    suite : {"all", "quick", "correct"} or iterable of str
        All; what takes a minute; what any correct implementation passes, be it of a good filter or
        not. Names of checks are keys of ``CHECKS``.
    name : str
        Of the filter, for the report.
    workers : int, optional
        Processes among which the members of an adapted filter are divided, which need joblib; by
        default one per core, and one without joblib.
    progress : bool
        A bar of updates with the time left, on standard error.

    Returns
    -------
    Report
        Of what was finished, if it is interrupted.

    Raises
    ------
    ValueError
        An unknown suite or check, or fewer than one worker.
    TypeError
        A filter that is none.
    """
    checks = [CHECKS[n] for n in _chosen(suite)]
    if not isinstance(filter, Adapted):
        as_filter(filter)
    workers = cores() if workers is None else validation.whole_number("workers", workers, 1)
    asked = [c for c in checks if c.vector or not isinstance(filter, Adapted)]
    findings: list[Finding] = []
    try:
        total = sum(updates(c.name) for c in asked) if progress else 0
        with bar(total) if progress else nullcontext(nobody) as told:
            for check in checks:
                findings.append(_examined(Subject(filter, workers, told), check))
    except KeyboardInterrupt:
        pass  # what is done is reported
    missing = tuple(c.name for c in checks[len(findings) :])
    return Report(name or _name(filter), tuple(findings), missing)


def cores() -> int:
    """Processes that can be had: one without joblib."""
    try:
        from joblib import cpu_count
    except ImportError:
        return 1
    return cpu_count()


@cache
def updates(check: str) -> int:
    """How many updates of one state a check makes of a filter, counted with one that does nothing.

    Parameters
    ----------
    check : str
        Its name.

    Returns
    -------
    int
    """
    counted: list[int] = []
    try:
        with np.errstate(all="ignore"):
            CHECKS[check](Subject(Idle(), told=counted.append))
    except (ValueError, ArithmeticError):  # numbers of a filter that does nothing may be none
        pass
    return sum(counted)


class Idle:
    """A filter that keeps its first estimate."""

    def init(self, prior: Gaussian) -> FilterState:
        """The state before any step."""
        return first_state(prior)

    def step(
        self, state: FilterState, z: Array, sensor: Any, dynamics: Any = None, k: Array = 0
    ) -> FilterState:
        """The same."""
        return state


def _chosen(suite: str | Iterable[str]) -> Sequence[str]:
    if isinstance(suite, str):
        if suite in SUITES:
            return SUITES[suite]
        suite = [suite]
    names = list(suite)
    for n in names:
        if n not in CHECKS:
            raise ValueError(
                f"suite must be one of {list(SUITES)} or names of checks, {list(CHECKS)}; "
                f"found {n!r}"
            )
    return names


def _examined(subject: Subject, check: Check) -> Finding:
    if isinstance(subject.filter, Adapted) and not check.vector:
        return Finding(check, (), skipped="its state has an attitude; this filter's is a vector")
    begun = time.perf_counter()
    cases: tuple[Case, ...] = ()
    raised = ""
    try:
        cases = tuple(check(subject))
    except SweepError as error:  # names the member that it happened to
        where, _, what = str(error).partition(": ")
        raised = f"{what.splitlines()[0]} ({where})"
    except Exception as error:  # whatever a filter of another makes of it is what is asked
        raised = f"{type(error).__name__}: {error}".splitlines()[0]
    seconds = time.perf_counter() - begun
    return Finding(check, cases, raised, seconds=seconds, kept=subject.kept)


def _name(filter: Any) -> str:
    return getattr(filter, "__name__", type(filter).__name__)
