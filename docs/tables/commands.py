"""The page of all commands, made while the site is built: the help that each command prints."""

from __future__ import annotations

import os
from collections.abc import Iterator
from unittest import mock

from hrsynth.cli import app
from hrsynth.cli.commands import DeclaredCommand, Group

WIDTH = 102
"""Columns of the terminal for which the help is written."""
INTRODUCTION = """\
The help of every command, as `hrsynth COMMAND -h` prints it. Each command that takes a robot has a Python function of
the same name, with the same options ([Python](reference/index.md)). `--json` prints a record ([JSON](json.md)).
[Errors](errors.md) lists the exit statuses. [Poses and units](units.md) describes how a pose is written."""


def build_page() -> str:
    """Return the page in Markdown."""
    with mock.patch.dict(os.environ, {"COLUMNS": str(WIDTH)}):
        parts = [f"# Commands\n\n{INTRODUCTION}"]
        for entry in walk(app):
            title = entry.path.partition(" ")[2] or entry.path
            parts.append(f"## {title}\n\n```text\n{entry.help_text()}\n```")
    return "\n\n".join(parts) + "\n"


def walk(entry: DeclaredCommand | Group) -> Iterator[DeclaredCommand | Group]:
    """Yield a group, then its commands, those of inner groups included."""
    yield entry
    if isinstance(entry, Group):
        for inner in entry.commands.values():
            yield from walk(inner)
