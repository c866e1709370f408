"""The small pictures of the front page's cards, from the figures that the chapters show.

A card of ``book/intro.ipynb`` names its picture ``_static/thumbnails/<name of the figure>.png``.
"""

import base64
import io
import re
import sys
from pathlib import Path

import nbformat
from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "book" / "_static" / "thumbnails"
WANTED = re.compile(r"_static/thumbnails/([\w-]+)\.png")
SIZE = (480, 270)


def figures() -> dict[str, bytes]:
    """Every named figure of the book's stored notebooks, as PNG."""
    found = {}
    for path in sorted((ROOT / "book").rglob("*.ipynb")):
        for cell in nbformat.read(path, as_version=4).cells:
            name = cell.metadata.get("mystnb", {}).get("figure", {}).get("name")
            pictures = [
                o.data["image/png"]
                for o in cell.get("outputs", [])
                if "data" in o and "image/png" in o.data
            ]
            if name and pictures:
                found[name] = base64.b64decode(pictures[-1])
    return found


def small(picture: bytes) -> Image.Image:
    """The picture in the width of a card, on white; what is taller is cut below."""
    image = Image.open(io.BytesIO(picture)).convert("RGB")
    width, height = SIZE
    tall = round(image.height * width / image.width)
    card = Image.new("RGB", SIZE, "white")
    card.paste(image.resize((width, tall)), (0, max(0, (height - tall) // 2)))
    return card


def main() -> None:
    """Write the pictures that the front page names."""
    text = "\n".join(c.source for c in nbformat.read(ROOT / "book" / "intro.ipynb", 4).cells)
    known = figures()
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in dict.fromkeys(WANTED.findall(text)):
        if name not in known:
            sys.exit(f"book/intro.ipynb shows {name}, and no notebook has a figure of that name")
        small(known[name]).save(FOLDER / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main()
