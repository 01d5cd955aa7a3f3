"""What every question is answered with: one line at a prompt, the command line's text in print and in a notebook."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from inspect import Parameter, signature
from typing import Any, ClassVar


class Result:
    """An answer: its ``repr`` is one line, its ``str`` the text of the command line, in a notebook the same as HTML.

    ``shown_as`` names its outputs in the table of ``present/outputs.py``. What shows them stands above all questions:
    the package sets ``public``, which gives its public functions ``text`` and ``html`` and loads them when something is
    shown.
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

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.headline()}>"

    def __str__(self) -> str:
        return str(Result.public("text")(self))

    def _repr_html_(self) -> str:
        return str(Result.public("html")(self))


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
        more = [field.replace(kind=Parameter.KEYWORD_ONLY) for field in fields.values()]
        asked.__signature__ = known.replace(parameters=[*known.parameters.values(), *more])  # type: ignore[attr-defined]
        return asked

    return named
