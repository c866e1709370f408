"""Figures in the dark: lines are drawn light on dark, pictures keep their colours."""

import base64
import io
import re

import browser as chromium
import nbformat
import numpy as np
import pytest
from PIL import Image

INK = re.compile(r"\b(black|white|dark|pale)\b(?! noise)", re.I)


def figures():
    """Settings and stored PNG of every captioned figure."""
    for path in sorted((chromium.ROOT / "book").rglob("*.ipynb")):
        for cell in nbformat.read(path, as_version=4).cells:
            settings = cell.metadata.get("mystnb", {})
            pngs = [o["data"]["image/png"] for o in cell.get("outputs", ()) if _drawn(o)]
            if "figure" in settings and pngs:
                yield settings, base64.b64decode(pngs[0])


def _bands(png):
    """Red, green and blue, 0 to 255."""
    return [np.asarray(band) for band in Image.open(io.BytesIO(png)).convert("RGB").split()]


def _drawn(output):
    return "image/png" in output.get("data", {})


FIGURES = list(figures())
NAMES = [settings["figure"]["name"] for settings, _ in FIGURES]


@pytest.mark.parametrize(("settings", "png"), FIGURES, ids=NAMES)
def test_pictures_and_named_inks_are_marked(settings, png):
    """A map inverted would lie; a line that a caption calls black needs a word in the dark."""
    bands = _bands(png)
    marked = settings.get("image", {}).get("classes", "")
    least = np.minimum.reduce(bands)
    coloured = np.mean(np.maximum.reduce(bands) - least > 0.16 * 255)
    paper = np.mean(least > 0.98 * 255)
    if coloured > 0.3 or paper < 0.45:
        assert marked == "picture"
    elif INK.search(settings["figure"]["caption"]):
        assert marked in ("ink", "picture")


@pytest.fixture
def brightness(browser):
    """Mean brightness, 0 to 255, of a figure as it stands on its page in the dark."""

    def of(page, name):
        with browser.visit(page, theme="dark") as visit:
            shot = visit.page.locator(f"#{name} img").screenshot()
        return np.mean(_bands(shot))

    return of


def test_lines_are_dark(brightness):
    assert brightness("book/range-bearing/ekf-divergence", "fig-perea-2a") < 60


def test_pictures_are_not_inverted(brightness):
    assert brightness("book/sar-navigation/sar-imaging", "fig-sar-scene") > 100
