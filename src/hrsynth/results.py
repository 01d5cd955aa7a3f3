"""Base classes of results: one line at a prompt, the text of the command line in ``print`` and notebooks."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass, replace
from functools import wraps
from inspect import Parameter, signature
from math import isfinite
from typing import Any, ClassVar, ParamSpec, TypeVar

from .errors import shorten_text
from .records import Record, answer_type

LONGEST_LINE, LONGEST_PART = 160, 48
"""Largest length of a value at a prompt, and of each of its fields (characters)."""
P = ParamSpec("P")
R = TypeVar("R")
V = TypeVar("V", bound="Value")
TUPLE_MEMBERS_PRINTED_MAX = 3
"""Largest number of tuple members that are shown; of longer tuples only the number."""


def drop_infinite(value: float | None) -> float | None:
    """Return a number for JSON: None if it is undefined or infinite."""
    return None if value is None or not isfinite(value) else float(value)


class Value(Record):
    """Base class of frozen dataclasses declared with ``repr=False``: its repr is one line. Pickles and copies hold the
    fields only: a copy computes cached properties again, and its arrays are read-only."""

    def __repr__(self) -> str:
        own = [field for field in fields(self) if field.repr]  # type: ignore[arg-type]
        parts = (f"{field.name}={shorten_value(getattr(self, field.name))}" for field in own)
        return shorten_text(f"{type(self).__name__}({', '.join(parts)})", LONGEST_LINE)

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}  # type: ignore[arg-type]

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            for array in value if isinstance(value, tuple) else (value,):
                if hasattr(array, "setflags"):
                    array.setflags(write=False)
            object.__setattr__(self, name, value)


def shorten_value(value: Any) -> str:
    """Return a value in a few characters: of arrays the shape, of long tuples the number of members."""
    if isinstance(value, Mapping | tuple | list) and len(value) > TUPLE_MEMBERS_PRINTED_MAX:
        first = next(iter(value.values() if isinstance(value, Mapping) else value))
        return f"<{len(value)} × {type(first).__name__}>"
    if hasattr(value, "shape") and value.shape:
        return f"<array {' × '.join(map(str, value.shape))}>"
    return shorten_text(f"{value:.6g}" if isinstance(value, float) else repr(value), LONGEST_PART)


def freeze_content(value: Any) -> Any:
    """Return the content of a value for comparison and hashing: arrays as tuples, dataclasses as compared fields."""
    if isinstance(value, Mapping):
        return tuple((key, freeze_content(each)) for key, each in value.items())
    if isinstance(value, tuple | list):
        return tuple(map(freeze_content, value))
    if is_dataclass(value):
        return type(value), *(freeze_content(getattr(value, field.name)) for field in fields(value) if field.compare)
    return freeze_content(value.tolist()) if hasattr(value, "tolist") else value


class ComparableValue(Value):
    """Value (dataclass with ``eq=False``) that compares by content; a verdict also equals its label:
    ``found.verdict == "controllable"``."""

    @property
    def word(self) -> str | None:
        """Label of a verdict, None for other values."""
        return getattr(self, "verdict", None) if isinstance(getattr(self, "verdict", None), str) else None

    def said(self) -> Any:
        """Return the content that is compared."""
        return freeze_content(self)

    def __eq__(self, other: object) -> bool:
        if isinstance(other, str):
            return self.word == other
        if type(self) is not type(other):
            return NotImplemented
        return self is other or self.said() == other.said()

    def __hash__(self) -> int:
        return hash(type(self).__name__ if self.word is None else self.word)


class Result(ComparableValue):
    """Result of an analysis.

    ``repr`` is one line, ``str`` the text of the command line, and a notebook shows the same as HTML. Two results are
    equal if their robots and their JSON are equal.

    ``shown_as`` names the outputs in the table of ``present/outputs.py``. The functions that show them are in a higher
    layer: the package sets ``public``, which loads its public functions ``text`` and ``html`` at first use.
    """

    shown_as: ClassVar[str]
    public: ClassVar[Callable[[str], Any]]

    def __init_subclass__(cls, shown_as: str | None = None, **more: Any) -> None:
        super().__init_subclass__(**more)
        if shown_as is not None:
            cls.shown_as = shown_as

    @property
    def command(self) -> str:
        """Command that prints the result; of a part of a result its kind."""
        return self.shown_as

    def headline(self) -> str:
        """Return the result in one line."""
        raise NotImplementedError

    def text(self) -> str:
        """Return the text of the command, unless ``present/outputs.py`` defines it."""
        return self.headline()

    def plot(self, axes: Any) -> None:
        """Draw the result on axes, unless ``present/outputs.py`` defines the figure."""

    def rows(self) -> Iterable[Iterable[Any]]:
        """Return the rows of the result, headings first, unless ``present/outputs.py`` defines them."""
        return ()

    def to_json(self) -> str:
        """Return the JSON that the command prints with ``--json``."""
        return str(Result.public("to_json")(self))

    def to_pandas(self) -> Any:
        """Return the result as ``hrsynth.to_pandas`` does, a ``pandas.DataFrame``."""
        return Result.public("to_pandas")(self)

    @staticmethod
    def answer_of(name: str) -> type[Result]:
        """Return the class of a public function's results."""
        found: type[Result] = answer_type(Result.public(name))
        return found

    def require_answered(self, **asked: Any) -> None:
        """Raise the error of the command's exit status if a part of the request has no result."""

    def said(self) -> tuple[Any, ...]:
        """Return the content that is compared: the setup and the JSON."""
        return getattr(self, "setup", None), self.to_dict()

    def __hash__(self) -> int:
        return hash(self.headline() if self.word is None else self.word)

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {shorten_text(self.headline(), LONGEST_LINE)}>"

    def __str__(self) -> str:
        return str(Result.public("text")(self))

    def _repr_html_(self) -> str:
        return str(Result.public("html")(self))


def require_keywords(function: Callable[..., Any], given: Iterable[str], more: Iterable[str] = ()) -> None:
    """Raise ``TypeError`` for an unknown keyword, with the nearest known one; ``more``: keywords of its ``**``."""
    known = [name for name, each in signature(function).parameters.items() if each.kind is not Parameter.VAR_KEYWORD]
    known += more
    for name in given:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            raise TypeError(
                f"{function.__name__} has no {name!r}{f', did you mean {near[0]!r}' if near else ''}; "
                f"it takes {', '.join(known)}"
            )


def with_spelling(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate a function to name its keywords when an unknown one is given."""

    @wraps(function)
    def called(*args: P.args, **given: P.kwargs) -> R:
        require_keywords(function, given)
        return function(*args, **given)

    return called


def with_value(function: Callable[[V], R]) -> Callable[[V], R]:
    """Decorate a function of one frozen value to cache its result in that value."""
    name = f"_{function.__name__}"

    @wraps(function)
    def asked(value: V) -> R:
        if name not in value.__dict__:
            value.__dict__[name] = function(value)
        found: R = value.__dict__[name]
        return found

    return asked


def by_name(value: type[Any], keyword: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorate an analysis with options in one frozen value (``keyword``) to accept the fields of that value as
    keywords."""
    fields = signature(value).parameters

    def named(question: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(question)
        def asked(*args: Any, **given: Any) -> Any:
            own = {name: given.pop(name) for name in fields if name in given}
            return question(*args, **given | {keyword: replace(given.get(keyword) or value(), **own)})

        known = signature(question)
        own = [each.replace(default=None) if each.name == keyword else each for each in known.parameters.values()]
        more = [field.replace(kind=Parameter.KEYWORD_ONLY) for field in fields.values()]
        asked.__signature__ = known.replace(parameters=[*own, *more])  # type: ignore[attr-defined]
        return asked

    return named
