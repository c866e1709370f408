"""What a crash test found: in lines, as data, as a page."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from html import escape
from typing import Any

from navfilters.crash.check import Case, Check
from navfilters.problems import own, read

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
        return f"{sum(bool(f.passed) for f in made)} of {len(made)} checks passed"

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
        rows = []
        for f in self.findings:
            word = {True: "pass", False: "fail", None: "not asked"}[f.passed]
            cases = "".join(_bar(c) for c in f.cases)
            again = escape("\n".join(self.reproduce(f))) if f.passed is False else ""
            note = escape(beside(f.check.name))
            rows.append(
                f'<section class="{word.split()[0]}"><h2>{escape(f.check.name)} '
                f"<span>{word}</span></h2><p>{escape(f.check.rule)}. <i>Chapter "
                f"{escape(f.check.chapter)}.</i></p><p>{escape(f.why)}</p><p>{note}</p>{cases}"
                f"{f'<pre>{again}</pre>' if again else ''}</section>"
            )
        title = f"Crash test of {escape(self.name)}: {self._count()}"
        return _PAGE.format(title=title, rows="\n".join(rows))


def beside(problem: str) -> str:
    """What the book's filters make of a problem: the plain EKF, and the best that is honest.

    Parameters
    ----------
    problem : str
        Its name; empty is returned for checks that are none.

    Returns
    -------
    str
    """
    there = {cure: c for (p, cure), c in own(read()).items() if p == problem and not c.reason}
    if "EKF" not in there:
        return ""
    sound = [c for c in there.values() if c.honest <= 0 and c.lost <= 0.05]
    words = f"of the book's own filters the EKF loses {there['EKF'].lost:.0%}"
    if sound:
        best = min(sound, key=lambda c: c.ratio)
        words += f", and {best.cure} is the best honest one, {best.ratio:.2g} times the bound"
    return words


def _bar(case: Case) -> str:
    """A case as a bar that ends at its limit."""
    share = min(case.excess, 2.0) / 2 if case.excess == case.excess else 1.0
    return (
        f'<div class="case"><div>{escape(case.configuration)}: {escape(case.what)} '
        f"<b>{case.value:.3g}</b>, at most {case.limit:.3g}</div>"
        f'<div class="bar"><div class="{"in" if case.passed else "out"}" '
        f'style="width:{100 * share:.0f}%"></div><div class="limit"></div></div></div>'
    )


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title}</title>
<style>
:root {{ color-scheme: light dark; }}
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 50rem; margin: 2rem auto; }}
body {{ padding: 0 1rem; }}
section {{ border-left: 6px solid; padding: 0.2rem 1rem; margin: 1rem 0; }}
.pass {{ border-color: #1a7f37; }} .fail {{ border-color: #b3261e; border-left-style: double; }}
.not {{ border-color: #888; }}
h2 {{ font-size: 1.1rem; margin: 0.3rem 0; }} h2 span {{ font-weight: 400; }}
p {{ margin: 0.3rem 0; }} pre {{ overflow-x: auto; border: 1px solid #8888; padding: 0.5rem; }}
.case {{ font-size: 0.9rem; margin: 0.4rem 0; }}
.bar {{ position: relative; height: 0.6rem; border: 1px solid #888; }}
.in {{ background: #1a7f37; height: 100%; }} .out {{ background: #b3261e; height: 100%; }}
.limit {{ position: absolute; left: 50%; top: -3px; bottom: -3px; border-left: 2px solid; }}
</style></head><body><h1>{title}</h1>
<p>A bar that passes the line in its middle is beyond its limit.</p>
{rows}
</body></html>
"""
