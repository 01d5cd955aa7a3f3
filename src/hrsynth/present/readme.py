"""Generated tables; ``python -m hrsynth.present.readme FILE …`` writes each between its marks where a file has them."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from ..analysis.controllability import legs
from ..analysis.derive import derive
from ..analysis.singularity.singular import singular
from ..description import load, shipped
from . import lint_rules, observation_kinds, printed, replays

START, END = "<!-- generated: robots -->", "<!-- end -->"
HEADS = ("robot", "architecture", "dof", "hidden robot, all legs watched", "verdict", "exact", "lost",
         "smallest leg sets", "Type 2 singularities, all legs watched")
POINTS = 200
"""Random poses at which the condition in words is checked before it is printed."""

_LONGEST_LIST = 4


def row(name: str) -> str:
    """One shipped robot's line: no number in it that a rounding error can change."""
    mechanism = load(shipped()[name])
    found, sets = derive(mechanism), legs(mechanism)
    hidden = found.hidden_architecture
    lost = "; ".join(freedom.name for freedom in found.verdict.lost)
    smallest = "–" if hidden is None else _smallest(sets.minimal)
    exact = "not decided" if not found.exact.exact else (
        "proved" if found.exact.proved else f"{found.exact.instances} instances")
    words = singular(mechanism, points=POINTS).words
    if words.startswith("always"):
        words = "always" + "".join(words.partition(", because")[1:])
    return _line((f"`{name}`", _cell(str(found.architecture)), str(found.dof), _cell(str(hidden)) if hidden else "none",
                  found.verdict.verdict, exact, lost or "–", smallest, _cell(words)))


def table(names: Iterable[str] | None = None) -> str:
    """The Markdown table of the shipped robots (default: all)."""
    rule = "|".join(["", *(" --- " for _ in HEADS), ""])
    return "\n".join([_line(HEADS), rule, *(row(name) for name in (shipped() if names is None else names))]) + "\n"


def block(text: str, start: str = START) -> str:
    """What stands between the marks; raises ``ValueError`` where they are not there."""
    match = _between(start).search(text)
    if match is None:
        raise ValueError(f"no {start} … {END}")
    return match[2]


def replaced(text: str, made: str, start: str = START) -> str:
    """The text with ``made`` between the marks."""
    block(text, start)
    return _between(start).sub(lambda match: match[1] + made + match[3], text)


def _between(start: str) -> re.Pattern[str]:
    return re.compile(rf"({re.escape(start)}\n)(.*?)({re.escape(END)})", re.DOTALL)


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cell(architecture: str) -> str:
    return architecture.replace("|", "\\|")


def _smallest(sets: Sequence[Sequence[str]]) -> str:
    """The smallest sets; where there are many, the first and their number."""
    shown = ["{" + ", ".join(each) + "}" for each in sets[:_LONGEST_LIST]]
    if len(sets) > _LONGEST_LIST:
        return f"{shown[0]} and {len(sets) - 1} more"
    return " ".join(shown)


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        file = Path(argument)
        text = file.read_text(encoding="utf-8")
        for start, make in ((START, table), (printed.START, printed.table), (replays.START, replays.table),
                            (lint_rules.START, lint_rules.table), (observation_kinds.START, observation_kinds.table)):
            text = replaced(text, make(), start) if start in text else text
        file.write_text(text, encoding="utf-8", newline="\n")
