"""The JSON schema of each command's record, made from its type in ``records.py``."""

from __future__ import annotations

import json as javascript
import sys
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NotRequired, Union, get_args, get_origin, get_type_hints, is_typeddict

from .colour import say
from .commands import Group, add_command
from .options import NEEDED, Option

DIALECT = "https://json-schema.org/draft/2020-12/schema"
SIMPLE: dict[Any, str] = {str: "string", int: "integer", float: "number", bool: "boolean", NoneType: "null"}


def schema(command: str) -> dict[str, Any]:
    """The schema of a command's record; raises ``KeyError`` for a command that has none."""
    from .records import RECORDS

    parts: dict[str, Any] = {}
    head = _of(RECORDS[command], parts)
    return {"$schema": DIALECT, "title": f"hrsynth {command} --json", **head, "$defs": parts}


def _of(kind: Any, parts: dict[str, Any]) -> dict[str, Any]:
    """The schema of a type; what it is made of is added to ``parts``."""
    values = get_args(kind)
    if kind is Any:
        return {}
    if kind in SIMPLE:
        return {"type": SIMPLE[kind]}
    if is_typeddict(kind):
        if kind.__name__ not in parts:
            parts[kind.__name__] = {}
            fields = get_type_hints(kind, include_extras=True)
            parts[kind.__name__] = {
                "description": " ".join((kind.__doc__ or "").split()),
                "type": "object",
                "properties": {name: _of(each, parts) for name, each in fields.items()},
                "required": sorted(
                    name for name, each in fields.items() if kind.__total__ and get_origin(each) is not NotRequired
                ),
                "additionalProperties": False,
            }
        return {"$ref": f"#/$defs/{kind.__name__}"}
    origin = get_origin(kind)
    if origin is Annotated:
        return {**_of(values[0], parts), "description": values[1]}
    if origin is Literal:
        return {"enum": list(values)}
    if origin in (Union, UnionType):
        return {"anyOf": [_of(each, parts) for each in values]}
    if origin is list:
        return {"type": "array", "items": _of(values[0], parts)}
    if origin is dict:
        return {"type": "object", "additionalProperties": _of(values[1], parts)}
    return _of(values[0], parts)  # NotRequired


def _commands() -> list[str]:
    from .records import RECORDS

    return [command for command in RECORDS if " " not in command]


def page() -> str:
    """The page of all schemas, in Markdown."""
    from .records import RECORDS

    blocks = ["# The JSON of every command", sys.modules[RECORDS["check"].__module__].__doc__ or ""]
    for command in RECORDS:
        lines = javascript.dumps(schema(command), ensure_ascii=False, indent=1).splitlines()
        inside = "\n".join(f"    {line}" for line in ("```json", *lines, "```"))
        blocks.append(f'??? abstract "{command}"\n\n{inside}')
    return "\n\n".join(blocks) + "\n"


def add(app: Group) -> None:
    """Make it a command."""

    def told(command: list[str]) -> None:
        """Print a command's schema."""
        from ..errors import BadRequest
        from .records import RECORDS

        name = " ".join(command)
        if name not in RECORDS:
            what = (
                "this command prints no JSON"
                if name in app.commands and not isinstance(app.commands[name], Group)
                else "no record of the command"
            )
            raise BadRequest(what, name, tuple(RECORDS))
        say(javascript.dumps(schema(name), ensure_ascii=False, indent=2))

    add_command(
        app,
        "schema",
        "The JSON schema of what a command prints with --json.",
        (
            Option(
                "command",
                "A command, such as derive or catalog list.",
                "COMMAND",
                list[str],
                NEEDED,
                argument=True,
                words=_commands,
            ),
        ),
        told,
        ("derive", "catalog list"),
    )
