"""Declaration of analyses: robots by value, name or path; options; cached results."""

from __future__ import annotations

import warnings
from collections import OrderedDict
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from functools import wraps
from inspect import signature
from numbers import Integral, Real
from threading import Lock
from typing import Any, ParamSpec, TypeVar

import numpy as np

from ..budgets import CACHED_GRID_RESULTS_COUNT, CACHED_RESULTS_COUNT
from ..errors import BadRequest, MissingExtra
from ..mechanism import Mechanism
from ..options import Option, list_options, list_parameter_types, require_range, strip_annotations
from ..results import freeze_content, require_keywords
from .observed import clear_robots, list_requested_legs, read_robot

P = ParamSpec("P")
R = TypeVar("R")


KINDS: dict[str, tuple[Any, str]] = {
    "int": (Integral, "an integer"),
    "float": (Real, "a number"),
    "str": (str, "a text"),
    "bool": ((bool, np.bool_), "True or False"),
}
"""Check and name of the arguments of each type."""


@dataclass(frozen=True)
class Declaration:
    """Declaration of an analysis: its ``place`` in lists, its summary, its options, examples of its command line, and
    its ``seed``."""

    place: int
    help: str
    options: tuple[Option, ...]
    examples: tuple[str, ...]
    seeded: bool


class AnswerMemory:
    """Results of the latest calls, up to a number."""

    def __init__(self, most: int) -> None:
        self.most, self.lock = most, Lock()
        self.kept: OrderedDict[Hashable, Any] = OrderedDict()

    def answer(self, key: Hashable, ask: Callable[[], Any]) -> Any:
        """Return the cached result, or compute it; not kept if an optional package was missing, which may be installed
        later."""
        with self.lock:
            if key in self.kept:
                self.kept.move_to_end(key)
                return self.kept[key]
        missed = MissingExtra.met
        found = ask()
        if MissingExtra.met == missed:
            with self.lock:
                self.kept[key] = found
                while len(self.kept) > self.most:
                    self.kept.popitem(last=False)
        return found


_ANSWERS, _GRIDS = AnswerMemory(CACHED_RESULTS_COUNT), AnswerMemory(CACHED_GRID_RESULTS_COUNT)


def clear_cache() -> None:
    """Clear all results and samples from the cache.

    Examples
    --------
    >>> hrsynth.clear_cache()
    """
    clear_results()
    clear_robots()


def clear_results() -> None:
    """Clear the results alone."""
    for memory in (_ANSWERS, _GRIDS):
        memory.kept.clear()


def require_kinds(kinds: Mapping[str, list[str]], options: Mapping[str, Option], given: Mapping[str, Any]) -> None:
    """Raise ``BadRequest`` for an argument that is no number, text or truth value where the signature needs one, or a
    number out of its range."""
    for name, value in given.items():
        option = options.get(name)
        kind, *none = kinds[name]
        if kind not in KINDS or none not in ([], ["None"]) or (none and value is None):
            continue
        right, word = KINDS[kind]
        if not isinstance(value, right) or (isinstance(value, bool) and kind != "bool"):
            raise BadRequest(name, value, word)
        if option is not None:
            require_range(name, value, word, option.low, option.high)


def analysis(
    place: int, *, examples: tuple[str, ...], seeded: bool = True, formations: bool = False, **old: str
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Declare an analysis: a function of a robot with a frozen result.

    The robot is also accepted by its name or path, and results are cached. ``old`` option names, each with its new
    name, are accepted for one version more. ``formations``: it also accepts several platform links. All else is in its
    :class:`Declaration`: options are in the annotations of its parameters, its summary is the first paragraph of the
    docstring. The index of all analyses is made of these (:mod:`hrsynth.index`). Calls are the same with equal
    arguments and an equal robot, read from the same file.
    """

    def made(function: Callable[P, R]) -> Callable[P, R]:
        known = signature(function)
        options = tuple(list_options(function))
        kinds = list_parameter_types(function)
        by_name = {each.name: each for each in options}
        summary = " ".join((function.__doc__ or "").partition("\n\n")[0].split())

        @wraps(function)
        def asked(*args: Any, **given: Any) -> Any:
            for name in sorted(old.keys() & given.keys()):
                if old[name] in given:
                    raise TypeError(f"{function.__name__}: {name} is the old name of {old[name]}, which is given too")
                warnings.warn(
                    f"{function.__name__}: {name} is now called {old[name]}; the old name will be "
                    "removed in the next version",
                    DeprecationWarning,
                    stacklevel=2,
                )
                given[old[name]] = given.pop(name)
            require_keywords(function, given)
            try:
                bound = known.bind(*args, **given)
            except TypeError as error:
                raise TypeError(f"{function.__name__}: {error}; it takes {', '.join(known.parameters)}") from None
            require_kinds(kinds, by_name, bound.arguments)
            robot = bound.arguments["robot"] = read_robot(bound.arguments["robot"])
            source = robot if isinstance(robot, Mechanism) else robot.robot
            if source.formation and not formations:
                raise BadRequest(
                    f"{source.name}: {function.__name__} needs one platform, and this is a formation",
                    ", ".join(source.bodies),
                    remedy="Name a <platform> in the file, or use derive, legs or check.",
                )
            if given.get("into") is not None:
                return function(*bound.args, **bound.kwargs)
            every = known.bind(*args, **given)
            every.apply_defaults()
            if "observe" in (values := every.arguments):
                values["observe"] = list_requested_legs(robot, values["observe"], values.get("sensor"))
            told = [(name, freeze_content(value)) for name, value in every.arguments.items() if name != "robot"]
            key = (function.__qualname__, robot, source.file, source.notes, source.options, source.sha256, *told)
            try:
                hash(key)
            except TypeError:
                return function(*bound.args, **bound.kwargs)
            large = any(given.get(name) is not None for name in ("plane", "grid"))
            return (_GRIDS if large else _ANSWERS).answer(key, lambda: function(*bound.args, **bound.kwargs))

        asked.__signature__ = strip_annotations(function)  # type: ignore[attr-defined]
        asked.declaration = Declaration(place, summary, options, examples, seeded)  # type: ignore[attr-defined]
        return asked

    return made
