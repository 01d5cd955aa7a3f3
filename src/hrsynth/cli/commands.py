"""Commands made of their declared options; the help of each is written from them: in groups, with examples, whole."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from . import colour
from .options import NEEDED, OUTPUT, OWN, READING, WATCHING, Option, warn

HELP = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


class DeclaredCommand(TyperCommand):
    """A command whose help comes from its table of options."""

    options: Sequence[Option] = ()
    examples: Sequence[str] = ()

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the command line; what is called by an old name is told."""
        given = {each.partition("=")[0] for each in args}
        for option in self.options:
            for name in given.intersection(option.old):
                warn(f"{name} is called {option.names[0]} now; the old name goes with 0.4")
        return super().parse_args(ctx, args)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Usage, what it does, arguments, groups of options, examples."""
        arguments = [each for each in self.options if each.argument]
        needed = [each.shown.split(", ")[-1] for each in self.options if each.default is NEEDED and not each.argument]
        formatter.write_usage(ctx.command_path, " ".join([*(each.value for each in arguments), *needed, "[OPTIONS]"]))
        self.format_help_text(ctx, formatter)
        _section(formatter, "Arguments", [(each.value, each.told) for each in arguments])
        for group in (OWN, WATCHING, OUTPUT, READING):
            rows = [(each.shown, each.told) for each in self.options if each.group == group and not each.argument]
            _section(formatter, group, rows + [("-h, --help", "Show this message and exit.")] * (group == OUTPUT))
        if self.examples:
            with formatter.section(colour.heading("Examples")):
                for each in self.examples:
                    formatter.write(f"  {ctx.command_path} {each}\n")


class WholeGroup(TyperGroup):
    """A group of commands that says of each all that it does."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """A row a command."""
        _section(formatter, "Commands", [(name, each.help or "") for name, each in self.commands.items()])


def add_command(app: typer.Typer, name: str, help: str, declared: Sequence[Option], run: Callable[..., None],
                shown: Sequence[str] = ()) -> None:
    """Add a command: what must be given comes first, ``run`` is called with all by name; the examples that are
    ``shown`` follow the command's own name in its help."""
    parameters = sorted((each.parameter() for each in declared), key=lambda each: each.default is not NEEDED)

    def called(**values: Any) -> None:
        run(**values)

    called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    called.__annotations__ = {each.name: each.annotation for each in parameters}
    kind = type("Command", (DeclaredCommand,), {"options": declared, "examples": shown})
    app.command(name, help=help, cls=kind)(called)


def _section(formatter: Any, title: str, rows: Sequence[tuple[str, str]]) -> None:
    if rows:
        with formatter.section(colour.heading(title)):
            formatter.write_dl(rows)
