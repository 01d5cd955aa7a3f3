"""The command lint: findings in the format that is asked for, and an exit status for continuous integration."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..options import NEEDED, OUTPUT, Option, flag, output
from .colour import paint, say
from .commands import Group, add_command
from .options import JSON, SOURCE, shipped_names
from .progress import Progress

FORMATS = ("text", "github", "sarif", "json")
FAILING = ("error", "warning", "note", "nothing")


def rules() -> Iterable[str]:
    """The names of the rules."""
    from ..linting.rules import lint_rules

    return lint_rules()


def programs() -> Iterable[str]:
    """The names of the programs whose reading is known."""
    from ..linting.rules.readers import PROGRAMS

    return PROGRAMS


def lint(
    files: list[str],
    format: str,
    fail_on: str,
    json: bool,
    program: list[str] | None,
    ignore: list[str] | None,
    **given: Any,
) -> None:
    """Print what is found; exit status 1 where it is bad enough."""
    import hrsynth

    from ..errors import BadRequest, BadRobotFile
    from ..present.show import record
    from ..present.text import lint as shown

    for name, value, known in (("--format", format, FORMATS), ("--fail-on", fail_on, FAILING)):
        if value not in known:
            raise BadRequest(name, value, known)
    if json and format not in ("text", "json"):
        raise BadRequest("--json together with --format", format, "one of them")
    with Progress():
        given["close"] = given["close"] or ()
        found = hrsynth.lint(files, program=program or (), ignore=ignore or (), **given)
    if json or format == "json":
        say(record("lint", None, found.to_dict()))
    elif format == "text":
        say(hrsynth.text(found), paint=paint)
    else:
        say(shown.github(found) if format == "github" else shown.sarif(found))
    if found.unread:
        for defect in found.unread:
            say(f"hrsynth: {defect}", err=True)
        raise SystemExit(BadRobotFile.exit_status)
    if fail_on != "nothing" and found.reaches(fail_on):
        raise SystemExit(1)


def add(app: Group) -> None:
    """Make it a command."""
    add_command(
        app,
        "lint",
        "What is wrong, doubtful or lost in robot files, by named rules, and how to mend it.",
        (
            Option(
                "files",
                "Robot files in any dialect, or names of shipped robots.",
                "FILES",
                list[str],
                NEEDED,
                argument=True,
                words=shipped_names,
            ),
            flag("fix", "Mend what can be mended in one way only, and overwrite the file or write to --output."),
            Option("compare", "Another file of the same robot: where the two differ.", "OTHER"),
            Option(
                "program",
                "A program that should read the file (mujoco, gazebo …): a closure that it loses is "
                "an error; repeat for more.",
                "NAME",
                list[str],
                words=programs,
            ),
            Option("ignore", "A rule to leave out; repeat for more.", "RULE", list[str], words=rules),
            Option(
                "fail_on",
                "The mildest severity that makes the exit status 1: error, warning, note, nothing.",
                "SEVERITY",
                default="error",
                words=FAILING,
            ),
            Option(
                "format",
                "text, github (annotations), sarif (2.1.0) or json.",
                default="text",
                words=FORMATS,
                group=OUTPUT,
            ),
            output("Where to write the mended file, with --fix and a single file."),
            JSON,
            *SOURCE[1:],
        ),
        lint,
        (
            "robot.urdf",
            "robot.urdf --fix -o mended.urdf",
            "robot.urdf --compare robot.xml",
            "a.urdf b.xml --program mujoco --format github --fail-on warning",
        ),
    )
