"""What a rule of ``lint`` is, and what it finds: data that every output shows in its own way."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Literal

from ..records import As
from ..results import Value

if TYPE_CHECKING:
    from .linted_file import LintedFile

SEVERITIES = ("note", "warning", "error")
"""From the mildest to the worst."""
Fix = Callable[[], None]
"""Changes the file's document in place."""


@dataclass(frozen=True)
class RuleHit:
    """Where a rule found something: the line, what is there, what mends it (None where a person must decide), and the
    advice where it is another than the rule's own."""

    line: int | None
    message: str
    mend: Fix | None = None
    advice: str | None = None
    severity: str | None = None


@dataclass(frozen=True)
class LintRule:
    """A rule: its name, how bad it is, what it says in a few words, why that matters, what to do; ``mends`` says
    whether ``--fix`` does it (where there is one way to). ``find`` looks for it in a file that was opened."""

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
    """One thing that is wrong, doubtful or lost, with its file and line and what to do about it."""

    rule: str
    severity: Annotated[str, Literal["error", "warning", "note"]]
    file: str
    line: Annotated[int | None, "null if it concerns the whole file"]
    message: str
    advice: Annotated[str | None, As("fix"), "what to do about it"] = None
    fixable: Annotated[bool, "whether --fix mends it"] = False

    @property
    def rank(self) -> int:
        """How bad it is: 0 a note, 2 an error."""
        return SEVERITIES.index(self.severity)

    @property
    def where(self) -> str:
        """File and line."""
        return self.file if self.line is None else f"{self.file}:{self.line}"
