"""Command lint: findings in the chosen format, and an exit status for continuous integration."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..options import NEEDED, OUTPUT, Option, flag, output
from .colour import paint, print_text
from .commands import Group, add_command
from .options import JSON, SOURCE, list_shipped_names
from .progress import Progress

FORMATS = ("text", "github", "sarif", "json")
FAILING = ("error", "warning", "note", "nothing")


def list_rule_names() -> Iterable[str]:
    """Return the names of the rules."""
    from ..linting.rules import lint_rules

    return lint_rules()


def list_program_names() -> Iterable[str]:
    """Return the names of the programs whose readers are known."""
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
    """Print the findings; exit status 1 if they reach the severity."""
    import hrsynth

    from ..errors import BadRequest, BadRobotFile
    from ..present.show import format_record
    from ..present.text import lint as shown

    for name, value, known in (("--format", format, FORMATS), ("--fail-on", fail_on, FAILING)):
        if value not in known:
            raise BadRequest(name, value, known)
    if json and format not in ("text", "json"):
        raise BadRequest(f"--format {format}: not possible with --json", remedy="Omit one.")
    with Progress():
        given["close"] = given["close"] or ()
        found = hrsynth.lint(files, program=program or (), ignore=ignore or (), **given)
    if json or format == "json":
        print_text(format_record("lint", None, found.to_dict()))
    elif format == "text":
        print_text(hrsynth.text(found), paint=paint)
    else:
        print_text(shown.format_github(found) if format == "github" else shown.format_sarif(found))
    if found.unread:
        for defect in found.unread:
            print_text(f"hrsynth: {defect}", err=True)
        raise SystemExit(BadRobotFile.exit_status)
    if fail_on != "nothing" and found.has_severity(fail_on):
        raise SystemExit(1)


def add(app: Group) -> None:
    """Register the command."""
    add_command(
        app,
        "lint",
        "Check robot files by named rules, and fix what can be fixed.",
        (
            Option(
                "files",
                "Robot files in any format, or names of shipped robots.",
                "FILES",
                list[str],
                NEEDED,
                argument=True,
                words=list_shipped_names,
            ),
            flag("fix", "Apply fixes that leave no choice; overwrite the file or write to --output."),
            Option("compare", "Another file of the same robot: list the differences.", "OTHER"),
            Option(
                "program",
                "A program that should read the file (mujoco, gazebo …): a loop closure that it ignores is "
                "an error; repeat for more.",
                "NAME",
                list[str],
                words=list_program_names,
            ),
            Option("ignore", "A rule to leave out; repeat for more.", "RULE", list[str], words=list_rule_names),
            Option(
                "fail_on",
                "Exit status is 1 at this severity or worse: error, warning, note; nothing: never.",
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
            output("The fixed file, with --fix and a single file."),
            JSON,
            *SOURCE[1:],
        ),
        lint,
        (
            "robot.urdf",
            "robot.urdf --fix -o fixed.urdf",
            "robot.urdf --compare robot.xml",
            "a.urdf b.xml --program mujoco --format github --fail-on warning",
        ),
    )
