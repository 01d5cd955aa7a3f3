"""``lint``: rules applied to robot files, their findings, and fixed files."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypedDict

from ..description import find_robot_file
from ..description.files import require_writable, write_whole
from ..description.overrides import Overrides, parse_names
from ..errors import BadRequest, BadRobotFile, Defect
from ..records import As, Recorded, Shown, recorded
from ..results import Result, require_keywords
from .findings import SEVERITIES, Finding, Fix
from .linted_file import LintedFile
from .rules import lint_rules
from .rules.readers import PROGRAMS

LINT_FIX_ROUNDS_MAX = 8
"""Largest number of passes of lint --fix."""


class LintCounts(TypedDict):
    """Number of findings of each severity."""

    error: int
    warning: int
    note: int


class Unread(NamedTuple):
    """File that could not be read, and the reason."""

    file: str
    line: int | None
    message: str


@dataclass(frozen=True, eq=False, repr=False)
class Lint(Result, shown_as="lint"):
    """Findings in files, the fixes made and the file they are written to; ``unread``: defects of unreadable files."""

    files: Recorded[tuple[str, ...]]
    findings: Recorded[tuple[Finding, ...]]
    fixed: Annotated[tuple[Finding, ...], "findings that --fix corrected"] = ()
    written: Annotated[str | None, As("file"), "path of the fixed file"] = None
    rules: tuple[str, ...] = field(default=(), repr=False)
    unread: tuple[Defect, ...] = ()

    def headline(self) -> str:
        """Number of files and findings."""
        counts = self.counts
        found = ", ".join(f"{counts[name]} {name}{'s' * (counts[name] != 1)}" for name in reversed(SEVERITIES))
        unread = len({each.file for each in self.unread})
        return f"{len(self.files)} file{'s' * (len(self.files) != 1)}: {found}" + (
            f"; {unread} more could not be read" if unread else ""
        )

    @property
    @recorded(LintCounts)
    def counts(self) -> dict[str, int]:
        """Number of findings of each severity."""
        return {name: sum(each.severity == name for each in self.findings) for name in SEVERITIES}

    def has_severity(self, severity: str) -> bool:
        """Return True if a finding is at least that severe; an unread file is."""
        return bool(self.unread) or any(each.rank >= SEVERITIES.index(severity) for each in self.findings)

    unread_record = Shown(
        list[Unread], lambda self: [Unread(each.file, each.line, each.text) for each in self.unread], As("unread")
    )


def lint(
    files: str | Path | Iterable[str | Path],
    *,
    compare: str | Path | None = None,
    program: Iterable[str] | str = (),
    ignore: Iterable[str] | str = (),
    fix: bool = False,
    output: str | Path | None = None,
    **said: Any,
) -> Lint:
    """Check robot files by the rules of ``hrsynth.linting.rules`` and return their findings.

    Parameters
    ----------
    files
        Robot files or names of robots.
    compare
        Another file of the same robot, whose differences are reported too.
    program
        Programs that should read the files: a closure that one of them loses is an error.
    ignore
        Rules to leave out.
    fix
        Apply all fixes that are unique, and write the file, completely or not at all. The findings are then those that
        remain.
    output
        File to write instead of the original (a link is not followed unless it is named).
    **said
        File overrides as in ``load`` (``platform``, ``close`` …).

    Returns
    -------
    Lint
        Findings with their files and lines. ``unread`` lists those of several files that cannot be read.

    Raises
    ------
    BadRobotFile
        If none of the files can be read.
    BadRequest
        For unknown names, for ``output`` without ``fix`` or with several files, and for a file that cannot be written.

    Examples
    --------
    >>> hrsynth.lint("3rrr_m1")
    <Lint: 1 file: 0 errors, 0 warnings, 6 notes>
    """

    require_keywords(lint, said, (each.name for each in fields(Overrides)))
    paths = list(files) if isinstance(files, Iterable) and not isinstance(files, str) else [files]
    skipped, programs = parse_names(ignore) or (), tuple(parse_names(program) or ())
    for what, asked, known in (("rule", skipped, tuple(lint_rules())), ("program", programs, PROGRAMS)):
        unknown = [name for name in asked if name and name not in known]
        if unknown:
            raise BadRequest(f"unknown {what}", unknown[0], known)
    if not paths:
        raise BadRequest("no file given", None, "one or more")
    if output is not None and (not fix or len(paths) > 1):
        raise BadRequest(f"--output {output}: needs --fix and one file", remedy="Name one file, or omit --output.")
    if output is not None:
        require_writable(output)
    given = Overrides.said(**said)
    other = None if compare is None else LintedFile(find_robot_file(compare), given)
    opened, defects, named = [], list[Defect](), [find_robot_file(path) for path in paths]
    for path in named:
        try:
            opened.append(LintedFile(path, given, readers=programs, other=other))
        except BadRobotFile as error:
            defects += error.defects
    if not opened:
        raise BadRobotFile(defects)
    mended, written = list[Finding](), None
    if fix:
        every = [(file, *_apply_fixes(file, skipped)) for file in opened]
        new = [(Path(output or file.path), after.data) for file, after, gone in every if gone or output is not None]
        for target, _ in new:
            require_writable(target)
            if output is None and target not in named and target.is_symlink():
                raise BadRequest(
                    "nothing is fixed: a file is reached by a link",
                    str(target),
                    remedy="Name the file itself, or use --output.",
                )
        for target, data in new:
            write_whole(target, data)
            written = str(target)
        mended = [each for _, _, gone in every for each in gone]
        opened = [after for _, after, _ in every]
    found = [each for file in opened for each, _ in collect_findings(file, skipped)]
    return Lint(
        tuple(file.file for file in opened),
        tuple(found),
        tuple(mended),
        written,
        tuple(name for name in lint_rules() if name not in skipped),
        tuple(dict.fromkeys(defects)),
    )


def collect_findings(file: LintedFile, ignore: Sequence[str] = ()) -> list[tuple[Finding, Fix | None]]:
    """Return the findings in a file and their fixes, by line, the most severe of a line first; a refusal that another
    rule reports is left out."""
    found = []
    for rule in lint_rules().values():
        for spot in rule.find(file) if rule.name not in ignore else ():
            where, line = getattr(spot.line, "file", file.file), spot.line
            mend = None if file.expanded else spot.mend
            found.append(
                (
                    Finding(
                        rule.name,
                        spot.severity or rule.severity,
                        where,
                        line,
                        spot.message,
                        spot.advice or rule.advice,
                        mend is not None,
                    ),
                    mend,
                )
            )
    told = {
        (each.file, each.line)
        for each, _ in found
        if each.rule != "refused" and each.severity == "error" and each.line is not None
    }
    found = [pair for pair in found if pair[0].rule != "refused" or (pair[0].file, pair[0].line) not in told]
    return sorted(found, key=lambda pair: (pair[0].line is None, pair[0].line or 0, -pair[0].rank))


def _apply_fixes(file: LintedFile, ignore: Sequence[str]) -> tuple[LintedFile, list[Finding]]:
    """Return the file with all fixes, and the fixed findings: in rounds, as one may uncover or undo another."""
    gone: list[Finding] = []
    for _ in range(LINT_FIX_ROUNDS_MAX):
        found = [(each, mend) for each, mend in collect_findings(file, ignore) if mend is not None]
        if not found:
            break
        for each, mend in found:
            if each.rule == found[0][0].rule:
                mend()
                gone.append(each)
        file = file.after()
    return file, gone
