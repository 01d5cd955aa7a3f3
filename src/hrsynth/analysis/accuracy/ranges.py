"""Ranges of errors, combined part by part."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ...geometry.vectors import Array
from ...records import SCALED, Recorded
from ...results import Value


@dataclass(frozen=True)
class ErrorRange(Value):
    """Range of errors: the least and the largest of those that the first order bounds (None: there are none), the
    numbers of larger and of infinite ones, and whether any is not zero."""

    least: Annotated[float | None, SCALED] = None
    largest: Annotated[float | None, SCALED] = None
    slack: Annotated[int, "number of larger ones"] = 0
    infinite: Recorded[int] = 0
    moves: bool = False

    @classmethod
    def of(cls, errors: Array, limit: float) -> ErrorRange:
        """The range of errors, NaN left out; the first order bounds those up to a ``limit``."""
        there = errors[~np.isnan(errors)]
        kept, infinite = there[there <= limit], int(np.isinf(there).sum())
        low, high = (float(kept.min()), float(kept.max())) if kept.size else (None, None)
        return cls(low, high, there.size - kept.size - infinite, infinite, bool((there > 0).any()))

    def with_more(self, other: ErrorRange) -> ErrorRange:
        """The range of both."""
        lows, highs = (
            [each for each in both if each is not None]
            for both in ((self.least, other.least), (self.largest, other.largest))
        )
        return ErrorRange(
            min(lows, default=None),
            max(highs, default=None),
            self.slack + other.slack,
            self.infinite + other.infinite,
            self.moves or other.moves,
        )


@dataclass(frozen=True)
class Tally(Value):
    """Summary of the first poses of a sweep: number done, number reached, ranges, gap, and the part with the most
    reached poses (number and start)."""

    done: int = 0
    reached: int = 0
    position: ErrorRange = ErrorRange()
    orientation: ErrorRange = ErrorRange()
    gap: float = 0.0
    fullest: tuple[int, int] = (0, 0)

    def with_part(self, count: int, reached: int, position: ErrorRange, orientation: ErrorRange, gap: float) -> Tally:
        """Return the summary with one part more."""
        return Tally(
            self.done + count,
            self.reached + reached,
            self.position.with_more(position),
            self.orientation.with_more(orientation),
            max(self.gap, gap),
            max(self.fullest, (reached, self.done), key=lambda each: each[0]),
        )

    @classmethod
    def parse(cls, line: str) -> Tally:
        """Parse a line of the journal."""
        told = json.loads(line)
        ranges = {name: ErrorRange(**told[name]) for name in ("position", "orientation")}
        return cls(**{**told, **ranges, "fullest": tuple(told["fullest"])})

    def to_line(self) -> str:
        """The line of the journal."""
        return json.dumps({**vars(self), "position": vars(self.position), "orientation": vars(self.orientation)})
