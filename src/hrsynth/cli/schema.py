"""JSON schema of each command, from the type of its result."""

from __future__ import annotations

import json as javascript
from inspect import signature
from typing import Any, get_args

import hrsynth

from .. import records
from ..options import NEEDED, Option
from ..present.outputs import File, get_outputs, load_function
from ..records import Head, OfRobot, answer_type, build_object_schema, read_summary
from .app import app
from .colour import print_text
from .commands import DeclaredCommand, Group, add_command

INTRODUCTION = """What every command prints with `--json`: one object. `hrsynth schema COMMAND` prints its JSON
schema, and this page shows all of them. They are generated from the result classes.

Lengths are metres and angles radians unless a name ends in another unit (`_mm`, `_deg`). `null` means absent or not
decided. Arrays over a grid are nested in the order of its `axes`.
"""
DIALECT = "https://json-schema.org/draft/2020-12/schema"


def build_schema(command: str) -> dict[str, Any]:
    """Return the schema of a command; raises ``KeyError`` for a command without JSON."""
    parts: dict[str, Any] = {}
    kind = list_json_commands()[command].record
    files: tuple[File, ...] = ()
    if kind is not None:
        heads = [build_object_schema([kind], parts)]
    else:
        kind, files = answer_type(getattr(hrsynth, command)), get_outputs(command).files
        of_robot = "robot" in signature(getattr(hrsynth, command)).parameters
        heads = [
            build_object_schema([OfRobot if of_robot else Head, item], parts) for item in get_args(kind) or (kind,)
        ]
    fields = {file.field: str | None for file in files if file.option is not None and file.field is not None}
    fields |= {
        file.record: answer_type(load_function(file.computed)) | None for file in files if file.record and file.computed
    }
    for item in heads:
        item["properties"] |= {name: records.build_type_schema(kind, parts) for name, kind in fields.items()}
        item["required"] = sorted([*item["required"], *fields])
    told = {"title": f"hrsynth {command} --json", "description": read_summary((get_args(kind) or (kind,))[0])}
    return {"$schema": DIALECT, **told, **(heads[0] if len(heads) == 1 else {"anyOf": heads}), "$defs": parts}


def list_json_commands() -> dict[str, DeclaredCommand]:
    """Return the commands that print JSON, by name."""
    every: list[Any] = [*app.commands.values()]
    leaves = [item for group in every for item in getattr(group, "commands", {"": group}).values()]
    return {item.name: item for item in leaves if any(option.name == "json" for option in item.options)}


def format_schema_page() -> str:
    """Return the page of all schemas, in Markdown."""
    blocks = ["# The JSON of every command", INTRODUCTION]
    for command in list_json_commands():
        lines = javascript.dumps(build_schema(command), ensure_ascii=False, indent=1).splitlines()
        inside = "\n".join(f"    {line}" for line in ("```json", *lines, "```"))
        blocks.append(f'??? abstract "{command}"\n\n{inside}')
    return "\n\n".join(blocks) + "\n"


def add(app: Group) -> None:
    """Register the command."""

    def told(command: list[str]) -> None:
        """Print a command's schema."""
        from ..errors import BadRequest

        name = " ".join(command)
        if name not in list_json_commands():
            what = (
                "command without JSON"
                if name in app.commands and not isinstance(app.commands[name], Group)
                else "unknown command"
            )
            raise BadRequest(what, name, tuple(list_json_commands()))
        print_text(javascript.dumps(build_schema(name), ensure_ascii=False, indent=2))

    add_command(
        app,
        "schema",
        "Print the JSON schema of a command's --json.",
        (
            Option(
                "command",
                "A command, such as derive or catalog list.",
                "COMMAND",
                list[str],
                NEEDED,
                argument=True,
                words=lambda: [item for item in list_json_commands() if " " not in item],
            ),
        ),
        told,
        ("derive", "catalog list"),
    )
