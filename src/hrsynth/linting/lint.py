"""``lint``: all rules on files of robots, what they find, and the files mended."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypedDict

from ..budgets import MOST_MENDING
from ..description import file_of
from ..description.files import require_writable, write_whole
from ..description.overrides import Overrides, names
from ..errors import BadRequest, BadRobotFile, Defect
from ..records import As, Recorded, Shown, recorded
from ..results import Result, require_keywords
from .findings import SEVERITIES, Finding, Fix
from .linted_file import LintedFile
from .rules import lint_rules
from .rules.readers import PROGRAMS


class LintCounts(TypedDict):
    """How many findings are of each severity."""

    error: int
    warning: int
    note: int


class Unread(NamedTuple):
    """A file that could not be opened, or is no document, and why."""

    file: str
    line: int | None
    message: str


@dataclass(frozen=True, eq=False, repr=False)
class Lint(Result, shown_as="lint"):
    """What was found in which files, and what was mended and where that is written; ``unread``: why others of several
    files could not be opened."""

    files: Recorded[tuple[str, ...]]
    findings: Recorded[tuple[Finding, ...]]
    mended: Annotated[tuple[Finding, ...], "what --fix did"] = ()
    written: Annotated[str | None, As("file"), "where the result is written"] = None
    rules: tuple[str, ...] = field(default=(), repr=False)
    unread: tuple[Defect, ...] = ()

    def headline(self) -> str:
        """How much was found."""
        counts = self.counts
        found = ", ".join(f"{counts[name]} {name}{'s' * (counts[name] != 1)}" for name in reversed(SEVERITIES))
        unread = len({each.file for each in self.unread})
        return f"{len(self.files)} file{'s' * (len(self.files) != 1)}: {found}" + (
            f"; {unread} more could not be read" if unread else ""
        )

    @property
    @recorded(LintCounts)
    def counts(self) -> dict[str, int]:
        """How many findings are of each severity."""
        return {name: sum(each.severity == name for each in self.findings) for name in SEVERITIES}

    def reaches(self, severity: str) -> bool:
        """Whether a finding is at least that bad; a file that cannot be read is."""
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
    """Everything that is wrong, doubtful or lost in robot files, by the rules of ``hrsynth.linting.rules``.

    ``compare`` is another file of the same robot: differences between the two are reported too. ``program`` names
    programs that should read the files: a closure that one of them loses is an error. ``ignore`` names rules to leave
    out. With ``fix`` everything that can be mended in only one way is mended, and the file is written, completely or
    not at all, to ``output`` or over the original (no link that is not named); the findings are then those that remain.
    What no file says is given as for ``load`` (``platform``, ``close`` …).

    Of several files those that cannot be opened, or are no documents, are told in ``unread``. Raises ``BadRobotFile``
    if there is no other; ``BadRequest`` for unknown names, for several files with ``output``, and if the file cannot be
    written.

    >>> hrsynth.lint("3rrr_m1")
    <Lint: 1 file: 0 errors, 0 warnings, 6 notes>
    """
    require_keywords(lint, said, (each.name for each in fields(Overrides)))
    paths = list(files) if isinstance(files, Iterable) and not isinstance(files, str) else [files]
    skipped, programs = names(ignore) or (), tuple(names(program) or ())
    for what, asked, known in (("rule", skipped, tuple(lint_rules())), ("program", programs, PROGRAMS)):
        unknown = [name for name in asked if name and name not in known]
        if unknown:
            raise BadRequest(f"no {what} of this name", unknown[0], known)
    if not paths:
        raise BadRequest("no file to look at", None, "one or more")
    if output is not None and (not fix or len(paths) > 1):
        raise BadRequest("an output is the mended file", str(output), "one file with --fix")
    if output is not None:
        require_writable(output)
    given = Overrides.said(**said)
    other = None if compare is None else LintedFile(file_of(compare), given)
    opened, defects, named = [], list[Defect](), [file_of(path) for path in paths]
    for path in named:
        try:
            opened.append(LintedFile(path, given, readers=programs, other=other))
        except BadRobotFile as error:
            defects += error.defects
    if not opened:
        raise BadRobotFile(defects)
    mended, written = list[Finding](), None
    if fix:
        every = [(file, *_mend_file(file, skipped)) for file in opened]
        new = [(Path(output or file.path), after.data) for file, after, gone in every if gone or output is not None]
        for target, _ in new:
            require_writable(target)
            if output is None and target not in named and target.is_symlink():
                raise BadRequest(
                    "nothing is mended: a file that was not named is a link",
                    str(target),
                    "the file itself, named, or --output",
                )
        for target, data in new:
            write_whole(target, data)
            written = str(target)
        mended = [each for _, _, gone in every for each in gone]
        opened = [after for _, after, _ in every]
    found = [each for file in opened for each, _ in findings(file, skipped)]
    return Lint(
        tuple(file.file for file in opened),
        tuple(found),
        tuple(mended),
        written,
        tuple(name for name in lint_rules() if name not in skipped),
        tuple(dict.fromkeys(defects)),
    )


def findings(file: LintedFile, ignore: Sequence[str] = ()) -> list[tuple[Finding, Fix | None]]:
    """What the rules find in a file and what mends it, by line, the worst of a line first; what is told by a rule of
    its own is not told again as refused."""
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


def _mend_file(file: LintedFile, ignore: Sequence[str]) -> tuple[LintedFile, list[Finding]]:
    """The file with all mends, and what they mended: round by round, as one may uncover or undo the cause of
    another."""
    gone: list[Finding] = []
    for _ in range(MOST_MENDING):
        found = [(each, mend) for each, mend in findings(file, ignore) if mend is not None]
        if not found:
            break
        for each, mend in found:
            if each.rule == found[0][0].rule:
                mend()
                gone.append(each)
        file = file.after()
    return file, gone
