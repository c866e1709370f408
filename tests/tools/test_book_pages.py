"""What the book's pages get beyond the theme's."""

from types import SimpleNamespace
from typing import NamedTuple

import book_pages
import numpy as np
import pytest
from PIL import Image


class Pair(NamedTuple):
    left: int
    right: int


def test_fields_of_named_tuples_are_left_out():
    assert book_pages.without_description(None, "class", "left", Pair.left, False, None) is True
    assert book_pages.without_description(None, "class", "count", Pair.count, False, None) is None


@pytest.mark.parametrize(
    ("label", "numbers"),
    [
        ("perea2007-10-to-12", "Perea et al. 2007 (10)–(12)"),
        ("xiong2009-27-47", "Xiong et al. 2009 (27), (47)"),
        ("xiong2009-a14", "Xiong et al. 2009 (A.14)"),
    ],
)
def test_an_equation_has_our_number_and_the_sources(tmp_path, label, numbers):
    page = tmp_path / "page.html"
    page.write_text(f'<div class="math" id="equation-{label}">\n<span class="eqno">(3)<a></a>')
    book_pages.mend(page)
    assert f'<span class="eqno-source">{numbers}</span> (3)<a>' in page.read_text()


@pytest.mark.parametrize(
    ("label", "shown"),
    [("xiong2009-38", "(38)"), ("perea2007-5-to-7", "(5)–(7)"), ("joseph", "(3)")],
)
def test_a_reference_shows_the_number_that_the_source_gives(tmp_path, label, shown):
    page = tmp_path / "page.html"
    link = f'<a class="reference internal" href="../a/b.html#equation-{label}">'
    page.write_text(f"{link}(3)</a>")
    book_pages.mend(page)
    book_pages.mend(page)  # as a second build does
    assert page.read_text() == f"{link}{shown}</a>"


def test_an_equation_of_ours_has_one_number(tmp_path):
    page = tmp_path / "page.html"
    text = '<div class="math" id="equation-joseph">\n<span class="eqno">(3)<a></a>'
    page.write_text(text)
    book_pages.mend(page)
    assert page.read_text() == text


@pytest.mark.parametrize(("name", "kept"), [("search.html", True), ("page.html", False)])
def test_the_index_of_the_search_is_for_the_search(tmp_path, name, kept):
    page = tmp_path / name
    page.write_text(
        '<script src="../_static/searchtools.js"></script>\n'
        '<script src="../searchindex.js"></script>'
    )
    book_pages.mend(page)
    assert ("searchindex" in page.read_text()) is kept
    assert ("searchtools" in page.read_text()) is kept


def test_a_picture_of_few_colours_becomes_smaller_and_looks_the_same(tmp_path):
    colours = np.random.default_rng(3).integers(0, 256, (40, 3), dtype=np.uint8)
    pixels = colours[np.random.default_rng(4).integers(0, 40, (120, 160))]
    path = tmp_path / "few.png"
    Image.fromarray(pixels).save(path)
    size = path.stat().st_size
    book_pages.with_palette(path)
    assert path.stat().st_size < size
    moved = np.asarray(Image.open(path).convert("RGB"), int) - pixels
    assert np.abs(moved).max() <= book_pages.NEAR


def test_a_picture_of_many_colours_or_a_clear_one_stays(tmp_path):
    pixels = np.random.default_rng(5).integers(0, 256, (120, 160, 4), dtype=np.uint8)
    for name, made in (("many", pixels[..., :3]), ("clear", pixels)):
        path = tmp_path / f"{name}.png"
        Image.fromarray(made).save(path)
        before = path.read_bytes()
        book_pages.with_palette(path)
        assert path.read_bytes() == before


def test_pages_of_code_that_lie_as_deep_share_their_contents():
    app, made = SimpleNamespace(env=SimpleNamespace(found_docs={"book/a"})), {}

    def shown(page, **options):
        context = {"toctree": lambda **options: (page, options)}
        book_pages.contents_once(made, app, page, "page.html", context, None)
        return context["toctree"](**options)

    assert shown("_modules/a/b", depth=1) == ("_modules/a/b", {"depth": 1})
    assert shown("_modules/a/c", depth=1) == ("_modules/a/b", {"depth": 1})
    assert shown("_modules/a/c", depth=2) == ("_modules/a/c", {"depth": 2})
    assert shown("_modules/a", depth=1) == ("_modules/a", {"depth": 1})
    assert shown("book/a", depth=1) == ("book/a", {"depth": 1})  # marks itself in them
    assert shown("search", depth=1) == ("search", {"depth": 1})
