"""Boxes are judged and cut until each is settled or given up, or a budget is spent (branch and bound)."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry.vectors import Array
from ..processes import run_shared
from ..progress import report

SERIAL_BOXES_COUNT = 400_000
"""Boxes judged before the work is shared among processes."""
BOX_PARTS, BOXES_A_PART = 16, 200_000
"""Parts of shared work, and boxes of each before it is split again."""

AGAIN, SETTLED = -1, -2
"""In the place of an axis: a box is judged again before it is cut, or needs no more."""

Flags = NDArray[np.bool_]
Boxes = tuple[Array, ...]
"""Middles (c, n) and half edges (c, n) of boxes, and what else is known of each, (c, …): both halves inherit it."""


@dataclass(eq=False)
class Exhaustion:
    """Boxes that wait, and those that were given up.

    Parameters
    ----------
    judge
        Function of boxes that returns them, or some of them, perhaps narrowed, and (c,) the axis across which each is
        to be cut, ``AGAIN``, ``SETTLED``, or a smaller number: the reason for which it is given up. Boxes that it does
        not return are settled.
    waiting
        The boxes to begin with.
    budget
        Largest number of boxes that are judged.
    batch
        Boxes judged together, the last ones first: so few wait. None: all that wait, or none where the budget does not
        allow them all.
    urgency
        Number of each box: the boxes with the least are judged first.
    concerns
        False for boxes that are dropped before they are judged.
    stage
        Name in progress reports; without a name there are none.
    """

    judge: Any
    waiting: Boxes
    budget: int
    batch: int | None = None
    urgency: Callable[..., Array] | None = None
    concerns: Callable[..., Flags] | None = None
    stage: str = ""
    judged: int = 0
    given_up: list[Boxes] = field(default_factory=list)
    """Boxes, with the reason last."""

    def __post_init__(self) -> None:
        self.space = self._compute_open_space()

    @property
    def is_settled(self) -> bool:
        """True if no box waits and none was given up."""
        return not any(len(middle) for middle, *_ in (self.waiting, *self.given_up))

    def run(self, most: int | None = None) -> Exhaustion:
        """Judge boxes until none waits, the budget is spent, or ``most`` boxes were judged."""
        most = self.budget if most is None else min(most, self.budget)
        while True:
            if self.concerns is not None:
                self.waiting = _take(self.waiting, self.concerns(*self.waiting))
            count, left = len(self.waiting[0]), most - self.judged
            size = count if self.batch is None else min(count, self.batch, left)
            if not 0 < size <= left:
                return self
            self._report()
            chosen: Any = slice(count - size, count)
            if self.urgency is not None:
                chosen = np.argsort(self.urgency(*self.waiting), kind="stable")[:size]
            *boxes, axis = self.judge(*_take(self.waiting, chosen))
            self.judged += size
            self.given_up.append(_take((*boxes, axis), axis < SETTLED))
            rest = tuple(np.delete(column, chosen, axis=0) for column in self.waiting)
            halves = _cut_boxes(_take(boxes, axis >= 0), axis[axis >= 0])
            self.waiting = _join(rest, _take(boxes, axis == AGAIN), halves)

    def run_shared(self, jobs: int) -> Exhaustion:
        """As :meth:`run`, many boxes in parts, by ``jobs`` processes, and those that wait dealt out again and again: no
        result depends on the number of processes. There is no urgency, every box concerns, and the judge has
        ``proved``, the list of what it has proved, and ``fresh()``, the same judge with nothing proved."""
        self.run(SERIAL_BOXES_COUNT)
        given = b""
        while len(self.waiting[0]) and self.judged < self.budget:
            given = given or pickle.dumps(self.judge.fresh())
            room = min(BOXES_A_PART * BOX_PARTS, self.budget - self.judged)
            count = min(BOX_PARTS, len(self.waiting[0]), room)
            parts = [_take(self.waiting, slice(k, None, count)) for k in range(count)]
            works = [partial(_run_part, given, self.batch, part, room // count) for part in parts]
            for k, (judged, given_up, proved, waiting) in enumerate(run_shared(works, min(jobs, BOX_PARTS))):
                self.judged += judged
                self.given_up += given_up
                self.judge.proved += proved
                parts[k] = waiting
                self.waiting = _join(*parts)
                self._report()
            # the smallest last again
            self.waiting = _take(self.waiting, np.argsort(-np.prod(self.waiting[1], axis=1), kind="stable"))
        return self

    def _compute_open_space(self) -> float:
        return float(sum(np.prod(half, axis=1).sum() for _, half, *_ in (self.waiting, *self.given_up)))

    def _report(self) -> None:
        """Report the settled part of the space, and how many boxes wait: the last per cent may need most of them."""
        if self.stage:
            report(
                f"{self.stage}: {np.floor(100 * (1 - self._compute_open_space() / self.space)):.0f} % of the space "
                f"settled, {self.judged:,} processed of at most {self.budget:,}, {len(self.waiting[0]):,} waiting"
            )


def _cut_boxes(boxes: Boxes, axis: Array) -> Boxes:
    """Boxes cut in two across an axis (c,) each: first all lower halves, then the upper ones."""
    middle, half, *others = boxes
    across = np.arange(middle.shape[1]) == axis[:, None]
    size = np.where(across, half / 2, half)
    shift = np.where(across, size, 0.0)
    return _join((middle - shift, size, *others), (middle + shift, size, *others))


def _take(boxes: Sequence[Array], which: Any) -> Boxes:
    return tuple(column[which] for column in boxes)


def _join(*parts: Boxes) -> Boxes:
    return tuple(map(np.concatenate, zip(*parts, strict=True)))


def _run_part(
    given: bytes, batch: int | None, waiting: Boxes, budget: int
) -> tuple[int, list[Boxes], list[Any], Boxes]:
    """Judge part of the boxes; return their number, those given up, what is proved, and the boxes that wait."""
    part = Exhaustion(_read(given).fresh(), waiting, budget, batch).run()
    return part.judged, part.given_up, part.judge.proved, part.waiting


@lru_cache(maxsize=2)
def _read(given: bytes) -> Any:
    """Read a judge, whose formulas are traced once in each process."""
    return pickle.loads(given)
