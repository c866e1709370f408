"""What the book's pages get beyond the theme's: few icons, MathJax where needed, public names only.

A Sphinx extension, named in _config.yml.
"""

import importlib
import io
import json
import re
import tomllib
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from fontTools import subset
from PIL import Image
from sphinx.application import Sphinx

from navfilters.book.claims.pages import named

ICON = re.compile(r'"?([\w-]+)"?:\[(\d+),(\d+),\[([^\]]*)\],"[0-9a-f]+","([^"]*)"\]')
NAMED = re.compile(r"\bfa-([a-z][a-z0-9-]*)")
BY_FONT = re.compile(r'(?:\.fa-[\w-]+:before,?)+\{content:"[^"]*"\}')
CHARACTER = re.compile(r'"\\(f[0-9a-f]{3})"|"([\uf000-\uf8ff])"')
TWO_FONTS = re.compile(r'url\([^)]*fa-[\w-]+\.woff2\) format\("woff2"\),')
FOLDER = Path(__file__).resolve().parent
NEAR = 10  # of 255: how far a colour may move when a picture gets a palette


# What the theme writes into every page: the search's index, which only the search needs, and marks
# that a screen reader cannot make sense of.
MENDED = (
    (re.compile(r'<script src="[./]*_static/(?:searchtools|language_data)\.js"></script>\s*'), ""),
    (re.compile(r'<script src="[./]*searchindex\.js"></script>\s*'), ""),
    (re.compile(r'<div role="list" class="citation-list">'), '<div class="citation-list">'),
    (re.compile(r"<summary>(?=<span class=.toctree-toggle)"), '<summary aria-label="its pages">'),
)

# An equation whose label begins with a source's name has that source's number: xiong2009-a14. The
# text calls it by that number, so a reference shows it alone.
SOURCE = r"equation-(perea2007|lecture16|xiong2009|pogorelsky2020)-([\w-]+)"
EQUATION = re.compile(rf'(id="{SOURCE}">\s*<span class="eqno">)(\(\d+\))')
REFERENCE = re.compile(rf'(<a class="reference internal" href="[^"#]*#{SOURCE}">)\(\d+\)(?=</a>)')


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect to Sphinx."""
    app.connect("autodoc-skip-member", without_description)
    app.connect("missing-reference", where_it_is_public)
    app.connect("html-page-context", mathjax_where_needed, priority=900)
    app.connect("html-page-context", partial(contents_once, {}), priority=400)  # before the theme
    app.connect("build-finished", lighter)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


# --- names --------------------------------------------------------------------------------------


def without_description(app, what, name, found, skip, options) -> bool | None:
    """Fields of named tuples, which their class describes, have no entries of their own."""
    described = getattr(found, "__doc__", None) or ""
    return True if described.startswith("Alias for field number") else None


def where_it_is_public(app, env, node, contnode):
    """A reference to the module that keeps a name leads to the package that shows it.

    A name that is not public is shown as code; one that does not exist stays a fault.
    """
    if node.get("refdomain") != "py":
        return None
    domain, target = env.get_domain("py"), node["reftarget"]
    if not target.startswith("navfilters."):
        return contnode if _kept_in(node.get("py:module") or "", target) else None
    parts = target.split(".")
    for own in (1, 2):  # a name, or a class and its method
        for n in range(len(parts) - own, 0, -1):
            public = ".".join([*parts[:n], *parts[-own:]])
            if public in domain.objects:
                return domain.resolve_xref(
                    env, node["refdoc"], app.builder, node["reftype"], public, node, contnode
                )
    return contnode if _has(".".join(parts[:-1]), parts[-1]) else None


def _kept_in(package: str, target: str) -> bool:
    """Whether a module of a package, or a class in one, has the name."""
    if not package.startswith("navfilters"):
        return False
    folder = Path(str(importlib.import_module(package).__file__)).parent
    modules = [f"{package}.{path.stem}" for path in folder.glob("[a-z]*.py")]
    places = [package, *modules]
    if any(_has(place, target.rpartition(".")[2]) for place in places):
        return True
    classes = (c for place in places for c in vars(importlib.import_module(place)).values())
    return any(isinstance(c, type) and hasattr(c, target.rpartition(".")[2]) for c in classes)


def _has(module: str, name: str) -> bool:
    try:
        return hasattr(importlib.import_module(module), name)
    except ImportError:
        return False


# --- weight -------------------------------------------------------------------------------------


def mathjax_where_needed(app, pagename, templatename, context, doctree) -> None:
    """A page without formulas of its own does not load MathJax, whatever its sections contain."""
    if not app.env.get_domain("math").data["has_equations"].get(pagename):
        files = context["script_files"]
        files[:] = [file for file in files if "mathjax" not in str(file.filename or "")]


def contents_once(made, app, pagename, templatename, context, doctree) -> None:
    """The book's contents beside a page of code, made once for all such pages that lie as deep."""
    if pagename in app.env.found_docs:
        return
    make, depth = context["toctree"], pagename.count("/")

    def contents(**options) -> str:
        key = (depth, *sorted(options.items()))
        if key not in made:
            made[key] = make(**options)
        return made[key]

    context["toctree"] = contents


def lighter(app, exception) -> None:
    """Reduce what the built pages load."""
    if exception or app.builder.format != "html":
        return
    out = Path(app.outdir)
    for page in out.rglob("*.html"):
        mend(page)
    few_icons(out)
    few_characters(out / "_static")
    licences(out / "_static" / "licences")
    with ThreadPoolExecutor() as pool:
        list(pool.map(with_palette, sorted((out / "_images").glob("*.png"))))


def mend(page: Path) -> None:
    """Take out of a page what it does not need, and name what has no name."""
    before = after = page.read_text(encoding="utf-8")
    for pattern, new in MENDED:
        if new or page.name != "search.html":
            after = pattern.sub(new, after)
    after = EQUATION.sub(_both_numbers, after)
    after = REFERENCE.sub(lambda found: found[1] + _numbers(found[3]), after)
    if after != before:
        page.write_text(after, encoding="utf-8")


def _both_numbers(found: re.Match) -> str:
    """Our number of an equation, and the source's."""
    source = f'<span class="eqno-source">{named(found[2])} {_numbers(found[3])}</span>'
    return f"{found[1]}{source} {found[4]}"


def _numbers(label: str) -> str:
    """The source's numbers: 5-to-7 is (5)–(7)."""
    return ", ".join(
        "–".join(f"({n.replace('a', 'A.')})" for n in part.split("-to-"))
        for part in re.findall(r"\w+-to-\w+|\w+", label)
    )


def few_icons(out: Path) -> None:
    """Of the theme's icons, only those that a page or a script names."""
    theme = out / "_static" / "scripts" / "fontawesome.js"
    text = theme.read_text(encoding="utf-8")
    if "const ICONS" in text:  # built before, and not copied anew
        return
    icons = {}
    for name, width, height, aliases, path in ICON.findall(text):
        for each in (name, *re.findall(r'"([\w-]+)"', aliases)):
            icons[each] = [int(width), int(height), path]
    used = set()
    for page in (*out.rglob("*.html"), *(out / "_static").rglob("*.js")):
        if page != theme:
            used |= set(NAMED.findall(page.read_text(encoding="utf-8")))
    few = {name: icons[name] for name in sorted(used & set(icons))}
    script = (FOLDER / "icons.js").read_text(encoding="utf-8")
    licence = text[: text.find("*/") + 2]
    theme.write_text(f"{licence}\nconst ICONS = {json.dumps(few)};\n{script}", encoding="utf-8")


def few_characters(static: Path) -> None:
    """Of the icons' font, only what style sheets write; of their rules, none for drawn icons."""
    wanted = set()
    for path in static.rglob("*.css"):
        before = path.read_text(encoding="utf-8")
        after = TWO_FONTS.sub("", BY_FONT.sub("", before))
        wanted |= {int(h, 16) if h else ord(c) for h, c in CHARACTER.findall(after)}
        if after != before:
            path.write_text(after, encoding="utf-8")
    fonts = static / "vendor" / "fontawesome" / "webfonts"
    for path in fonts.glob("*.woff2"):
        path.unlink()
    for path in fonts.glob("*.ttf"):
        options = subset.Options(notdef_outline=True, ignore_missing_unicodes=True)
        font = subset.load_font(path, options)
        reduced = subset.Subsetter(options)
        reduced.populate(unicodes=wanted)
        reduced.subset(font)
        subset.save_font(font, path, options)


def licences(folder: Path) -> None:
    """The licences of what the pages load, as book/licences.toml lists it; one file a package."""
    listed = (FOLDER.parent / "book" / "licences.toml").read_text(encoding="utf-8")
    folder.mkdir(exist_ok=True)
    for work in tomllib.loads(listed)["work"]:
        if package := work.get("package"):
            texts = [FOLDER.parent / work["text"]] if "text" in work else _texts(package)
            content = "\n".join(path.read_text(encoding="utf-8") for path in texts)
            (folder / f"{package}.txt").write_text(content, encoding="utf-8")


def _texts(package: str) -> list[Path]:
    files = metadata.files(package) or []
    found = [f for f in files if re.match("(LICENSE|COPYING)", f.name) and ".dist-info" in str(f)]
    if not found:
        raise FileNotFoundError(
            f"{package} has no file of its licence; book/licences.toml needs text"
        )
    return [Path(str(f.locate())) for f in sorted(found)]


def with_palette(path: Path) -> None:
    """An opaque picture in 256 colours, where none moves by more than ``NEAR``."""
    picture = Image.open(path)
    if (
        picture.mode not in ("RGB", "RGBA")
        or np.asarray(picture.convert("RGBA"))[..., 3].min() < 255
    ):
        return
    whole = picture.convert("RGB")
    few = whole.quantize(256, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    moved = np.asarray(few.convert("RGB"), int) - np.asarray(whole, int)
    new = io.BytesIO()
    few.save(new, "PNG", optimize=True)
    if np.abs(moved).max() <= NEAR and len(new.getvalue()) < path.stat().st_size:
        path.write_bytes(new.getvalue())
