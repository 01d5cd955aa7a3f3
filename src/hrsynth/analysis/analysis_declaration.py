"""Declaration of analyses: what the index, the command line and its help know of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from ..options import Option, list_options, strip_annotations
from ..progress import show_progress
from .arguments import ArgumentBinder
from .result_cache import compute_cached

P = ParamSpec("P")
R = TypeVar("R")


@dataclass(frozen=True)
class Declaration:
    """Declaration of an analysis: its ``place`` in lists, its summary, its options, examples of its command line, and
    its ``seed``."""

    place: int
    help: str
    options: tuple[Option, ...]
    examples: tuple[str, ...]
    seeded: bool


def analysis(
    place: int, *, examples: tuple[str, ...], seeded: bool = True, formations: bool = False
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Declare an analysis: a function of a robot with a frozen result.

    The robot is also accepted by its name or path, and with ``formations`` with several platform links
    (:mod:`.arguments`); results are cached (:mod:`.result_cache`). All else is in its :class:`Declaration`: options are
    in the annotations of its parameters, its summary is the first paragraph of the docstring. The index of all analyses
    is made of these (:mod:`hrsynth.index`).
    """

    def made(function: Callable[P, R]) -> Callable[P, R]:
        binder = ArgumentBinder(function, formations)
        summary = " ".join((function.__doc__ or "").partition("\n\n")[0].split())

        @wraps(function)
        def asked(*args: Any, **given: Any) -> Any:
            with show_progress():
                return compute_cached(function, binder.bind(args, given))

        asked.__signature__ = strip_annotations(function)  # type: ignore[attr-defined]
        asked.declaration = Declaration(  # type: ignore[attr-defined]
            place, summary, tuple(list_options(function)), examples, seeded
        )
        return asked

    return made
