"""The table of the shipped robots, on the page robots/README.md."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from hrsynth.analysis.controllability import legs
from hrsynth.analysis.derive import derive
from hrsynth.analysis.singularity.singularities import singularities
from hrsynth.description import list_robots, load

from .markdown import table as markdown

START = "<!-- generated: robots -->"
HEADS = (
    "robot",
    "architecture",
    "dof",
    "hidden robot, all legs observed",
    "verdict",
    "exact",
    "unobserved",
    "smallest leg sets",
    "Type 2 singularities, all legs observed",
)
POINTS = 200
"""Random poses at which the condition in words is checked before it is printed."""

_LONGEST_LIST = 4


def row(name: str) -> tuple[str, ...]:
    """Return the row of a shipped robot, without numbers that a rounding error can change."""
    mechanism = load(list_robots()[name])
    found, sets = derive(mechanism), legs(mechanism)
    hidden = found.hidden_architecture
    unobserved = "; ".join(twist.name for twist in found.verdict.unobserved)
    smallest = "–" if hidden is None else _smallest(sets.minimal)
    exact = (
        "not decided"
        if not found.exact.exact
        else ("proved" if found.exact.proved else f"{found.exact.instances} instances")
    )
    words = singularities(mechanism, points=POINTS).words
    if words.startswith("always"):
        words = "always" + "".join(words.partition(", because")[1:])
    return (
        f"`{name}`",
        str(found.architecture),
        str(found.dof),
        str(hidden) if hidden else "none",
        found.verdict.verdict,
        exact,
        unobserved or "–",
        smallest,
        words,
    )


def table(names: Iterable[str] | None = None) -> str:
    """Return the Markdown table of the shipped robots (default: all)."""
    return markdown(HEADS, map(row, list_robots() if names is None else names))


def _smallest(sets: Sequence[Sequence[str]]) -> str:
    """Return the smallest sets; of many, the first and their number."""
    shown = ["{" + ", ".join(each) + "}" for each in sets[:_LONGEST_LIST]]
    if len(sets) > _LONGEST_LIST:
        return f"{shown[0]} and {len(sets) - 1} more"
    return " ".join(shown)
