"""Numbers that a user gives: how they are written, and from where to where a question takes them."""

from __future__ import annotations

from typing import Any

from .errors import BadRequest

RANGES: dict[str, tuple[float | None, float | None]] = {
    "seed": (0, None),
    "effort": (1, None),
    "modes effort": (0, None),
    "points": (1, 10_000_000),
    "steps": (5, 300),
    "basins steps": (2, 300),
    "jobs": (1, None),
    "nonlinear": (0, None),
    "gain": (None, 1e6),
    "size": (1, None),
    "runs": (0, None),
    "endings": (0, None),
    "examine": (1, None),
}
"""The least and the largest value of a number by its name, that of one question by this one's name and its own."""


def range_of(question: str, name: str) -> tuple[float | None, float | None]:
    """The least and the largest value of a question's number, None where there is none."""
    return RANGES.get(f"{question} {name}", RANGES.get(name, (None, None)))


def range_words(low: float | None, high: float | None) -> list[str]:
    """A range in words."""
    return [f"at {end} {value:g}" for end, value in (("least", low), ("most", high)) if value is not None]


def in_range(value: float, low: float | None, high: float | None) -> bool:
    """Whether a number is in a range; not a number is in none that has an end."""
    return (low is None or value >= low) and (high is None or value <= high)


def require_range(question: str, name: str, value: float, word: str) -> None:
    """Raise ``BadRequest`` for a value that a question does not take."""
    ends = range_of(question, name)
    if not in_range(value, *ends):
        raise BadRequest(name, value, ", ".join([word, *range_words(*ends)]))


def plain_number(text: str, kind: type = float) -> Any:
    """The number that a user writes, in ASCII digits without underscores; raises ``ValueError``."""
    if not text.isascii() or "_" in text:
        raise ValueError(text)
    return kind(text)
