"""What every question is answered with: one line at a prompt, the command line's text in print and in a notebook."""

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
"""Characters of a value at a prompt, and of each of its fields there."""
P = ParamSpec("P")
R = TypeVar("R")
V = TypeVar("V", bound="Value")
LISTED = 3
"""Members of a tuple that are shown; of more their number is."""


def finite(value: float | None) -> float | None:
    """A number of a record: null where there is none, or it is infinite."""
    return None if value is None or not isfinite(value) else float(value)


class Value(Record):
    """A frozen dataclass (with ``repr=False``) that is one line at a prompt, and is pickled and copied by its fields:
    what was computed from them is computed again where it is asked for, and arrays stay read-only."""

    def __repr__(self) -> str:
        own = [field for field in fields(self) if field.repr]  # type: ignore[arg-type]
        parts = (f"{field.name}={brief(getattr(self, field.name))}" for field in own)
        return shorten_text(f"{type(self).__name__}({', '.join(parts)})", LONGEST_LINE)

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}  # type: ignore[arg-type]

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            for array in value if isinstance(value, tuple) else (value,):
                if hasattr(array, "setflags"):
                    array.setflags(write=False)
            object.__setattr__(self, name, value)


def brief(value: Any) -> str:
    """A value in a few characters: of arrays the shape, of long tuples the number of members."""
    if isinstance(value, Mapping | tuple | list) and len(value) > LISTED:
        first = next(iter(value.values() if isinstance(value, Mapping) else value))
        return f"<{len(value)} × {type(first).__name__}>"
    if hasattr(value, "shape") and value.shape:
        return f"<array {' × '.join(map(str, value.shape))}>"
    return shorten_text(f"{value:.6g}" if isinstance(value, float) else repr(value), LONGEST_PART)


def content(value: Any) -> Any:
    """What a value holds, to be compared and hashed: arrays as tuples, of dataclasses the fields that are compared."""
    if isinstance(value, Mapping):
        return tuple((key, content(each)) for key, each in value.items())
    if isinstance(value, tuple | list):
        return tuple(map(content, value))
    if is_dataclass(value):
        return type(value), *(content(getattr(value, field.name)) for field in fields(value) if field.compare)
    return content(value.tolist()) if hasattr(value, "tolist") else value


class Compared(Value):
    """A value (a dataclass with ``eq=False``) that is equal to those that say the same, and where it is a verdict to
    its word: ``found.verdict == "controllable"``."""

    @property
    def word(self) -> str | None:
        """A verdict's one word, None for what is no verdict."""
        return getattr(self, "verdict", None) if isinstance(getattr(self, "verdict", None), str) else None

    def said(self) -> Any:
        """What is compared."""
        return content(self)

    def __eq__(self, other: object) -> bool:
        if isinstance(other, str):
            return self.word == other
        if type(self) is not type(other):
            return NotImplemented
        return self is other or self.said() == other.said()

    def __hash__(self) -> int:
        return hash(type(self).__name__ if self.word is None else self.word)


class Result(Compared):
    """An answer: its ``repr`` is one line, its ``str`` the text of the command line; a notebook shows the same as HTML.

    Two are equal if they say the same about the same robot.

    ``shown_as`` names its outputs in the table of ``present/outputs.py``. What shows them is in a layer above all
    questions: the package sets ``public``, which gives its public functions ``text`` and ``html`` and loads them when
    something is shown.
    """

    shown_as: ClassVar[str]
    public: ClassVar[Callable[[str], Any]]

    def __init_subclass__(cls, shown_as: str | None = None, **more: Any) -> None:
        super().__init_subclass__(**more)
        if shown_as is not None:
            cls.shown_as = shown_as

    def headline(self) -> str:
        """What is said in one line."""
        raise NotImplementedError

    def text(self) -> str:
        """What the command prints, where ``present/outputs.py`` does not say it."""
        return self.headline()

    def plot(self, axes: Any) -> None:
        """Draw the answer on the axes of a figure, where ``present/outputs.py`` does not say how."""

    def rows(self) -> Iterable[Iterable[Any]]:
        """The answer's rows, their heads first, where ``present/outputs.py`` does not say how."""
        return ()

    @staticmethod
    def answer_of(name: str) -> type[Result]:
        """The class of a public function's answers."""
        found: type[Result] = answer_type(Result.public(name))
        return found

    def require_answered(self, **asked: Any) -> None:
        """Raise what ends the command with another status, where not all that was ``asked`` has an answer."""

    def said(self) -> tuple[Any, ...]:
        """What is compared: the robot with what is watched of it, and the record."""
        return getattr(self, "setting", None), self.to_dict()

    def __hash__(self) -> int:
        return hash(self.headline() if self.word is None else self.word)

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {shorten_text(self.headline(), LONGEST_LINE)}>"

    def __str__(self) -> str:
        return str(Result.public("text")(self))

    def _repr_html_(self) -> str:
        return str(Result.public("html")(self))


def require_keywords(function: Callable[..., Any], given: Iterable[str], more: Iterable[str] = ()) -> None:
    """Raise ``TypeError`` for an unknown keyword, with the nearest known one; ``more`` are those behind its ``**``."""
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
    """A function that tells of a wrong keyword which ones it has."""

    @wraps(function)
    def called(*args: P.args, **given: P.kwargs) -> R:
        require_keywords(function, given)
        return function(*args, **given)

    return called


def with_value(function: Callable[[V], R]) -> Callable[[V], R]:
    """A function of one frozen value, whose answer is kept with that value."""
    name = f"_{function.__name__}"

    @wraps(function)
    def asked(value: V) -> R:
        if name not in value.__dict__:
            value.__dict__[name] = function(value)
        found: R = value.__dict__[name]
        return found

    return asked


def by_name(value: type[Any], keyword: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """A question whose options are one frozen value, its ``keyword``, and that takes that value's fields by their own
    names as well."""
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
