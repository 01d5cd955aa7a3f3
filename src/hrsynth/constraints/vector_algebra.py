"""Vector algebra in SymPy: symbols stand for vectors; ``dot``, ``cross`` and ``det`` (triple product) for the products.

The expressions are ordinary SymPy trees over these three functions; :func:`evaluate` gives their values for arrays of
vectors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..geometry.vectors import Array


class Products(NamedTuple):
    """The three products as SymPy functions."""

    dot: Any
    cross: Any
    det: Any


@cache
def load_products() -> Products:
    """``dot`` (symmetric), ``cross`` and ``det`` (a·(b × c)), with the signs of permutations taken out."""
    import sympy

    class dot(sympy.Function):  # noqa: N801
        nargs = 2

        @classmethod
        def eval(cls, a: Any, b: Any) -> Any:
            first, second = sorted((a, b), key=sympy.default_sort_key)
            return None if (first, second) == (a, b) else cls(first, second)

    class cross(sympy.Function):  # noqa: N801
        nargs = 2

    class det(sympy.Function):  # noqa: N801
        nargs = 3

        @classmethod
        def eval(cls, *vectors: Any) -> Any:
            order = sorted(range(3), key=lambda i: sympy.default_sort_key(vectors[i]))
            if order == [0, 1, 2]:
                return None
            ordered = cls(*(vectors[i] for i in order))
            return ordered if order in ([1, 2, 0], [2, 0, 1]) else -ordered

    for each in (dot, cross, det):
        each.__qualname__ = each.__name__
    return Products(dot, cross, det)


def __getattr__(name: str) -> Any:
    """Return the products that a pickled expression names."""
    if name not in Products._fields:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(load_products(), name)


def make_vector(name: str) -> Any:
    """A symbol that stands for a vector."""
    import sympy

    return sympy.Symbol(name)


def evaluate(expression: Any, values: Mapping[str, Array]) -> Array:
    """Values of an expression for vectors (n, 3), shape (n,)."""
    names, run = _compile(expression)
    size = max(map(len, values.values()), default=1)
    return np.broadcast_to(np.asarray(run(*(values[name] for name in names)), dtype=float), (size,))


@lru_cache(maxsize=64)
def _compile(expression: Any) -> tuple[tuple[str, ...], Callable[..., Any]]:
    """An expression as a function of arrays of its vectors, with their names in order."""
    import sympy

    names = tuple(sorted(str(symbol) for symbol in expression.free_symbols))
    functions = {
        "dot": lambda a, b: np.einsum("...i,...i->...", a, b),
        "cross": np.cross,
        "det": lambda a, b, c: np.einsum("...i,...i->...", a, np.cross(b, c)),
    }
    return names, sympy.lambdify([sympy.Symbol(name) for name in names], expression, modules=[functions, "numpy"])
