"""A report as a page of its own, without a line from elsewhere."""

import base64
from html import escape
from typing import Any

from navfilters.crash.check import Case
from navfilters.crash.comparison import beside
from navfilters.crash.figures import figures


def page(title: str, report: Any) -> str:
    """A report in HTML.

    Parameters
    ----------
    title : str
    report : Report

    Returns
    -------
    str
        With pictures, if there is Matplotlib; otherwise a line says that there are none.
    """
    sections, missing = [], ""
    for f in report.findings:
        word = {True: "pass", False: "fail", None: "not asked"}[f.passed]
        cases = "".join(_bar(c) for c in f.cases)
        again = escape("\n".join(report.reproduce(f))) if f.passed is False else ""
        pictures = ""
        try:
            pictures = "".join(_picture(*each) for each in figures(f.kept))
        except ImportError as error:
            missing = f"<p>Without pictures: {escape(str(error))}.</p>"
        sections.append(
            f'<section class="{word.split()[0]}"><h2>{escape(f.check.name)} '
            f"<span>{word}</span></h2><p>{escape(f.check.rule)}. <i>Chapter "
            f"{escape(f.check.chapter)}.</i></p><p>{escape(f.why)}</p>"
            f"<p>{escape(beside(f.check.name))}</p>{cases}{pictures}"
            f"{f'<pre>{again}</pre>' if again else ''}</section>"
        )
    stopped = ""
    if report.missing:
        stopped = f"<p><b>Interrupted; not made: {escape(', '.join(report.missing))}.</b></p>"
    rows = "\n".join(sections)
    return _PAGE.format(title=escape(title), notes=stopped + missing, rows=rows)


def _picture(svg: str, description: str) -> str:
    text, data = escape(description), base64.b64encode(svg.encode()).decode()
    source = f"data:image/svg+xml;base64,{data}"
    return f'<figure><img src="{source}" alt="{text}"><figcaption>{text}</figcaption></figure>'


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
figure {{ margin: 1rem 0; }} img {{ width: 100%; max-width: 42rem; background: white; }}
figcaption {{ font-size: 0.9rem; }}
.limit {{ position: absolute; left: 50%; top: -3px; bottom: -3px; border-left: 2px solid; }}
</style></head><body><h1>{title}</h1>
<p>A bar that passes the line in its middle is beyond its limit.</p>
{notes}
{rows}
</body></html>
"""
