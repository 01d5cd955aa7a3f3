"""The JSON schema of each command's record, made from its type in ``records.py``."""

from __future__ import annotations

import json as javascript
import sys
from typing import Any, Literal, TypedDict, is_typeddict

import hrsynth

from .. import records
from ..present.outputs import OUTPUTS
from ..records import object_schema
from .colour import say
from .commands import Group, add_command
from .options import NEEDED, Option

DIALECT = "https://json-schema.org/draft/2020-12/schema"


class Head(TypedDict):
    """The fields with which every object begins."""

    command: str
    version: str


class Platform(TypedDict):
    """The link that is the platform (the first body of a formation); what chose it, and why."""

    link: str
    chosen: Literal["file", "option", "guess"]
    reason: str


class OfRobot(Head):
    """The fields with which an answer about a robot begins."""

    robot: str
    platform: Platform


def schema(command: str) -> dict[str, Any]:
    """The schema of a command's record; raises ``KeyError`` for a command that has none."""
    from .records import RECORDS

    parts: dict[str, Any] = {}
    kind = RECORDS.get(command)
    if is_typeddict(kind):
        head, words = object_schema([kind], parts), kind.__doc__
    else:
        function = getattr(hrsynth, command)
        kind = vars(sys.modules[function.__module__])[function.__annotations__["return"]]
        begins = OfRobot if "robot" in function.__annotations__ else Head
        head, words = object_schema([begins, kind], parts), kind.__doc__
        for file in OUTPUTS[command].files:
            if file.option is not None and file.field is not None:
                head["properties"][file.field] = records.schema(str | None, parts)
                head["required"] = sorted([*head["required"], file.field])
    told = {"title": f"hrsynth {command} --json", "description": " ".join((words or "").split())}
    return {"$schema": DIALECT, **told, **head, "$defs": parts}


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
