"""Damped Gauss-Newton (Levenberg 1944, Marquardt 1963): one loop for all that is closed or led by its derivative."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from ..geometry.vectors import Array

X = TypeVar("X")


@dataclass(frozen=True)
class DampingFactor:
    """A factor that is eased where a step helped, down to ``least``, and grows tenfold where it did not; above ``most``
    the descent is given up."""

    start: float
    eased: float
    least: float
    most: float


UNDAMPED = DampingFactor(start=1.0, eased=1.0, least=1.0, most=1.0)
"""Steps are taken as long as they help."""


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


def descend(
    x: X,
    evaluate: Callable[[X], tuple[Array, Array]],
    advance: Callable[[X, Residual, float], X | None],
    damping: DampingFactor,
    iterations: int,
    content: Callable[[Residual], bool],
) -> tuple[X, Residual]:
    """Return the last point of steps that make the error smaller, and the error there.

    ``evaluate`` gives the error and its Jacobian at a point, ``advance`` the next point by a step with a damping factor
    (or None), ``content`` returns True if the error is small enough.
    """
    return next(
        descend_together(
            [x],
            lambda places: [evaluate(place) for place in places.values()],
            lambda at: {0: advance(*at[0])},
            damping,
            iterations,
            content,
        )
    )


def descend_together(
    starts: Sequence[X],
    evaluate: Callable[[Mapping[int, X]], Iterable[tuple[Array, Array]]],
    advance: Callable[[Mapping[int, tuple[X, Residual, float]]], Mapping[int, X | None]],
    damping: DampingFactor,
    iterations: int,
    content: Callable[[Residual], bool],
) -> Iterator[tuple[X, Residual]]:
    """As :func:`descend`, of several starts that know nothing of each other, in step: ``evaluate`` and ``advance`` are
    given those of each number that still descend."""
    x = dict(enumerate(starts))
    residuals = {i: Residual.of(*values) for i, values in zip(x, evaluate(x), strict=True)}
    factor = dict.fromkeys(x, damping.start)
    for _ in range(iterations):
        going = {
            i: (x[i], at, factor[i]) for i, at in residuals.items() if not (content(at) or factor[i] > damping.most)
        }
        if not going:
            break
        steps = {i: place for i, place in advance(going).items() if place is not None}
        trial = {i: Residual.of(*values) for i, values in zip(steps, evaluate(steps), strict=True)} if steps else {}
        for i, (_, at, used) in going.items():
            if i in trial and trial[i].size < at.size:
                x[i], residuals[i], factor[i] = steps[i], trial[i], max(damping.eased * used, damping.least)
            else:
                factor[i] = 10.0 * used
    return ((x[i], residuals[i]) for i in x)
