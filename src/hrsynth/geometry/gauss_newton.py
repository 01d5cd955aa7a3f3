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


def descend(x: X, evaluate: Callable[[X], tuple[Array, Array]],
            advance: Callable[[X, Array, Array, float], X | None], damping: Damping, iterations: int,
            content: Callable[[Array, Array, float], bool]) -> tuple[X, float]:
    """Where steps lead that make the error smaller, and its norm there.

    ``evaluate`` gives the error (rows,) and its Jacobian at a place, ``advance`` where a step with a damping factor
    leads (None: nowhere), ``content`` whether an error with its Jacobian and norm is small enough.
    """
    error, J = evaluate(x)
    size, factor = math.sqrt(error @ error), damping.start
    for _ in range(iterations):
        if content(error, J, size) or factor > damping.most:
            break
        there = advance(x, error, J, factor)
        if there is not None:
            trial, trial_J = evaluate(there)
            trial_size = math.sqrt(trial @ trial)
            if trial_size < size:
                x, error, J, size = there, trial, trial_J, trial_size
                factor = max(damping.eased * factor, damping.least)
                continue
        factor *= 10.0
    return x, size
