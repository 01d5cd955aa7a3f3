"""Legs in closed form: the tip, a point of the platform, decides what the leg does, and whether it reaches at all.

A leg carries one thing that its tip C decides: the end B of a crank or of a slider, from which a rod leads to C, or the
direction of a rod that slides. ``mode`` ±1, the working mode, selects one of two solutions. The *reach margin* is
positive as long as the leg reaches its tip, and vanishes where the two solutions meet (Type 1). Points in base axes.

The formulas are on components: numbers, arrays, balls, or symbols of a tape. A method ``at`` makes components of the
leg's numbers by ``number``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry.balls import Field, widen
from ..geometry.components import Components, cross, dot, minus, plus, scale, sqrt
from ..geometry.vectors import Array
from ..tolerances import HIDDEN_ROBOT_RESIDUAL_TOL
from .platform_points import ORIGIN, PlatformPoint

Number = Callable[[Any], Any]
"""Makes components of a number or a vector of the leg."""


def rod_on_crank(D: Components, axis: Components, radius: Any, rod: Any, mode: Any) -> tuple[Any, list[Any]]:
    """Reach margin and B, both points from the crank's centre: |B| = radius, B·axis = 0 and |D − B| = rod.

    With D⊥ = D − (D·a) a: D⊥·B = (|D|² + radius² − rod²) / 2 = s, the other part of B is along a × D⊥ (circle and
    sphere; the margin is radius² |D⊥|² − s²)."""
    flat = minus(D, scale(dot(D, axis), axis))
    far = dot(flat, flat)
    share = (dot(D, D) + radius * radius - rod * rod) * 0.5
    margin = radius * radius * far - share * share
    aside = mode * sqrt(margin)
    spoke = plus(scale(share, flat), scale(aside, cross(axis, flat)))
    return margin, [x / far for x in spoke]


def rod_on_rail(D: Components, axis: Components, rod: Any, mode: Any) -> tuple[Any, list[Any]]:
    """Reach margin and B, both points from the rail's start: B along the axis, |D − B| = rod (line and sphere)."""
    along = dot(D, axis)
    across = minus(D, scale(along, axis))
    margin = rod * rod - dot(across, across)
    return margin, scale(along + mode * sqrt(margin), axis)


def sliding_rod(D: Components, axis: Components | None, aside: Any, mode: Any) -> tuple[Any, list[Any]]:
    """Reach margin and direction u of a rod through the tip D, seen from the base point that the rod's line passes; at
    the distance ``aside``, on the side of axis × u, where the leg turns about a base axis."""
    square = dot(D, D)
    if axis is None:
        size = sqrt(square)
        return square, [mode * (x / size) for x in D]
    flat = minus(D, scale(dot(D, axis), axis))
    far = dot(flat, flat)
    margin = far - aside * aside
    drawn = mode * sqrt(margin)
    turned = cross(axis, flat)
    return margin, [x / far for x in minus(scale(drawn, flat), scale(aside, turned))]


@dataclass(frozen=True, eq=False)
class ClosedFormLeg:
    """Leg's path from the base to a tip."""

    label: str
    tip: PlatformPoint = ORIGIN
    mode: float = 1.0
    fitted: bool = field(default=False, kw_only=True)
    """True if the leg's form or its tip was found by fitting samples, not read from its joints."""
    sense: float = field(default=1.0, kw_only=True)
    """±1: the observed direction is this times that of the rod, from B to the tip."""
    crank: str = field(default="", kw_only=True)
    """The link that carries B."""
    place: Array = field(default_factory=lambda: np.zeros(3), kw_only=True)
    """B at the zero configuration."""
    centre: Array = field(default_factory=lambda: np.zeros(3), kw_only=True)
    """A point of the base: the crank's centre, the slider's start, what a sliding rod passes."""

    def at(self, tip: Components, number: Number, mode: Any) -> tuple[Any, list[Any]]:
        """The reach margin and what the tip decides, on components."""
        raise NotImplementedError

    def solve(self, tip: Field, mode: Field | float) -> tuple[Field, Field]:
        """The reach margin (n,) and what the tip decides (n, 3), for tips (n, 3) of numbers or balls."""
        margin, carried = self.at(list(np.moveaxis(tip, -1, 0)), lambda value: _as_number(value, tip), mode)
        return margin, np.stack(np.broadcast_arrays(*carried), -1)

    def direction(self, p: Array, R: Array) -> tuple[Array, NDArray[np.bool_]]:
        """The observed direction u (n, 3) at poses (n, 3), (n, 3, 3), and where the leg reaches, (n,)."""
        raise NotImplementedError

    def ends(self, p: Array, R: Array) -> Array | None:
        """B (n, 3) at poses (n, 3), (n, 3, 3), no number where the leg does not reach; None where there is none."""
        return None

    def modes(self, tip: Array, carried: Array) -> Array:
        """The working modes (n,) in which tips and what they decide (n, 3) go together."""
        with np.errstate(invalid="ignore", divide="ignore"):
            one, other = (self.solve(tip, sign)[1] for sign in (1.0, -1.0))
        return np.where(np.linalg.norm(one - carried, axis=1) <= np.linalg.norm(other - carried, axis=1), 1.0, -1.0)


@dataclass(frozen=True, eq=False)
class OnRod(ClosedFormLeg):
    """A rod of constant length from B to the tip."""

    axis: Array = field(kw_only=True)
    rod: float = field(kw_only=True)

    def direction(self, p: Array, R: Array) -> tuple[Array, NDArray[np.bool_]]:
        tip = self.tip.value(p, R)
        margin, B = self.solve(tip, self.mode)
        return (tip - B) * (self.sense / self.rod), margin > 0

    def ends(self, p: Array, R: Array) -> Array | None:
        return self.solve(self.tip.value(p, R), self.mode)[1]


def _as_number(value: Any, like: Field) -> Any:
    """A number or vector of the geometry, for numbers; among balls, one that holds what it was rounded from."""
    if like.dtype != object:
        return value
    found = widen(np.asarray(value, dtype=object), HIDDEN_ROBOT_RESIDUAL_TOL)
    return found[()] if found.ndim == 0 else found


@dataclass(frozen=True, eq=False)
class OnCrank(OnRod):
    """B is the end of a crank of length ``radius``, which turns about ``axis`` through ``centre``."""

    radius: float = field(kw_only=True)

    @property
    def pivot(self) -> Array:
        """The axis of the crank."""
        return self.axis

    def at(self, tip: Components, number: Number, mode: Any) -> tuple[Any, list[Any]]:
        centre = number(self.centre)
        margin, spoke = rod_on_crank(minus(tip, centre), number(self.axis), number(self.radius), number(self.rod), mode)
        return margin, plus(centre, spoke)


@dataclass(frozen=True, eq=False)
class OnRail(OnRod):
    """B is on a slider: at ``centre`` + s ``axis``."""

    def at(self, tip: Components, number: Number, mode: Any) -> tuple[Any, list[Any]]:
        centre = number(self.centre)
        margin, way = rod_on_rail(minus(tip, centre), number(self.axis), number(self.rod), mode)
        return margin, plus(centre, way)


@dataclass(frozen=True, eq=False)
class SlidingRod(ClosedFormLeg):
    """A rod that slides along its own line, which passes the base point ``centre`` at the distance ``aside`` (on the
    side of axis × direction, where the leg turns about a base ``axis``): its direction u."""

    axis: Array | None = field(default=None, kw_only=True)
    aside: float = field(default=0.0, kw_only=True)

    def at(self, tip: Components, number: Number, mode: Any) -> tuple[Any, list[Any]]:
        axis = None if self.axis is None else number(self.axis)
        return sliding_rod(minus(tip, number(self.centre)), axis, number(self.aside), mode)

    def direction(self, p: Array, R: Array) -> tuple[Array, NDArray[np.bool_]]:
        margin, u = self.solve(self.tip.value(p, R), self.mode)
        return u, margin > 0


@dataclass(frozen=True, eq=False)
class FixedDirection(ClosedFormLeg):
    """A direction that never changes: u = ``axis``."""

    axis: Array = field(kw_only=True)

    def direction(self, p: Array, R: Array) -> tuple[Array, NDArray[np.bool_]]:
        return np.broadcast_to(self.axis, p.shape), np.ones(len(p), dtype=bool)


@dataclass(frozen=True, eq=False)
class PlatformDirection(ClosedFormLeg):
    """A direction that turns with the platform: u = R ``axis``. Where there is a ``radius``, the end of a crank of the
    base (``centre``, ``pivot``) is on the platform's line through the tip along u as well."""

    axis: Array = field(kw_only=True)
    pivot: Array = field(default_factory=lambda: np.zeros(3), kw_only=True)
    radius: float = field(default=0.0, kw_only=True)

    def at(self, tip: Components, number: Number, mode: Any, *u: Any) -> tuple[Any, list[Any]]:
        """Return, for the line of u, the reach margin and the crank's end B on it, |B − centre| = radius (sphere and
        line)."""
        centre, radius = number(self.centre), number(self.radius)
        D = minus(tip, centre)
        away = dot(D, u)
        margin = radius * radius - dot(D, D) + away * away
        return margin, plus(tip, scale(mode * sqrt(margin) - away, u))

    def direction(self, p: Array, R: Array) -> tuple[Array, NDArray[np.bool_]]:
        u, ends = R @ self.axis, self.ends(p, R)
        return u, np.ones(len(p), dtype=bool) if ends is None else ~np.isnan(ends[:, 0])

    def ends(self, p: Array, R: Array) -> Array | None:
        if not self.radius:
            return None
        margin, B = self.at(self.tip.value(p, R).T, lambda value: value, self.mode, *(R @ self.axis).T)
        return np.where(margin > 0, B, np.nan).T


@dataclass(frozen=True, eq=False)
class PinnedRod(ClosedFormLeg):
    """B is the tip itself: the link that carries it is jointed to the platform, whose direction ``axis`` is the rod."""

    axis: Array = field(kw_only=True)

    def at(self, tip: Components, number: Number, mode: Any) -> tuple[Any, list[Any]]:
        return 1.0, list(tip)


@dataclass(frozen=True, eq=False)
class RailAndLine(ClosedFormLeg):
    """B is at ``centre`` + s ``axis`` and on a line through the tip, in the plane of both; ``normal`` to it, in the
    base, or in the platform where it ``turns``: s = n·(C − centre) / n·axis."""

    axis: Array = field(kw_only=True)
    normal: Array = field(kw_only=True)
    turns: bool = field(kw_only=True)

    def at(self, tip: Components, number: Number, mode: Any, *n: Any) -> tuple[Any, list[Any]]:
        centre, axis = number(self.centre), number(self.axis)
        crossing = dot(axis, n)
        return crossing * crossing, plus(centre, scale(dot(minus(tip, centre), n) / crossing, axis))
