"""Commands from declared options: parsing of the command line, and the help."""

from __future__ import annotations

import shutil
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import takewhile
from typing import Any

from ..errors import BadRequest
from ..options import NEEDED, OBSERVATION, OUTPUT, OVERRIDES, OWN, Option
from .colour import paint_help, print_text

HELP = ("-h", "--help")
HELP_ROW = (", ".join(HELP), "Show this message and exit.")
POSES = ("--at", "--goal")
"""Options of the pose of a command: the robot's pose, or the goal of runs and paths."""
OPTION_SIMILARITY_MIN = 0.7
"""Least similarity of a misspelt option."""


@dataclass(frozen=True, eq=False)
class DeclaredCommand:
    """Command: help, options, the function that is called with all of them by name, and examples without its name."""

    path: str
    help: str
    options: Sequence[Option]
    run: Callable[..., None]
    examples: Sequence[str] = ()
    record: Any = None
    """Type of its JSON, unless it is the result of the public function of its name."""

    @property
    def name(self) -> str:
        """Name after ``hrsynth``."""
        return self.path.partition(" ")[2]

    def main(self, words: Sequence[str], beside: Sequence[DeclaredCommand] = ()) -> None:
        """Run the command on the words after its name, or show its help; ``beside``: the other commands."""
        values = self.values(words, beside)
        if values is None:
            print_text(self.help_text(), paint=paint_help)
        else:
            self.run(**values)

    def values(self, words: Sequence[str], beside: Sequence[DeclaredCommand] = ()) -> dict[str, Any] | None:
        """Return the value of each option by its name, None if help is requested. Raises ``BadRequest``.

        Options stand anywhere before ``--``, as ``--name VALUE``, ``--name=VALUE``, ``-n VALUE``, ``-n=VALUE`` or
        ``-nVALUE``.
        """
        from argparse import SUPPRESS, ArgumentError, ArgumentParser

        flags = {
            name: (each, told)
            for each in self.options
            for names in each.names
            for name, told in zip(names.split("/"), (True, False), strict=False)
        }
        parser = ArgumentParser(add_help=False, allow_abbrev=False, exit_on_error=False, argument_default=SUPPRESS)
        for name, (option, told) in flags.items():
            how: dict[str, Any] = {"action": "append_const", "const": told} if option.kind is bool else {}
            parser.add_argument(name, dest=option.name, **{"action": "append", **how})
        # argparse takes a value that begins with a dash only behind "="
        rest, joined = iter(words), list[str]()
        for word in takewhile("--".__ne__, rest):
            value = next(rest, None) if word in flags and flags[word][0].kind is not bool else None
            if value in flags:
                raise BadRequest(f"{word}: no value", remedy=f"Give {flags[word][0].value}, or write {word}={value}.")
            joined.append(word if value is None else f"{word}={value}")
        if set(HELP) & set(joined):
            return None
        try:
            found, plain = parser.parse_known_args(joined)
        except ArgumentError as error:
            option, _ = flags[str(error.argument_name)]
            allowed = None if option.kind is bool else option.value
            raise BadRequest(f"{error.argument_name}: {error.message}", None, allowed) from None
        for name in (word.partition("=")[0] for word in plain if word.startswith("-") and word != "-"):
            from difflib import get_close_matches

            if name in POSES and (own := [each for each in flags if each in POSES]):
                usual = flags[own[-1]][0].names[0]
                raise BadRequest(f"{self.name} has no option {name}", remedy=f"Use {usual} for the pose.")
            if takers := [each.name for each in beside if any(name in option.names for option in each.options)]:
                raise BadRequest(f"{self.name} has no option {name}", remedy=f"Omit it, or use {', '.join(takers)}.")
            close = get_close_matches(name, flags, cutoff=OPTION_SIMILARITY_MIN) or sorted(flags)
            raise BadRequest(f"{self.name} has no option {name}", remedy=f"Try {', '.join(close)}.")
        given: dict[str, list[Any]] = vars(found)
        plain += rest
        for option in self.options:
            if option.argument and plain:
                count = len(plain) if option.is_repeatable else 1
                given[option.name], plain = plain[:count], plain[count:]
        # Python 3.11 and 3.12 make [] of the value "--"
        for option in self.options:
            if option.has_several_names and len(texts := given.get(option.name, ())) > 1:
                raise BadRequest(f"{option.names[0]}: repeated", remedy=f"Write {option.names[0]} {','.join(texts)}.")
        read = {
            each: [each.read("--" if value == [] else value) for value in given[each.name]]
            for each in self.options
            if each.name in given
        }
        if plain:
            raise BadRequest(f"{' '.join(plain)}: unexpected argument", remedy=f"See {self.path} -h.")
        missing = [each.shown for each in self.options if each.default is NEEDED and each not in read]
        if missing:
            raise BadRequest(f"{self.name}: {' and '.join(missing)} missing", remedy=f"See {self.path} -h.")
        return {
            each.name: each.default if each not in read else read[each] if each.is_repeatable else read[each][-1]
            for each in self.options
        }

    def help_text(self) -> str:
        """Return the help: usage, summary, arguments, groups of options, examples."""
        arguments = [each for each in self.options if each.argument]
        needed = [each.shown.split(", ")[-1] for each in self.options if each.default is NEEDED and not each.argument]
        parts = [
            *_format_head(self.path, [*(each.value for each in arguments), *needed, "[OPTIONS]"], self.help),
            *_format_section("Arguments", [(each.value, each.told) for each in arguments]),
        ]
        for group in (OWN, OBSERVATION, OUTPUT, OVERRIDES):
            rows = [(each.shown, each.told) for each in self.options if each.group == group and not each.argument]
            parts += _format_section(group, rows + [HELP_ROW] * (group == OUTPUT))
        return "\n\n".join([*parts, *_format_examples(self.path, self.examples)])


@dataclass(frozen=True, eq=False)
class Group:
    """Group of commands under one name; ``version`` is printed by ``--version``."""

    path: str
    help: str
    version: Callable[[], str] | None = None
    commands: dict[str, DeclaredCommand | Group] = field(default_factory=dict)
    examples: Sequence[str] = ()

    def main(self, words: Sequence[str]) -> None:
        """Run the command named by the first word; without one show the help."""
        name, *rest = words or HELP
        if name in HELP:
            print_text(self.help_text(), paint=paint_help)
        elif name == "--version" and self.version is not None:
            print_text(f"{self.path} {self.version()}")
        elif name.startswith("-"):
            raise BadRequest("unknown option", name, [*HELP, *["--version"] * (self.version is not None)])
        elif name not in self.commands:
            raise BadRequest("unknown command", name, tuple(self.commands))
        else:
            found = self.commands[name]
            if isinstance(found, Group):
                found.main(rest)
            else:
                found.main(rest, [each for each in self.commands.values() if isinstance(each, DeclaredCommand)])

    def help_text(self) -> str:
        """Return the help: a row per command."""
        version = [] if self.version is None else [("--version", "Print the version.")]
        return "\n\n".join(
            [
                *_format_head(self.path, ["[OPTIONS]", "COMMAND", "[ARGS]..."], self.help),
                *_format_section("Options", [*version, HELP_ROW]),
                *_format_section("Commands", [(name, each.help) for name, each in self.commands.items()]),
                *_format_examples(self.path, self.examples),
            ]
        )


def add_command(
    group: Group,
    name: str,
    help: str,
    options: Sequence[Option],
    run: Callable[..., None],
    examples: Sequence[str] = (),
    record: Any = None,
) -> None:
    """Add a command with its examples."""
    group.commands[name] = DeclaredCommand(f"{group.path} {name}", help, options, run, examples, record)


def _format_examples(path: str, examples: Sequence[str]) -> list[str]:
    """Return the section of examples, empty without examples."""
    return ["\n".join(["Examples:", *(f"  {path} {each}" for each in examples)])] if examples else []


def _measure_width() -> int:
    """Return the width of a help in columns."""
    return max(min(shutil.get_terminal_size().columns, 100) - 2, 50)


def _fill_lines(text: str, width: int, first: str, more: str) -> str:
    return textwrap.fill(
        text, width, initial_indent=first, subsequent_indent=more, break_on_hyphens=False, break_long_words=False
    )


def _format_head(path: str, words: Sequence[str], help: str) -> tuple[str, str]:
    usage = f"Usage: {path} "
    return _fill_lines(" ".join(words), _measure_width(), usage, " " * len(usage)), _fill_lines(
        help, _measure_width(), "  ", "  "
    )


def _format_section(title: str, rows: Sequence[tuple[str, str]]) -> list[str]:
    """Return a title with its aligned rows, empty without rows."""
    if not rows:
        return []
    column = min(max(len(name) for name, _ in rows), 30) + 2
    lines = [f"{title}:"]
    for name, told in rows:
        first, apart = f"  {name:{column}}", " " * (column + 2)
        if len(name) > column - 2:
            lines.append(f"  {name}")
            first = apart
        lines.append(_fill_lines(told, _measure_width(), first, apart).rstrip())
    return ["\n".join(lines)]
