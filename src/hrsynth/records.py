"""Fields of results, described once beside their values: JSON, JSON schema, reference and table rows follow.

A member of a record is

* a field of a dataclass that is :data:`Recorded` or annotated with more than its type:
  ``Annotated[float, As("time_s"), "end time"]``. After the type, a text is the description,
  :class:`As` the form in JSON, and anything else the type in JSON if it differs:
  ``Annotated[Array, list[float], "low ends (m, rad)"]``;
* a property under :func:`recorded`;
* :class:`Shown`, a value of the record alone.

All members of named tuples and typed dictionaries are recorded.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from math import degrees, isfinite
from pathlib import PurePath
from types import NoneType, SimpleNamespace, UnionType
from typing import (
    Annotated,
    Any,
    ClassVar,
    Literal,
    NotRequired,
    TypedDict,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
    is_typeddict,
)

Json = Any
Number = float | None
"""Number, null if it is undefined or infinite."""
Table = list[Any]
"""Array over a grid, nested in the order of its axes."""
SIMPLE: dict[Any, str] = {str: "string", int: "integer", float: "number", bool: "boolean", NoneType: "null"}
ANGLE = "the largest principal angle between two velocity relations (rad)"
GAP = "the smallest ratio of a singular value that counts to one that does not"
BEYOND_LIMITS = "true where joints are beyond their limits"
"""Descriptions of numbers in several records."""
Word = Literal["controllable", "partially controllable", "uncontrollable", "nothing to control", "rigid", "flexible"]
"""Verdicts on the observations of a robot, or of a formation."""
MM, DEG = 1e3, degrees(1.0)
"""Scales to millimetres and degrees."""
F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T")
Recorded = Annotated[T, ""]
"""Field with the name and type of the attribute, without a description."""


@dataclass(frozen=True)
class As:
    """Form of a member in JSON: its ``name``, multiplied by ``scale``, rounded to ``digits``; ``flat``: replaced by its
    own members except ``without``; ``optional``: omitted if it is None; ``scaled``: multiplied by the scale of the
    member that contains its record."""

    name: str | None = None
    scale: float | None = None
    digits: int | None = None
    flat: bool = False
    without: tuple[str, ...] = ()
    optional: bool = False
    scaled: bool = False


FLAT, OPTIONAL, SCALED = As(flat=True), As(optional=True), As(scaled=True)


@dataclass(frozen=True)
class Member:
    """Member of a record: source of its value, type and form in JSON, description."""

    name: str
    attribute: str
    kind: Any
    how: As
    words: str = ""


class Record:
    """Base of classes with JSON; with ``all_recorded`` all fields of the dataclass are members."""

    all_recorded: ClassVar = False

    def __init_subclass__(cls, all_recorded: bool = False, **more: Any) -> None:
        super().__init_subclass__(**more)
        cls.all_recorded = all_recorded

    def to_dict(self) -> Json:
        """Return the members by name for JSON; null if not finite."""
        return _collect_members(self)

    def to_row(self) -> dict[str, Any]:
        """Return the members in one level, for a table row (``pandas.DataFrame([found.to_row(), ...])``); nested names
        are joined by dots."""
        return dict(_expand_fields(self.to_dict()))


class Shown:
    """Value of a record alone: its type in JSON, the function that computes it, and annotations."""

    def __init__(self, kind: Any, get: Callable[[Any], Any], *extras: Any) -> None:
        self.kind, self.get, self.extras = kind, get, extras

    def __get__(self, instance: Any, owner: type | None = None) -> Any:
        return self if instance is None else self.get(instance)


def recorded(*extras: Any) -> Callable[[F], F]:
    """Make a property a member of the record: below ``@property``, with annotations as arguments."""

    def marked(function: F) -> F:
        function.recorded = extras  # type: ignore[attr-defined]
        return function

    return marked


class Head(TypedDict):
    """First fields of every JSON object of the command line."""

    command: str
    version: str


class Platform(TypedDict):
    """The platform link (null if open; of a formation its first body), the origin of the choice, and the reason."""

    link: str | None
    chosen: Literal["file", "option", "assumption", "open"]
    reason: str


class OfRobot(Head):
    """First fields of a result on a robot, with the notes of reading its file, if any."""

    robot: str
    platform: Platform
    notes: NotRequired[list[str]]


def _collect_members(value: Any, scale: float | None = None) -> dict[str, Any]:
    """Return the members of a record or a named tuple."""
    found: dict[str, Any] = {}
    for member in list_members(type(value)):  # type: ignore[arg-type]
        how = replace(member.how, scale=scale) if member.how.scaled else member.how
        part = convert_to_json(getattr(value, member.attribute), how)
        if member.how.flat:
            found |= {name: each for name, each in (part or {}).items() if name not in member.how.without}
        elif part is not None or not member.how.optional:
            found[member.name] = part
    return found


def convert_to_json(value: Any, how: As = As()) -> Any:
    """Convert a value for JSON."""
    if value is None or isinstance(value, bool | str):
        return value
    if hasattr(value, "to_dict"):
        return value.to_dict() if how.scale is None else _collect_members(value, how.scale)
    if isinstance(value, Mapping):
        return {name: convert_to_json(each, how) for name, each in value.items()}
    if hasattr(value, "_fields"):
        return _collect_members(value)
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, float):
        value = value if how.scale is None else how.scale * value
        value = value if how.digits is None else round(value, how.digits) + 0.0
        return value if isfinite(value) else None
    if isinstance(value, tuple | list):
        return [convert_to_json(each, how) for each in value]
    return str(value) if isinstance(value, PurePath) else value


def _expand_fields(fields: Mapping[str, Any], at: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in fields.items():
        if isinstance(value, Mapping):
            yield from _expand_fields(value, f"{at}{name}.")
        else:
            yield f"{at}{name}", value


@cache
def list_members(kind: type) -> tuple[Member, ...]:
    """Return the members of a class of records, those of its bases first."""
    if is_typeddict(kind):
        hints = get_type_hints(kind, include_extras=True)
        every = [_build_member(name, hint) for name, hint in hints.items()]
        return tuple(each if kind.__total__ else replace(each, how=OPTIONAL) for each in every)  # type: ignore[attr-defined]
    found: dict[str, Member] = {}
    for base in reversed(kind.__mro__):
        known = vars(base).get("__annotations__", {})
        named = issubclass(base, tuple) or vars(base).get("all_recorded", False)
        told = {
            name: hint for name, hint in known.items() if named or str(hint).startswith(("Annotated[", "Recorded["))
        }
        found |= {name: _build_member(name, hint) for name, hint in resolve_hints(told, base.__module__).items()}
        for name, value in vars(base).items():
            if isinstance(value, Shown):
                found[name] = _build_member(name, Annotated[(value.kind, "", *value.extras)])
                continue
            function: Any = getattr(value, "fget", getattr(value, "func", None))
            if isinstance(value, property | cached_property) and hasattr(function, "recorded"):
                hint = get_type_hints(function, include_extras=True)["return"]
                found[name] = _build_member(name, Annotated[(hint, "", *function.recorded)], function.__doc__ or "")
    return tuple(found.values())


def _build_member(attribute: str, hint: Any, doc: str = "") -> Member:
    """Read a member from an annotation."""
    how = OPTIONAL if get_origin(hint) is NotRequired else As()
    if get_origin(hint) is NotRequired:
        (hint,) = get_args(hint)
    kind, *extras = get_args(hint) if get_origin(hint) is Annotated else (hint,)
    words = " ".join(doc.partition("\n\n")[0].split())
    for each in extras:
        if isinstance(each, As):
            how = each
        elif isinstance(each, str):
            words = each or words
        else:
            kind = each
    return Member(how.name or attribute, attribute, kind, how, words)


def build_type_schema(kind: Any, parts: dict[str, Any]) -> dict[str, Any]:
    """Return the JSON schema of a type; add the classes it contains to ``parts``."""
    if kind is Any:
        return {}
    if kind in SIMPLE:
        return {"type": SIMPLE[kind]}
    origin, values = get_origin(kind), get_args(kind)
    if origin is Annotated:
        member = _build_member("", kind)
        return {**build_type_schema(member.kind, parts), "description": member.words}
    if origin is Literal:
        return {"enum": list(values)}
    if origin in (Union, UnionType):
        return {"anyOf": [build_type_schema(each, parts) for each in values]}
    if origin in (list, tuple, Sequence):
        return {"type": "array", "items": build_type_schema(values[0], parts)}
    if origin in (dict, Mapping):
        return {"type": "object", "additionalProperties": build_type_schema(values[1], parts)}
    if find_recorded_type(kind) is not kind:
        return build_type_schema(find_recorded_type(kind), parts)
    if kind.__name__ not in parts:
        parts[kind.__name__] = {}
        parts[kind.__name__] = {"description": read_summary(kind), **build_object_schema([kind], parts)}
    return {"$ref": f"#/$defs/{kind.__name__}"}


def build_object_schema(kinds: Sequence[Any], parts: dict[str, Any]) -> dict[str, Any]:
    """Return the JSON schema of an object with the members of several classes."""
    properties: dict[str, Any] = {}
    required: set[str] = set()
    for kind in kinds:
        for member in list_members(find_recorded_type(kind)):
            if not member.how.flat:
                told = {"description": member.words} if member.words else {}
                properties[member.name] = {**build_type_schema(member.kind, parts), **told}
                required |= set() if member.how.optional else {member.name}
                continue
            several = [each for each in get_args(member.kind) or (member.kind,) if each is not NoneType]
            inner = build_object_schema(several, parts)
            properties |= {name: each for name, each in inner["properties"].items() if name not in member.how.without}
            required |= set() if NoneType in get_args(member.kind) else {*inner["required"]} - {*member.how.without}
    return {"type": "object", "properties": properties, "required": sorted(required), "additionalProperties": False}


def read_summary(kind: type) -> str:
    """Return the first clause of a class's docstring, before its fields."""
    return re.split(r"\.(?:\s|$)|[;:,] ``", " ".join((kind.__doc__ or "").split()), maxsplit=1)[0] + "."


def answer_type(function: Callable[..., Any]) -> Any:
    """Return the class of a function's result, from its annotation."""
    return vars(sys.modules[function.__module__])[function.__annotations__["return"]]


def resolve_hints(annotations: Mapping[str, Any], module: str) -> dict[str, Any]:
    """Resolve annotations of a module's class or function; others may name imports for type checkers alone."""
    return get_type_hints(SimpleNamespace(__annotations__=annotations), vars(sys.modules[module]), include_extras=True)


def find_recorded_type(kind: Any) -> Any:
    """Return the class whose members are recorded: the class itself, or the return type of its own ``to_dict``."""
    own = getattr(kind, "to_dict", Record.to_dict)
    return kind if own is Record.to_dict else get_type_hints(own)["return"]
