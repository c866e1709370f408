"""Figures that compute in the page: a place for one, and what it is told."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from html import escape
from typing import Any

from navfilters.book.plotting import STYLES
from navfilters.estimators import FILTERS
from navfilters.numerics.extras import missing

try:
    from IPython.display import HTML
except ImportError as error:
    raise missing("IPython", "navfilters[book]", "figures", error) from None


def computing(
    name: str, caption: str, setup: Any, *, instead: bool = False, **settings: Any
) -> HTML:
    """A figure that the reader's browser computes; nothing where there are no scripts.

    Parameters
    ----------
    name : str
        Of its script in ``book/_static/figures``.
    caption : str
        What to see.
    setup : dataclass or mapping
        The experiment that it begins with: numbers, texts, and tuples of them.
    instead : bool
        Whether it takes the place of the cell before it, which stays for print.
    **settings
        What else the script needs. The filters' colours and dashes are added.

    Returns
    -------
    IPython.display.HTML
    """
    given = dict(setup) if isinstance(setup, Mapping) else asdict(setup)
    told = json.dumps(given | settings | {"styles": _strokes()}, sort_keys=True)
    told = told.replace("<", "\\u003c")  # nothing in it ends the script
    place = ' data-instead="true"' if instead else ""
    return HTML(
        f'<figure class="computing" data-figure="{escape(name)}"{place}>'
        f'<script type="application/json">{told}</script><div class="stage"></div>'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )


def _strokes() -> dict[str, dict[str, str]]:
    """Colour and SVG dashes of the ten filters that pages compute."""
    strokes = {}
    for name in FILTERS:
        style = STYLES[name]
        dashes = () if style["linestyle"] == "-" else style["linestyle"][1]
        dash = " ".join(f"{2 * length:g}" for length in dashes)
        strokes[name] = {"color": style["color"], "dash": dash}
    return strokes
