"""Damped Gauss-Newton (Levenberg 1944, Marquardt 1963): one loop for all that is closed or led by its derivative."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from .vectors import Array

X = TypeVar("X")


@dataclass(frozen=True)
class Damping:
    """A factor that is eased where a step helped, down to ``least``, and grows tenfold where it did not; above ``most``
    the descent is given up."""

    start: float
    eased: float
    least: float
    most: float


@dataclass(frozen=True, eq=False)
class Residual:
    """An error (rows,), its Jacobian (rows, n) and its norm."""

    error: Array
    J: Array
    size: float

    @classmethod
    def of(cls, error: Array, J: Array) -> Residual:
        """With its norm."""
        return cls(error, J, math.sqrt(error @ error))


def descend(x: X, evaluate: Callable[[X], tuple[Array, Array]], advance: Callable[[X, Residual, float], X | None],
            damping: Damping, iterations: int, content: Callable[[Residual], bool]) -> tuple[X, Residual]:
    """Where steps lead that make the error smaller, and what is left of it there.

    ``evaluate`` gives the error and its Jacobian at a place, ``advance`` where a step with a damping factor leads (or
    None), ``content`` tells whether that is enough.
    """
    found, factor = Residual.of(*evaluate(x)), damping.start
    for _ in range(iterations):
        if content(found) or factor > damping.most:
            break
        there = advance(x, found, factor)
        trial = None if there is None else Residual.of(*evaluate(there))
        if there is not None and trial is not None and trial.size < found.size:
            x, found, factor = there, trial, max(damping.eased * factor, damping.least)
        else:
            factor *= 10.0
    return x, found
