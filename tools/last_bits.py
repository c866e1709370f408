"""Changes of a chapter's inputs by one unit in the last place, the same for the same input.

What counts as an input: floating-point numbers of arrays that a cell writes out, the mean and
covariance of a Gaussian that a cell, a model or an experiment makes, a noise-free measurement that
a cell takes, and every random draw.
"""

import ast
import inspect
import sys
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np

import navfilters.models
from navfilters.types import Gaussian

ARRAYS = {"array", "asarray", "diag", "Gaussian"}
DRAWS = ("normal", "standard_normal", "uniform", "random", "exponential", "rayleigh")
MORE_DRAWS = ("multivariate_normal", "standard_gamma", "gamma", "laplace", "standard_exponential")
INPUTS_ARE_MADE_IN = ("__main__", "navfilters.papers", "navfilters.models", "navfilters.space")


def nudged(values: Any, seed: int) -> Any:
    """Each number one unit in the last place up, down, or as it was; zeros stay."""
    array = np.asarray(values)
    if array.dtype.kind != "f":
        return values
    step = np.random.Generator(
        np.random.PCG64([seed, zlib.crc32(np.ascontiguousarray(array).tobytes())])
    ).integers(-1, 2, array.shape)
    moved = np.nextafter(array, np.where(step > 0, np.inf, -np.inf).astype(array.dtype))
    moved = np.where((step == 0) | (array == 0), array, moved)
    return float(moved) if isinstance(values, float) else moved


def nudged_covariance(cov: Any, seed: int) -> Any:
    """As ``nudged``, symmetric where it was."""
    array = np.asarray(cov)
    moved = nudged(array, seed)
    if array.ndim < 2 or moved is array or not np.array_equal(array, array.swapaxes(-1, -2)):
        return moved
    lower = np.tril(np.ones(array.shape[-2:], bool))
    return np.where(lower, moved, np.swapaxes(moved, -1, -2))


def make_generator(seed: int) -> type[np.random.Generator]:
    """A random generator whose draws are nudged."""

    def nudging(name: str) -> Callable:
        def draw(self: np.random.Generator, *args: Any, **kwargs: Any) -> Any:
            drawn = nudged(getattr(np.random.Generator, name)(self, *args, **kwargs), seed)
            out = kwargs.get("out")
            if out is None:
                return drawn
            out[...] = drawn
            return out

        return draw

    return type("Nudging", (np.random.Generator,), {n: nudging(n) for n in DRAWS + MORE_DRAWS})


class Literals(ast.NodeTransformer):
    """Nudges the numbers with a point in ``np.array([...])`` and its like."""

    def __init__(self, seed: int) -> None:
        self.seed, self.inside = seed, False

    def visit_Call(self, node: ast.Call) -> ast.AST:
        name = ast.unparse(node.func).rpartition(".")[2]
        before, self.inside = self.inside, name in ARRAYS
        self.generic_visit(node)
        self.inside = before
        return node

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        if self.inside and isinstance(node.value, float):
            return ast.copy_location(ast.Constant(nudged(node.value, self.seed)), node)
        return node


def _made_by_an_input(depth: int = 2) -> bool:
    return sys._getframe(depth).f_globals.get("__name__", "").startswith(INPUTS_ARE_MADE_IN)


def install(seed: int, shell: Any) -> None:
    """Nudge all inputs of the chapter that this process is about to run."""
    shell.ast_transformers.append(Literals(seed))
    _nudge_gaussians(seed)
    _nudge_measurements(seed)
    generator = make_generator(seed)
    plain = np.random.default_rng

    def default_rng(seed: Any = None) -> np.random.Generator:
        made = plain(seed)
        return made if made is seed else generator(made.bit_generator)

    np.random.default_rng = default_rng


def _nudge_gaussians(seed: int) -> None:
    make = Gaussian.__new__

    def new(cls: type, mean: Any, cov: Any) -> Gaussian:
        numbers = isinstance(mean, np.ndarray) and isinstance(cov, np.ndarray)
        if numbers and _made_by_an_input():
            mean, cov = nudged(mean, seed), nudged_covariance(cov, seed)
        return make(cls, mean, cov)

    Gaussian.__new__ = new  # type: ignore[method-assign]


def _nudge_measurements(seed: int) -> None:
    for _, model in inspect.getmembers(navfilters.models, inspect.isclass):
        if not hasattr(model, "h"):
            continue
        plain = model.h

        def h(self: Any, x: Any, *args: Any, plain: Callable = plain, **kwargs: Any) -> Any:
            z = plain(self, x, *args, **kwargs)
            by_a_cell = sys._getframe(1).f_globals.get("__name__") == "__main__"
            return nudged(z, seed) if by_a_cell and isinstance(z, np.ndarray) else z

        model.h = h
