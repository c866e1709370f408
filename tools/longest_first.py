"""A plug-in of pytest: the slowest notebooks start first, so that none runs alone at last."""

from typing import Any

LONGEST = (
    "sar-imaging",
    "closed-loop",
    "navigation",
    "autofocus-rivals",
    "geolocation",
    "limits",
    "fair-comparisons",
    "every-cure",
    "divergence-maps",
    "without-antenna",
    "sensitivity",
)
"""Of all chapters these took longest, in this order; to be measured again when that changes."""


def pytest_collection_modifyitems(items: list[Any]) -> None:
    """These first, each with its cells in order, and then the others as they come."""
    order = {name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: order.get(item.path.stem, len(order)))
