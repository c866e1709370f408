"""What a crash test found: in lines, as data, as a page."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from navfilters.crash.check import Case, Check
from navfilters.crash.comparison import beside
from navfilters.crash.page import page

SITE = "the chapter {} of When Kalman Filters Diverge"


@dataclass(frozen=True)
class Finding:
    """What a check found.

    Parameters
    ----------
    check : Check
    cases : tuple of Case
    raised : str
        The filter's exception, if it raised one.
    skipped : str
        Why it was not asked.
    seconds : float
        That it took.
    kept : mapping
        What its figure shows, as :class:`~navfilters.crash.subject.Subject` kept it.
    """

    check: Check
    cases: tuple[Case, ...]
    raised: str = ""
    skipped: str = ""
    seconds: float = 0.0
    kept: Mapping[str, Any] = field(default_factory=dict, compare=False)

    @property
    def passed(self) -> bool | None:
        """Whether every case did; None where it was not asked."""
        if self.skipped:
            return None
        return not self.raised and all(case.passed for case in self.cases)

    @property
    def worst(self) -> Case | None:
        """The case that is farthest beyond its limit, or nearest to it."""
        return max(self.cases, key=lambda case: case.excess, default=None)

    @property
    def line(self) -> str:
        """One line: verdict, name, and what decided."""
        mark = {True: "pass", False: "FAIL", None: "  - "}[self.passed]
        return f"{mark}  {self.check.name:14}{self.why}"

    @property
    def why(self) -> str:
        """What decided."""
        if self.skipped or self.raised:
            return self.skipped or f"it raised {self.raised}"
        worst = self.worst
        if worst is None:
            return "nothing to compare"
        return f"{worst.configuration}: {worst.what} {worst.value:.3g}, at most {worst.limit:.3g}"


@dataclass(frozen=True)
class Report:
    """What a filter did.

    Parameters
    ----------
    name : str
        Of the filter.
    findings : tuple of Finding
    missing : tuple of str
        Checks that were not begun, since the test was interrupted.
    where : str
        What imports the filter, for the lines that reproduce a failure: ``module:name``.
    """

    name: str
    findings: tuple[Finding, ...]
    missing: tuple[str, ...] = ()
    where: str = ""

    @property
    def passed(self) -> bool:
        """Whether every check was made and none failed."""
        return not self.missing and all(f.passed is not False for f in self.findings)

    @property
    def failed(self) -> tuple[str, ...]:
        """Names of the checks that failed."""
        return tuple(f.check.name for f in self.findings if f.passed is False)

    def __str__(self) -> str:
        lines = [f"{self.name}: {self._count()}", *(f.line for f in self.findings)]
        for finding in self.findings:
            if finding.passed is False:
                lines += ["", *self._explained(finding)]
        if self.missing:
            lines += ["", f"interrupted; not made: {', '.join(self.missing)}"]
        return "\n".join(lines)

    def _count(self) -> str:
        made = [f for f in self.findings if f.passed is not None]
        stopped = ", then interrupted" if self.missing else ""
        return f"{sum(bool(f.passed) for f in made)} of {len(made)} checks passed{stopped}"

    def _explained(self, finding: Finding) -> list[str]:
        c = finding.check
        lines = [f"{c.name}: {finding.why}", f"  it passes if {c.rule}"]
        lines.append(f"  {SITE.format(c.chapter)} shows what goes wrong")
        if text := beside(c.name):
            lines.append(f"  {text}")
        return [*lines, *(f"    {line}" for line in self.reproduce(finding))]

    def reproduce(self, finding: Finding) -> tuple[str, str, str]:
        """Three lines of Python that make the check again."""
        module, _, attribute = self.where.partition(":")
        given = (
            f"from {module} import {attribute} as mine" if module else f"mine = ...  # {self.name}"
        )
        call = f"print(*CHECKS[{finding.check.name!r}](mine), sep='\\n')"
        return "from navfilters.crash import CHECKS", given, call

    def json(self) -> str:
        """Everything, for machines."""
        rows = [
            {
                "check": f.check.name,
                "passed": f.passed,
                "why": f.why,
                "rule": f.check.rule,
                "chapter": f.check.chapter,
                "seconds": round(f.seconds, 3),
                "cases": [
                    {
                        "configuration": c.configuration,
                        "what": c.what,
                        "value": c.value if c.value == c.value else None,
                        "limit": c.limit,
                        "passed": c.passed,
                    }
                    for c in f.cases
                ],
            }
            for f in self.findings
        ]
        whole = {"filter": self.name, "passed": self.passed, "missing": list(self.missing)}
        return json.dumps(whole | {"checks": rows}, indent=1, allow_nan=True) + "\n"

    def html(self) -> str:
        """A page of its own, without a line from elsewhere."""
        return page(f"Crash test of {self.name}: {self._count()}", self)
