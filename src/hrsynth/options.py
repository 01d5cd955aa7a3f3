"""Options as data, each declared once.

Options of a public function are declared in its annotations (:func:`option`); name, kind and default are those of the
parameter. The command line, its help and completion, and the checks in Python follow from them.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from inspect import Parameter, Signature, signature
from types import NoneType
from typing import Annotated, Any, get_args, get_origin

from .errors import BadRequest
from .records import resolve_hints

NEEDED: Any = ...
"""Default of a required option."""
OWN, OBSERVATION, OUTPUT, OVERRIDES = "Options", "Observation", "Output", "File overrides"
"""Groups of options, in the order of the help."""


@dataclass(frozen=True)
class Option:
    """Option or (``argument``) positional argument of the command line; ``flags``: its names, by default from
    ``name``; ``words``: its possible values, if known."""

    name: str
    help: str | Callable[[], str]
    metavar: str | None = None
    kind: Any = str
    default: Any = None
    flags: tuple[str, ...] = ()
    low: float | None = None
    high: float | None = None
    argument: bool = False
    group: str = OWN
    words: Callable[[], Iterable[str]] | tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names on the command line: none of an argument, ``--open/--no-open`` of a flag with a negation."""
        return () if self.argument else self.flags or (f"--{self.name.replace('_', '-')}",)

    @property
    def value(self) -> str:
        """Placeholder of the value in the help."""
        return self.metavar or {int: "COUNT", float: "NUMBER"}.get(self.kind, self.name.upper())

    @property
    def shown(self) -> str:
        """Names and placeholder in the help."""
        names = ", ".join(self.names).replace("/", " / ")
        return f"{names} {'' if self.kind is bool else self.value}".strip()

    @property
    def told(self) -> str:
        """Text in the help, with default and range."""
        given = not isinstance(self.default, bool) and self.default not in (NEEDED, None, "")
        facts = [f"default: {self.default}"] if given else ["required"] if self.default is NEEDED else []
        facts += [] if self.low is None else [f"at least {self.low}"]
        facts += [] if self.high is None else [f"at most {self.high}"]
        help = self.help() if callable(self.help) else self.help
        return f"{help}  [{'; '.join(facts)}]" if facts else help

    @property
    def is_repeatable(self) -> bool:
        """True if it can be given more than once."""
        return self.kind == list[str]

    @property
    def has_several_names(self) -> bool:
        """True if one value is a list of names; repeating the option is then an error."""
        return self.metavar in ("LEGS", "LINKS", "JOINTS")

    def typed(self, value: Any) -> list[str]:
        """Return the words of the command line for a value; none for the default or an empty value."""
        if value in (None, "", (), [], self.default):
            return []
        if self.kind is bool:
            return [self.names[0].partition("/")[0]] if value else []
        each = value if self.is_repeatable and not isinstance(value, str) else [value]
        return [word for part in each for word in (self.names[0], format_typed(part))]

    def read(self, text: str) -> Any:
        """Convert the text of a value; raises ``BadRequest``."""
        if self.kind not in (int, float):
            return text
        try:
            number = parse_plain_number(text, self.kind)
            if is_in_range(number, self.low, self.high):
                return number
        except ValueError:
            pass
        name = self.names[0] if self.names else self.value
        word = "an integer" if self.kind is int else "a number"
        raise BadRequest(name, text, ", ".join([word, *describe_range(self.low, self.high)])) from None


def flag(name: str, help: str, group: str = OWN) -> Option:
    """Make an option without a value."""
    return Option(name, help, kind=bool, default=False, group=group)


def output(help: str, metavar: str = "FILE", default: Any = None) -> Option:
    """Make the option ``-o``."""
    return Option("output", help, metavar, default=default, flags=("-o", "--output"), group=OUTPUT)


def format_typed(value: Any) -> str:
    """Return the text of a value; several names are joined by commas."""
    return ",".join(map(str, value)) if isinstance(value, tuple | list) else str(value)


def option(help: str, metavar: str | None = None, **more: Any) -> Option:
    """Make the option of the parameter that it annotates."""
    return Option("", help, metavar, **more)


def list_options(function: Callable[..., Any]) -> Iterator[Option]:
    """Yield the options of a function's parameters, or of a dataclass's fields, in order."""
    place = vars(sys.modules[function.__module__])
    for name, parameter in signature(function).parameters.items():
        hint, *extras = _split_annotation(parameter.annotation, place)
        for each in [each for each in extras if isinstance(each, Option)][-1:]:
            default = NEEDED if parameter.default is Parameter.empty else parameter.default
            kind = _choose_kind(hint) if each.kind is str else each.kind
            yield replace(each, name=name, kind=kind, default=None if default == () else default)


def list_parameter_types(function: Callable[..., Any]) -> dict[str, list[str]]:
    """Return the types of a function's parameters by name: ``["int", "None"]``."""
    place = vars(sys.modules[function.__module__])
    found = {}
    for name, parameter in signature(function).parameters.items():
        hint, *_ = _split_annotation(parameter.annotation, place)
        parts = hint.split(" | ") if isinstance(hint, str) else get_args(hint) or (hint,)
        found[name] = ["None" if each is NoneType else getattr(each, "__name__", str(each)) for each in parts]
    return found


def strip_annotations(function: Callable[..., Any]) -> Signature:
    """Return a function's signature without annotations beyond types."""
    known = signature(function)
    plain = [
        each.replace(annotation=str(each.annotation).removeprefix("Annotated[").partition(", option(")[0])
        if str(each.annotation).startswith("Annotated[")
        else each
        for each in known.parameters.values()
    ]
    return known.replace(parameters=plain)


def _split_annotation(annotation: Any, place: dict[str, Any]) -> tuple[Any, ...]:
    """Return a type and its annotations; plain types are not resolved."""
    if isinstance(annotation, str):
        if not annotation.startswith("Annotated[") and get_origin(place.get(annotation)) is not Annotated:
            return (annotation,)
        annotation = resolve_hints({"it": annotation}, place["__name__"])["it"]
    return get_args(annotation) if get_origin(annotation) is Annotated else (annotation,)


def _choose_kind(hint: Any) -> Any:
    """Return the kind of an option: number or flag, perhaps with None, otherwise text."""
    kinds = {each for each in get_args(hint) or (hint,) if each is not NoneType}
    return kinds.pop() if kinds in ({bool}, {int}, {float}) else str


def describe_range(low: float | None, high: float | None) -> list[str]:
    """Return a range in words."""
    return [f"at {end} {value:g}" for end, value in (("least", low), ("most", high)) if value is not None]


def is_in_range(value: float, low: float | None, high: float | None) -> bool:
    """Return True if a number is in a range; NaN is in no bounded range."""
    return (low is None or value >= low) and (high is None or value <= high)


def require_range(name: str, value: float, word: str, low: float | None, high: float | None = None) -> None:
    """Raise ``BadRequest`` for a value outside of a range."""
    if not is_in_range(value, low, high):
        raise BadRequest(name, value, ", ".join([word, *describe_range(low, high)]))


def parse_plain_number(text: str, kind: type = float) -> Any:
    """Convert a number in ASCII digits without underscores; raises ``ValueError``."""
    if not text.isascii() or "_" in text:
        raise ValueError(text)
    return kind(text)
