"""Rules of ``lint`` and their findings: data that every output shows in its own way."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Literal

from ..records import As
from ..results import Value

if TYPE_CHECKING:
    from .linted_file import LintedFile

SEVERITIES = ("note", "warning", "error")
"""Function that changes the file's document in place."""
Fix = Callable[[], None]
"""Changes the file's document in place."""


@dataclass(frozen=True)
class RuleHit:
    """Hit of a rule: line, message, fix (None if a person must decide), and advice if it differs from the rule's."""

    line: int | None
    message: str
    mend: Fix | None = None
    advice: str | None = None
    severity: str | None = None


@dataclass(frozen=True)
class LintRule:
    """Rule: name, severity, title, explanation, advice; ``fixable`` if ``--fix`` can apply it (there is only one way).
    ``find`` yields its hits in an opened file."""

    name: str
    severity: str
    title: str
    explanation: str
    advice: str
    find: Callable[[LintedFile], Iterable[RuleHit]] = field(repr=False)
    fixable: bool = False

    def __post_init__(self) -> None:
        assert self.severity in SEVERITIES


@dataclass(frozen=True, eq=False, repr=False)
class Finding(Value, all_recorded=True):
    """Finding: a defect, doubt or loss in a file, with its line and the advice."""

    rule: str
    severity: Annotated[str, Literal["error", "warning", "note"]]
    file: str
    line: Annotated[int | None, "null if it concerns the whole file"]
    message: str
    advice: Annotated[str | None, As("fix"), "advice"] = None
    fixable: Annotated[bool, "true if --fix can apply it"] = False

    @property
    def rank(self) -> int:
        """Severity as a number: 0 a note, 2 an error."""
        return SEVERITIES.index(self.severity)

    @property
    def where(self) -> str:
        """File and line as a text."""
        return self.file if self.line is None else f"{self.file}:{self.line}"
