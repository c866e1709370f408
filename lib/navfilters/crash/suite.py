"""The checks, and a filter put through them."""

import time
from collections.abc import Iterable, Sequence
from contextlib import nullcontext
from typing import Any

from navfilters.crash import linear_checks, problem_checks
from navfilters.crash.adapters import Adapted
from navfilters.crash.check import Check
from navfilters.crash.problem_checks import on_problem
from navfilters.crash.report import Finding, Report
from navfilters.estimators.any_filter import as_filter
from navfilters.runs.progress import bar

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
    progress : bool
        A bar on standard error.

    Returns
    -------
    Report
        Of what was finished, if it is interrupted.

    Raises
    ------
    ValueError
        An unknown suite or check.
    TypeError
        A filter that is none.
    """
    checks = [CHECKS[n] for n in _chosen(suite)]
    as_filter(filter)
    findings: list[Finding] = []
    shown = bar(len(checks)) if progress else nullcontext(_nobody)
    with shown as done:
        for check in checks:
            try:
                findings.append(_examined(filter, check))
            except KeyboardInterrupt:
                break
            done(1)
    missing = tuple(c.name for c in checks[len(findings) :])
    return Report(name or _name(filter), tuple(findings), missing)


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


def _examined(filter: Any, check: Check) -> Finding:
    if isinstance(filter, Adapted) and not check.vector:
        return Finding(check, (), skipped="its state has an attitude; this filter's is a vector")
    begun = time.perf_counter()
    try:
        cases = tuple(check(filter))
    except Exception as error:  # whatever a filter of another makes of it is what is asked
        text = f"{type(error).__name__}: {error}".splitlines()[0]
        return Finding(check, (), raised=text, seconds=time.perf_counter() - begun)
    return Finding(check, cases, seconds=time.perf_counter() - begun)


def _name(filter: Any) -> str:
    return getattr(filter, "__name__", type(filter).__name__)


def _nobody(done: int) -> None:
    """Told of progress that nobody wants to see."""
