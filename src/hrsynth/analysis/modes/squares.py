"""As many equations as unknowns: the polynomials of one choice of legs, as tables of integers or of balls."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...geometry.vectors import Array
from .certify import Equation
from .conics import Conic, Frame, Numbers, Rounded, conic
from .curves import Circle, Curve

TURNS = (0.7, 1.9, 2.6)
"""Where t = 0 lies on the circles of the first, second and third unknown (rad): nowhere special."""


@dataclass(frozen=True, eq=False)
class Square:
    """One choice of legs with as many equations as unknowns.

    ``unknowns`` are the curves whose parameters are solved for; ``build`` gives the equations from their conics;
    ``place`` turns parameters (n,) into the coordinates of the system's pose; ``whole`` says that no other equation is
    left; ``exact`` gives the points that the unknowns stand for, where these are not those of the curves.
    """

    legs: tuple[int, ...]
    unknowns: tuple[Curve, ...]
    frame: Frame | None
    build: Callable[[Sequence[Conic], Numbers], list[Equation]]
    place: Callable[[Sequence[float]], Array]
    whole: bool
    exact: Callable[[Numbers], list[Conic]] | None = None

    def conics(self, turn: float = 0.0, numbers: Numbers = Rounded) -> list[Conic]:
        """The unknowns' curves, circles counted from ``turn`` on."""
        assert self.frame is not None
        return [conic(curve, self.frame, t, numbers) for curve, t in zip(self.unknowns, self.turns(turn), strict=True)]

    def equations(self, turn: float = 0.0, numbers: Numbers = Rounded) -> list[Equation]:
        """The equations with circles counted from ``turn`` on."""
        return [] if self.frame is None else self.build(self.conics(turn, numbers), numbers)

    def turns(self, turn: float) -> list[float]:
        """Where each unknown's circle is counted from (rad)."""
        return [each + turn for each in TURNS[:len(self.unknowns)]]

    @property
    def round(self) -> list[bool]:
        """Which unknowns are half-angle tangents."""
        return [isinstance(curve, Circle) for curve in self.unknowns]


def distance(one: Conic, other: Conic, squared: Any) -> Any:
    """The table of |tip₁ − tip₂|² = ``squared``."""
    return (np.outer(one.Q, other.w) + np.outer(one.w, other.Q) - 2 * (one.N @ other.N.T)
            - squared * np.outer(one.w, other.w))


def on_plane(one: Conic, normal: Any, offset: Any) -> Any:
    """The quadratic of normal · tip = ``offset``."""
    return one.N @ normal - offset * one.w


def on_sphere(one: Conic, centre: Any, squared: Any) -> Any:
    """The quadratic of |tip − centre|² = ``squared``."""
    return one.Q - 2 * (one.N @ centre) + (centre @ centre - squared) * one.w


def sum_on_plane(one: Conic, other: Conic, sign: int, normal: Any, offset: Any) -> Any:
    """The table of normal · (tip₁ ± tip₂) = ``offset``."""
    return np.outer(one.N @ normal - offset * one.w, other.w) + sign * np.outer(one.w, other.N @ normal)


def sum_on_sphere(one: Conic, other: Conic, sign: int, centre: Any, squared: Any) -> Any:
    """The table of |tip₁ ± tip₂ − centre|² = ``squared``."""
    return (np.outer(on_sphere(one, centre, squared), other.w)
            + np.outer(one.w, other.Q - sign * 2 * (other.N @ centre)) + sign * 2 * (one.N @ other.N.T))


def single(quadratic: Any) -> Equation:
    """A quadratic in the only unknown as an equation."""
    table = np.outer(quadratic, np.array([1, 0, 0], dtype=object))
    return Equation(table, 0, 0)


def resting(legs: tuple[int, ...], q: Array, whole: bool) -> Square:
    """A pose that a tip at rest decides: nothing to solve."""
    return Square(legs, (), None, lambda conics, numbers: [], lambda parameters: q, whole)
