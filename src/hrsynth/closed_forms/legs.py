"""Legs in closed form: the tip, a point of the platform, decides what the leg does, and whether it reaches at all.

A leg carries one thing that its tip C decides: the end B of a crank or of a slider, from which a rod leads to C, or the
direction of a rod that slides. ``mode`` ±1, the working mode, selects one of two solutions. The *reach margin* is
positive as long as the leg reaches its tip, and vanishes where the two solutions meet (Type 1). Points in base axes.

A rod of constant length from B to the tip C has u = ±(C − B) / |BC|. C moves with y = v + ω × R b. B moves along the
tangent t of its circle or line, so fast that the rod keeps its length, u·(y − t s) = 0, and u̇ = ±(y − t s) / |BC|. The
rod of a leg that changes its length is the same with t = u.

The formulas are on components: numbers, arrays, balls, or symbols of a tape. A method ``at`` makes components of the
leg's numbers by ``number``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..geometry.balls import Field, widen
from ..geometry.components import (
    Components,
    cosine,
    cross,
    dot,
    minus,
    plus,
    scale,
    sine,
    sqrt,
    transform_vector,
)
from ..geometry.so3 import convert_vectors_to_rotations
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
class LegJoint:
    """Joint of a leg at the base with coordinate z: it carries the vector f, ``size`` times a unit vector that turns
    from ``start`` about ``axis``, or ``size`` z along ``axis`` where ``start`` is None. ``period``: of the closed leg.
    """

    axis: Array
    start: Array | None = None
    size: float = 1.0
    period: float = np.inf

    @classmethod
    def turning(cls, axis: Array, size: float = 1.0, period: float = 2 * np.pi) -> LegJoint:
        """Build a joint that turns, from some direction across its axis."""
        return cls(axis, np.linalg.svd(axis[None])[2][1], size, period)

    @property
    def ahead(self) -> Array:
        """The direction a quarter of a turn after the start."""
        assert self.start is not None
        return np.cross(self.axis, self.start)

    def carry(self, z: Any, number: Number) -> tuple[list[Any], list[Any]]:
        """f, and the unit vector along its rate."""
        if self.start is None:
            return scale(z, number(self.size * self.axis)), number(self.axis)
        start, ahead, c, s = self.start, self.ahead, cosine(z), sine(z)
        return (
            plus(scale(c, number(self.size * start)), scale(s, number(self.size * ahead))),
            minus(scale(c, number(ahead)), scale(s, number(start))),
        )

    def derive(self, z: Array) -> list[Array]:
        """f (c, 3) and three derivatives, at numbers z (c, 1)."""
        if self.start is None:
            f, still = z * (self.size * self.axis), 0 * z * self.axis
            return [f, self.size * self.axis + still, still, still]
        c, s = np.cos(z), np.sin(z)
        f, rate = self.size * (c * self.start + s * self.ahead), self.size * (c * self.ahead - s * self.start)
        return [f, rate, -f, -rate]

    def locate(self, f: Array) -> Array:
        """The coordinates (c,) at which the carried vector is along some (c, 3)."""
        return f @ self.axis if self.start is None else np.arctan2(f @ self.ahead, f @ self.start)


@dataclass(frozen=True, eq=False)
class RodMotion:
    """A leg's reach margin, its observed direction u, and how u changes while the tip moves with y:
    u̇ = gain (y − slip (u·y) / along), ``along`` vanishing at the leg's limit."""

    margin: Any
    u: Components
    gain: Any
    slip: Components
    along: Any

    def rate(self, y: Components) -> list[Any]:
        """u̇."""
        return minus(scale(self.gain, y), scale(dot(self.u, y), scale(self.gain / self.along, self.slip)))


@dataclass(frozen=True, eq=False)
class ClosedFormLeg:
    """Leg's path from the base to a tip."""

    record: ClassVar[tuple[str, ...]] = ()
    """Kind of the leg in certificates, and the names of its numbers there; empty for what these do not know."""
    slides: ClassVar[bool] = False
    """True for a rod that slides along its own line, so that what the tip decides is its direction."""

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
    axis: Array | None = field(default=None, kw_only=True)
    """Direction of the crank's axis, of the rail, or of a sliding rod's R on the base; or the observed one."""
    radius: float = field(default=0.0, kw_only=True)
    """Length of the crank, 0 where B is on no circle."""
    rod: float = field(default=0.0, kw_only=True)
    """Length of the rod, 0 where it is not constant."""
    aside: float = field(default=0.0, kw_only=True)
    """Distance at which a sliding rod's line passes ``centre``."""
    pivot: Array | None = field(default=None, kw_only=True)
    """Axis of the crank, where it is not ``axis``."""

    @property
    def can_reverse(self) -> bool:
        """Return True for a rod whose line passes a base point: it reverses there, and either direction fits."""
        return False

    def at(self, tip: Components, number: Number, mode: Any, R: Components = ()) -> tuple[Any, list[Any]]:
        """The reach margin and what the tip decides, on components; R (9, by rows) is the platform's rotation."""
        raise NotImplementedError

    @property
    def is_free(self) -> bool:
        """Return True for a rod that slides through a base point and rotates freely."""
        return False

    @property
    def joint(self) -> LegJoint | None:
        """The joint at the base whose coordinate closes the leg; None where there is none, or the tip does not decide
        about what it turns."""
        return None

    def carry(self, z: Array) -> list[Array]:
        """Return the part of the tip's values that the joint determines at z (c, 1): (c, 3), and three derivatives."""
        assert self.joint is not None
        return self.joint.derive(z)

    @property
    def reach(self) -> float | None:
        """The largest distance of the tip from ``centre``, or from the slide's line; None where there is none."""
        return None

    def close(self, way: Components, w: Any, z: Any, number: Number) -> tuple[Any, list[Any]]:
        """Return what vanishes where the joint at z closes the leg, and the rod's direction there; ``way`` from
        ``centre`` to the tip is ``w`` times as long."""
        raise NotImplementedError

    def turning_about(self, axis: Array) -> ClosedFormLeg:
        """Return the leg with an axis at the base, for a rod that has none."""
        return self

    def solve(self, tip: Field, mode: Field | float) -> tuple[Field, Field]:
        """The reach margin (n,) and what the tip decides (n, 3), for tips (n, 3) of numbers or balls."""
        margin, carried = self.at(list(np.moveaxis(tip, -1, 0)), lambda value: _as_number(value, tip), mode)
        return margin, np.stack(np.broadcast_arrays(*carried), -1)

    def along(self, tip: Components, carried: Components, R: Components = ()) -> Components:
        """A vector along the rod, where the tip decides ``carried``."""
        return carried

    def observe(self, tip: Components, number: Number, sense: float) -> RodMotion:
        """The observed direction, of this sense, and how it follows the tip."""
        raise NotImplementedError

    def rates(
        self, p: Components, R: Components, twists: Sequence[tuple[Components, Components]], number: Number
    ) -> tuple[Any, Components, list[list[Any]]]:
        """The reach margin, u, and u̇ for each of some twists (v, ω) of the platform's point at its pose."""
        arm = transform_vector(R, number(self.tip.turned))
        D = plus(plus(p, arm), number(self.tip.constant - self.centre))
        seen = replace(self, centre=np.zeros(3)).observe(D, number, self.sense)
        return seen.margin, seen.u, [seen.rate(plus(v, cross(w, arm))) for v, w in twists]

    def pose(self, p: Array, R: Array) -> tuple[Array, NDArray[np.bool_], Array | None]:
        """The observed direction u (n, 3) at poses (n, 3), (n, 3, 3), where the leg reaches (n,), and B (n, 3), no
        number where it does not; None where there is no B."""
        raise NotImplementedError

    def oriented(self, p: Array, R: Array, u: Array, carried: Array) -> ClosedFormLeg | None:
        """The leg where directions u (m, 3) are its observed ones at poses, ``carried`` (m, 3) what its tips decide: in
        the sense that these show, and in the working mode of the first; else None."""
        observed, reached, _ = self.pose(p, R)
        return self if np.max(np.abs(observed - u)) <= HIDDEN_ROBOT_RESIDUAL_TOL and reached.all() else None

    def displace(self, B: Array | None, n: int) -> Array:
        """The displacements (n, 4, 4) from zero that bring the link with B there."""
        X = np.tile(np.eye(4), (n, 1, 1))
        if B is not None and self.radius:
            a = np.asarray(self.axis if self.pivot is None else self.pivot)
            start, arm = self.place - self.centre, B - self.centre
            angle = np.arctan2(arm @ np.cross(a, start), arm @ start)
            X[:, :3, :3] = convert_vectors_to_rotations(angle[:, None] * a)
            X[:, :3, 3] = self.centre - X[:, :3, :3] @ self.centre
        elif B is not None:
            X[:, :3, 3] = B - self.place
        return X

    def modes(self, tip: Array, carried: Array) -> Array:
        """The working modes (n,) in which tips and what they decide (n, 3) go together."""
        with np.errstate(invalid="ignore", divide="ignore"):
            one, other = (self.solve(tip, sign)[1] for sign in (1.0, -1.0))
        return np.where(np.linalg.norm(one - carried, axis=1) <= np.linalg.norm(other - carried, axis=1), 1.0, -1.0)


@dataclass(frozen=True, eq=False)
class Rod(ClosedFormLeg):
    """A rod whose direction or end the tip decides, in one of two working modes."""

    def oriented(self, p: Array, R: Array, u: Array, carried: Array) -> ClosedFormLeg | None:
        tip = self.tip.value(p, R)
        rods = np.array(self.along(tip, carried)) / (self.rod or 1.0)
        with np.errstate(invalid="ignore", divide="ignore"):
            if not np.any(self.solve(tip, 1.0)[0] > HIDDEN_ROBOT_RESIDUAL_TOL**2):
                return None  # a tip that is always on the leg's axis decides nothing
        for sense in (1.0, -1.0):
            if np.max(np.abs(sense * rods - u)) <= 10 * HIDDEN_ROBOT_RESIDUAL_TOL:
                return replace(self, sense=sense, mode=float(self.modes(tip[:1], carried[:1])[0]))
        return None


@dataclass(frozen=True, eq=False)
class OnRod(Rod):
    """A rod of constant length from B to the tip."""

    axis: Array = field(kw_only=True)
    rod: float = field(kw_only=True)

    def close(self, way: Components, w: Any, z: Any, number: Number) -> tuple[Any, list[Any]]:
        assert self.joint is not None
        carried, joint = self.joint.carry(z, number)[0], self.joint
        rod = minus(way, carried)
        if joint.start is None:
            g = dot(rod, rod) - number(self.rod**2)
        else:
            # multiplied out: the square of what turns is known
            g = dot(way, way) - number(self.rod**2 - joint.size**2) - 2.0 * dot(way, carried)
        return g * 0.5, scale(number(1 / self.rod), rod)

    def carry(self, z: Array) -> list[Array]:
        f, *rates = super().carry(z)
        return [self.centre + f, *rates]

    def along(self, tip: Components, carried: Components, R: Components = ()) -> Components:
        return minus(tip, carried)

    def tangent(self, B: Components, number: Number) -> Components:
        """The way in which B moves."""
        return number(self.axis)

    def observe(self, tip: Components, number: Number, sense: float) -> RodMotion:
        margin, B = self.at(tip, number, self.mode)
        gain = sense / number(self.rod)
        # t · u is ∓ √margin / rod
        along = (-self.mode) * (gain * sqrt(margin))
        return RodMotion(margin, scale(gain, minus(tip, B)), gain, self.tangent(B, number), along)

    def pose(self, p: Array, R: Array) -> tuple[Array, NDArray[np.bool_], Array | None]:
        tip = self.tip.value(p, R)
        margin, B = self.solve(tip, self.mode)
        return (tip - B) * (self.sense / self.rod), margin > 0, B


def _as_number(value: Any, like: Field) -> Any:
    """A number or vector of the geometry, for numbers; among balls, one that holds what it was rounded from."""
    if like.dtype != object:
        return value
    found = widen(np.asarray(value, dtype=object), HIDDEN_ROBOT_RESIDUAL_TOL)
    return found[()] if found.ndim == 0 else found


@dataclass(frozen=True, eq=False)
class OnCrank(OnRod):
    """B is the end of a crank of length ``radius``, which turns about ``axis`` through ``centre``."""

    record = ("crank", "axis", "radius", "rod")
    radius: float = field(kw_only=True)

    @cached_property
    def joint(self) -> LegJoint:
        return LegJoint.turning(self.axis, self.radius)

    @property
    def reach(self) -> float:
        return self.rod + self.radius

    def at(self, tip: Components, number: Number, mode: Any, R: Components = ()) -> tuple[Any, list[Any]]:
        centre = number(self.centre)
        margin, spoke = rod_on_crank(minus(tip, centre), number(self.axis), number(self.radius), number(self.rod), mode)
        return margin, plus(centre, spoke)

    def tangent(self, B: Components, number: Number) -> Components:
        return cross(number(self.axis), minus(B, number(self.centre)))


@dataclass(frozen=True, eq=False)
class OnRail(OnRod):
    """B is on a slider: at ``centre`` + s ``axis``."""

    record = ("rail", "axis", "rod")

    @cached_property
    def joint(self) -> LegJoint:
        return LegJoint(self.axis)

    @property
    def reach(self) -> float:
        return self.rod

    def at(self, tip: Components, number: Number, mode: Any, R: Components = ()) -> tuple[Any, list[Any]]:
        centre = number(self.centre)
        margin, way = rod_on_rail(minus(tip, centre), number(self.axis), number(self.rod), mode)
        return margin, plus(centre, way)


@dataclass(frozen=True, eq=False)
class SlidingRod(Rod):
    """A rod that slides along its own line, which passes the base point ``centre`` at the distance ``aside`` (on the
    side of axis × direction, where the leg turns about a base ``axis``): its direction u."""

    record = ("slide", "axis", "aside")
    slides = True

    @property
    def is_free(self) -> bool:
        return self.axis is None

    @cached_property
    def joint(self) -> LegJoint | None:
        # a rod through a point may point either way
        return None if self.axis is None else LegJoint.turning(self.axis, period=2 * np.pi if self.aside else np.pi)

    def close(self, way: Components, w: Any, z: Any, number: Number) -> tuple[Any, list[Any]]:
        assert self.joint is not None
        carried, across = self.joint.carry(z, number)
        return dot(way, across) - w * number(self.aside), carried

    def turning_about(self, axis: Array) -> ClosedFormLeg:
        return replace(self, axis=axis) if self.axis is None else self

    @property
    def can_reverse(self) -> bool:
        return not self.aside

    def at(self, tip: Components, number: Number, mode: Any, R: Components = ()) -> tuple[Any, list[Any]]:
        axis = None if self.axis is None else number(self.axis)
        return sliding_rod(minus(tip, number(self.centre)), axis, number(self.aside), mode)

    def observe(self, tip: Components, number: Number, sense: float) -> RodMotion:
        margin, carried = self.at(tip, number, self.mode)
        u = scale(sense, carried)
        return RodMotion(margin, u, (sense * self.mode) / sqrt(margin), u, 1.0)

    def pose(self, p: Array, R: Array) -> tuple[Array, NDArray[np.bool_], Array | None]:
        margin, carried = self.solve(self.tip.value(p, R), self.mode)
        return self.sense * carried, margin > 0, None


@dataclass(frozen=True, eq=False)
class FixedDirection(ClosedFormLeg):
    """A direction that never changes: u = ``axis``."""

    axis: Array = field(kw_only=True)

    def at(self, tip: Components, number: Number, mode: Any, R: Components = ()) -> tuple[Any, list[Any]]:
        return 1.0, number(self.axis)

    def rates(
        self, p: Components, R: Components, twists: Sequence[tuple[Components, Components]], number: Number
    ) -> tuple[Any, Components, list[list[Any]]]:
        return 1.0, number(self.axis), [[0.0, 0.0, 0.0]] * len(twists)

    def pose(self, p: Array, R: Array) -> tuple[Array, NDArray[np.bool_], Array | None]:
        return np.broadcast_to(self.axis, p.shape), np.ones(len(p), dtype=bool), None


@dataclass(frozen=True, eq=False)
class PlatformDirection(ClosedFormLeg):
    """A direction that turns with the platform: u = R ``axis``. Where there is a ``radius``, B is the end of a crank of
    the base (``centre``, ``pivot``) on the platform's line through the tip along u; else the tip itself."""

    axis: Array = field(kw_only=True)

    def at(self, tip: Components, number: Number, mode: Any, R: Components = ()) -> tuple[Any, list[Any]]:
        """|B − centre| = radius: sphere and line."""
        if not self.radius:
            return 1.0, list(tip)
        centre, radius, u = number(self.centre), number(self.radius), transform_vector(R, number(self.axis))
        D = minus(tip, centre)
        away = dot(D, u)
        margin = radius * radius - dot(D, D) + away * away
        return margin, plus(tip, scale(mode * sqrt(margin) - away, u))

    def along(self, tip: Components, carried: Components, R: Components = ()) -> Components:
        return transform_vector(R, self.axis)

    def rates(
        self, p: Components, R: Components, twists: Sequence[tuple[Components, Components]], number: Number
    ) -> tuple[Any, Components, list[list[Any]]]:
        u = transform_vector(R, number(self.axis))
        D = plus(plus(p, transform_vector(R, number(self.tip.turned))), number(self.tip.constant - self.centre))
        margin = replace(self, centre=np.zeros(3)).at(D, number, self.mode, R)[0]
        return margin, u, [cross(w, u) for _, w in twists]

    def pose(self, p: Array, R: Array) -> tuple[Array, NDArray[np.bool_], Array | None]:
        tip, reached = self.tip.value(p, R), np.ones(len(p), dtype=bool)
        if not self.radius:
            return R @ self.axis, reached, None
        margin, B = self.at(tip.T, lambda value: value, self.mode, R.reshape(-1, 9).T)
        return R @ self.axis, margin > 0, np.stack(B, 1)


@dataclass(frozen=True, eq=False)
class RailAndLine(ClosedFormLeg):
    """B is at ``centre`` + s ``axis`` and on a line through the tip, in the plane of both; ``normal`` to it, in the
    base, or in the platform where it ``turns``: s = n·(C − centre) / n·axis."""

    axis: Array = field(kw_only=True)
    normal: Array = field(kw_only=True)
    turns: bool = field(kw_only=True)

    def at(self, tip: Components, number: Number, mode: Any, R: Components = ()) -> tuple[Any, list[Any]]:
        centre, axis, n = number(self.centre), number(self.axis), number(self.normal)
        n = transform_vector(R, n) if self.turns else n
        crossing = dot(axis, n)
        return crossing * crossing, plus(centre, scale(dot(minus(tip, centre), n) / crossing, axis))
