"""Figures that compute in the page: a place for one, and what it is told."""

import json
import re
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from html import escape
from typing import Any

from navfilters.book.plotting import STYLES
from navfilters.estimators import FILTERS
from navfilters.numerics.extras import missing
from navfilters.numerics.validation import whole_number

try:
    from IPython.display import HTML
except ImportError as error:
    raise missing("IPython", "navfilters[book]", "figures", error) from None

_NAME = re.compile(r"[a-z][a-z0-9-]*")


def computing(
    name: str, caption: str, setup: Any, *, instead: int = 0, plain: str = "", **settings: Any
) -> HTML:
    """A figure that the reader's browser computes; what is plain, where there are no scripts.

    Parameters
    ----------
    name : str
        Of its script in ``book/_static/figures``.
    caption : str
        What to see.
    setup : dataclass or mapping
        The experiment that it begins with: finite numbers, texts, and tuples of them.
    instead : int
        Of how many cells before it it takes the place; they stay for print.
    plain : str
        HTML that the script makes the figure of, and that stands alone without it.
    **settings
        What else the script needs. The filters' colours and dashes are added.

    Returns
    -------
    IPython.display.HTML

    Raises
    ------
    TypeError
        A set-up that is neither, or a value that is none of these.
    ValueError
        A name that is none, an ``instead`` below 0, or a number that is not finite.
    """
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise ValueError(f"name must be that of a script, in small letters; found {name!r}")
    instead = whole_number("instead", int(instead) if instead is True else instead, 0)
    if isinstance(setup, Mapping):
        given = dict(setup)
    elif is_dataclass(setup) and not isinstance(setup, type):
        given = asdict(setup)
    else:
        raise TypeError(f"setup must be a dataclass or a mapping; found {type(setup).__name__}")
    told = _json(given | settings) | {"styles": json.dumps(_strokes(), sort_keys=True)}
    text = ", ".join(f"{json.dumps(key)}: {told[key]}" for key in sorted(told))
    text = text.replace("<", "\\u003c")  # nothing in it ends the script
    place = f' data-instead="{instead}"' if instead else ""
    return HTML(
        f'<figure class="computing" data-figure="{escape(name)}"{place}>'
        f'<script type="application/json">{{{text}}}</script><div class="stage"></div>{plain}'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )


def _json(told: Mapping[str, Any]) -> dict[str, str]:
    """Each setting as JSON, or the name of the one that is none."""
    found = {}
    for key, value in told.items():
        try:
            found[key] = json.dumps(value, sort_keys=True, allow_nan=False, separators=(",", ":"))
        except (TypeError, ValueError) as error:
            raise type(error)(
                f"{key} must be finite numbers, texts and tuples of them: {error}"
            ) from None
    return found


def _strokes() -> dict[str, dict[str, str]]:
    """Colour and SVG dashes of the ten filters that pages compute."""
    strokes = {}
    for name in FILTERS:
        style = STYLES[name]
        dashes = () if style["linestyle"] == "-" else style["linestyle"][1]
        dash = " ".join(f"{2 * length:g}" for length in dashes)
        strokes[name] = {"color": style["color"], "dash": dash}
    return strokes
