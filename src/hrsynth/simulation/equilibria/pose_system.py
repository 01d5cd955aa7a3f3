"""The error over the platform's pose and what the legs' own joints add: smooth where a leg is at its limit.

Unknown are shifts of the platform's point, a unit quaternion of its turn, and for each leg with a rod on a crank or a
slider, or a rod that slides, the place θ of that joint. The rod's length is an equation g(t, θ) = 0, t its tip; at a
limit, where the leg is *held*, ∂g/∂θ = 0 is one more. All are products and sums with sines and cosines of θ, so that
first and second derivatives are by hand.

A rod that slides through a base point A and turns as it likes has the direction of t − A, which is none at t = A, and
turns fast nearby. Where it is *free*, its length s and its direction u are unknown as well, and t − A = s u, |u| = 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...closed_forms.legs import ClosedFormLeg
from ...geometry.vectors import Array, hat
from ...results import Value
from ...tolerances import CRITICAL_POINT_DISTANCE_TOL
from .pose_error import ObservedDirection, PoseError


@dataclass(frozen=True, eq=False)
class LocalDerivatives:
    """A number (c,) that a tip t (c, 3) and a leg's own j coordinates decide, and its derivatives: by t (c, 3), by
    these (c, j), twice by t (3, 3) each, by both (c, 3, j), twice by these (c, j, j); of one, the j may be missing."""

    value: Array
    t: Array
    o: Any = 0.0
    tt: Any = None
    to: Any = None
    oo: Any = 0.0


@dataclass(frozen=True, eq=False, repr=False)
class Piece(Value):
    """A leg or a direction that the pose turns: its tip is p (where it ``follows``) + ``constant`` + R ``turned``;
    ``place`` is that of its own among the coordinates, None where there are none; ``wanted`` the desired direction."""

    follows: bool
    constant: Array
    bends: Array
    """a = qᵀ bends q is R ``turned``, (3, 4, 4)."""
    limb: ClosedFormLeg | None
    place: slice | None
    held: bool
    seen: ObservedDirection | None
    wanted: Array

    @property
    def is_free_rod(self) -> bool:
        """Return True if it is a rod with its own length and direction."""
        return self.held and self.limb is not None and self.limb.is_free

    def own(self, y: Array) -> Array:
        """Coordinates of the leg (c, j)."""
        return y[:, self.place or slice(0)]

    def direction(self, t: Array, o: Array) -> Array:
        """The observed direction (c, 3)."""
        assert self.seen is not None
        limb, sense = self.limb, self.seen.sense
        if limb is None:
            return t
        if self.is_free_rod:
            return sense * o[:, 1:]
        if not limb.is_free:
            carried = limb.carry(o)[0]
            return sense / (limb.rod or 1.0) * (carried if limb.slides else t - carried)
        way = t - limb.centre
        return sense * limb.mode * way / np.linalg.norm(way, axis=1)[:, None]

    def cosine(self, t: Array, o: Array) -> LocalDerivatives:
        """Return the cosine between the observed direction and the desired one."""
        assert self.seen is not None
        limb, w, sense = self.limb, self.wanted, self.seen.sense
        u = self.direction(t, o)
        c = u @ w
        if limb is None:
            return LocalDerivatives(c, w + 0 * t)
        if self.is_free_rod:
            return LocalDerivatives(c, 0 * t, sense * np.append(0.0, w) + 0 * o, None, None, np.zeros((4, 4)))
        if not limb.is_free:
            k, (_, rate, bend, _) = sense / (limb.rod or 1.0), limb.carry(o)
            by_tip, own = (0.0, k) if limb.slides else (k, -k)
            return LocalDerivatives(c, by_tip * w + 0 * t, own * (rate @ w), None, None, own * (bend @ w))
        size = np.linalg.norm(t - limb.centre, axis=1)[:, None]
        u = sense * limb.mode * u
        c = sense * limb.mode * c
        away = w - c[:, None] * u
        both = u[:, :, None] * away[:, None, :]
        across = np.eye(3) - u[:, :, None] * u[:, None, :]
        twice = -(both + np.swapaxes(both, 1, 2) + c[:, None, None] * across) / size[..., None] ** 2
        k = sense * limb.mode
        return LocalDerivatives(k * c, k * away / size, 0.0, k * twice)

    def equations(self, t: Array, o: Array) -> list[LocalDerivatives]:
        """Return the equations, which vanish at a solution."""
        limb = self.limb
        if self.place is None or limb is None:
            return []
        if self.is_free_rod:
            s, u, eye = o[:, :1], o[:, 1:], np.eye(4)
            found = [
                LocalDerivatives(
                    (_dot(u, u) - 1) / 2, 0 * t, np.append(0 * s, u, axis=1), None, None, np.diag([0.0, 1.0, 1.0, 1.0])
                )
            ]
            found += [
                LocalDerivatives(
                    x,
                    axis + 0 * t,
                    -np.append(u[:, k, None], s * axis, axis=1),
                    None,
                    None,
                    -np.outer(eye[0], eye[k + 1]) - np.outer(eye[k + 1], eye[0]),
                )
                for k, (x, axis) in enumerate(zip((t - limb.centre - s * u).T, np.eye(3), strict=True))
            ]
            return found
        B, rate, bend, third = limb.carry(o)
        if limb.slides:
            way = t - limb.centre
            return [LocalDerivatives(_dot(way, rate) - limb.aside, rate, _dot(way, bend), None, bend, -_dot(way, rate))]
        v, size = t - B, _dot(rate, rate)
        found = [
            LocalDerivatives((_dot(v, v) - limb.rod**2) / 2, v, -_dot(v, rate), np.eye(3), -rate, size - _dot(v, bend))
        ]
        if self.held:
            found.append(
                LocalDerivatives(
                    _dot(v, rate), rate, _dot(v, bend) - size, None, bend, _dot(v, third) - 3 * _dot(rate, bend)
                )
            )
        return found


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((a * b).sum(axis=-1))


@dataclass(frozen=True, eq=False, repr=False)
class LegSystem(Value):
    """Observed legs, and those that are ``held`` at their limits or, of sliding rods, free."""

    error: PoseError
    held: tuple[int, ...]
    pieces: tuple[Piece, ...]
    quaternion: slice
    size: tuple[int, int]
    """Coordinates and equations."""

    @classmethod
    def of(cls, error: PoseError, held: tuple[int, ...]) -> LegSystem:
        """Build the system of an error to a goal."""
        k, m = error.shifts.shape[1], error.turns.shape[1]
        quaternion = slice(k, k + (m + 1 if m else 0))
        pieces, place, count = list[Piece](), quaternion.stop, 1 if m else 0
        goal = error.p, error.R.ravel()
        watched = {each.limb: each for each in error.seen if each.limb is not None}
        rules = [(None, each) for each in error.seen if each.limb is None]
        for i, seen in [*((i, watched.get(i)) for i in range(len(error.limbs)) if i in watched or i in held), *rules]:
            limb = None if i is None else error.limbs[i]
            point = seen.rule if limb is None and seen is not None else limb.tip if limb is not None else None
            assert point is not None
            free = i in held and limb is not None and limb.is_free
            joint = 4 if free else int(limb is not None and not limb.is_free)
            wanted = np.zeros(3) if seen is None else np.array(error._direction(seen, *goal, lambda value: value))
            pieces.append(
                Piece(
                    point.follows,
                    point.constant,
                    bends(error.R @ point.turned, error.turns),
                    limb,
                    slice(place, place + joint) if joint else None,
                    i in held,
                    seen,
                    wanted,
                )
            )
            place += joint
            count += joint + (i in held and not free)
        order = {each: number for number, each in enumerate(error.seen)}
        pieces.sort(key=lambda each: len(order) if each.seen is None else order[each.seen])
        return cls(error, held, tuple(pieces), quaternion, (place, count))

    @cached_property
    def holding(self) -> list[int]:
        """Rows of the held rods' length multipliers; at zero, the rod is inactive."""
        counts = [4 if each.is_free_rod else (each.place is not None) + each.held for each in self.pieces]
        ends = np.cumsum(counts) + (self.quaternion.stop > self.quaternion.start)
        return [int(end) - 2 for each, end in zip(self.pieces, ends, strict=True) if each.held and not each.is_free_rod]

    @property
    def free(self) -> list[Piece]:
        """The rods with a length and a direction of their own."""
        return [each for each in self.pieces if each.is_free_rod]

    @cached_property
    def wanted(self) -> Array:
        """The desired directions (legs, 3)."""
        return np.stack([each.wanted for each in self.pieces if each.seen is not None])

    @cached_property
    def span(self) -> Array:
        """The quaternions (4, m + 1) whose vector is in the span of the turns."""
        return _quaternions(self.error.turns)

    def at(self, values: Sequence[Any]) -> PoseEquations:
        """All of it at values (N,) of (c,) each."""
        return PoseEquations(self, np.stack(values, -1))

    def point(self, y: Array) -> Array:
        """The platform's point (c, 3) at coordinates (c, N), characteristic lengths."""
        return np.asarray(self.error.p + y[:, : self.quaternion.start] @ self.error.shifts.T)

    def tip(self, piece: Piece, y: Array) -> Array:
        """Return the tip of a leg (c, 3)."""
        q = y[:, self.quaternion]
        arm = np.einsum("kij,ci,cj->ck", piece.bends, q, q) if q.shape[1] else piece.bends[:, 0, 0]
        return np.asarray((self.point(y) if piece.follows else 0.0) + piece.constant + arm + np.zeros((len(y), 3)))

    def rotation(self, y: Array) -> Array:
        """The platform's rotation (c, 3, 3)."""
        q = y[:, self.quaternion]
        if not q.shape[1]:
            return np.broadcast_to(self.error.R, (len(y), 3, 3))
        forms = np.stack([bends(column, self.error.turns) for column in self.error.R.T])
        return np.asarray(np.einsum("akij,ci,cj->cka", forms, q, q))

    def directions(self, y: Array) -> Array:
        """The observed ones (c, legs, 3)."""
        return np.stack(
            [piece.direction(self.tip(piece, y), piece.own(y)) for piece in self.pieces if piece.seen is not None],
            axis=1,
        )

    def is_reached(self, y: Array) -> NDArray[np.bool_]:
        """Return True where all other legs reach, and no fixed leg's crank is free because its tip is on its axis,
        (c,)."""
        error, good = self.error, np.ones(len(y), dtype=bool)
        for piece in self.pieces:
            if piece.held and not piece.is_free_rod:
                good &= np.abs(piece.equations(self.tip(piece, y), piece.own(y))[1].o) > CRITICAL_POINT_DISTANCE_TOL
        own = {id(each.limb) for each in self.pieces if each.place is not None}
        p, R = self.point(y), self.rotation(y)
        for limb in error.limbs:
            if id(limb) not in own:
                tip = limb.tip.constant + p + R @ limb.tip.turned
                with np.errstate(invalid="ignore", divide="ignore"):
                    margin = limb.at(list(tip.T), lambda value: value, limb.mode)[0]
                good &= np.broadcast_to(margin > 0, len(y))
        return good

    def about_legs(self, x: Array, reach: float, rng: np.random.Generator) -> Array:
        """Coordinates of poses (n, k) so that a random leg's joint is anywhere (a slider within ``reach``), and its rod
        has any direction, one that slides any length, often a short one; the turn is kept."""
        legs = self.free or [each for each in self.pieces if each.limb is not None]
        x, k = x.copy(), self.quaternion.start
        x[:, self.quaternion] /= np.maximum(np.linalg.norm(x[:, self.quaternion], axis=1, keepdims=True), 1e-300)
        for some, piece in zip(np.array_split(np.arange(len(x)), max(len(legs), 1)), legs, strict=False):
            limb, o = piece.limb, rng.uniform(-1, 1, (len(some), 1))
            way = rng.normal(size=(len(some), k)) @ self.error.shifts.T
            way /= np.linalg.norm(way, axis=1)[:, None]
            assert limb is not None
            if limb.slides:
                tip = limb.centre + reach * o**3 * way
            else:
                tip = limb.carry(o * (np.pi if limb.radius else reach))[0] + limb.rod * way
            x[some, :k] += (tip - self.tip(piece, x[some])) @ self.error.shifts
        return x

    def draw(self, x: Array, rng: np.random.Generator) -> Array:
        """Coordinates (c, N) about those of poses (n, k), in random working modes: those in reach, held legs along the
        way from their centre to the tip."""
        count, q = len(x), x[:, self.quaternion]
        y = np.concatenate([x, np.zeros((count, self.size[0] - x.shape[1]))], axis=1)
        y[:, self.quaternion] /= np.maximum(np.linalg.norm(q, axis=1, keepdims=True), 1e-300)
        good = np.ones(count, dtype=bool)
        for piece in (each for each in self.pieces if each.place is not None):
            tip, limb = self.tip(piece, y), piece.limb
            assert limb is not None
            assert piece.place is not None
            way = tip - limb.centre
            if piece.is_free_rod:
                # any direction: where the rod is short, the way is soon along it
                u = rng.normal(size=way.shape)
                u /= np.linalg.norm(u, axis=1)[:, None]
                y[:, piece.place] = np.append(_dot(way, u)[:, None], u, axis=1)
                continue
            if not piece.held:
                with np.errstate(invalid="ignore", divide="ignore"):
                    margin, carried = limb.at(list(tip.T), lambda value: value, rng.choice([-1.0, 1.0], count))
                good &= margin > 0
                way = np.array(carried).T - (0.0 if limb.slides else limb.centre)
            assert limb.joint is not None
            y[:, piece.place.start] = limb.joint.locate(way)
            if piece.held and limb.radius:
                y[:, piece.place.start] += np.pi * rng.integers(2, size=count)
        return y[good & self.is_reached(y)]


class PoseEquations:
    """E and the equations at coordinates y (c, N), as :class:`.CriticalPointEquations` has them."""

    def __init__(self, system: LegSystem, y: Array) -> None:
        self.system, self.y = system, y
        c, n = y.shape
        k, quaternion = system.quaternion.start, system.quaternion
        q = y[:, quaternion]
        G, DG, self.E, self.slope = [], [], np.zeros(c), np.zeros((c, n))
        if q.shape[1]:
            G.append((_dot(q, q) - 1) / 2)
            DG.append(np.zeros((c, n)))
            DG[0][:, quaternion] = q
        self.parts: list[tuple[Piece, Array, LocalDerivatives | None, Array, list[LocalDerivatives]]] = []
        for piece in system.pieces:
            t, o = system.tip(piece, y), piece.own(y)
            T = np.zeros((c, 3, n))
            if piece.follows:
                T[:, :, :k] = system.error.shifts
            if q.shape[1]:
                T[:, :, quaternion] = 2 * np.einsum("kij,ci->ckj", piece.bends, q)
            cosine, along = None, np.zeros((c, n))
            if piece.seen is not None:
                cosine = piece.cosine(t, o)
                along = _along(cosine, T, piece.place)
                self.E = self.E + (1 - cosine.value**2) / 2
                self.slope -= cosine.value[:, None] * along
            equations = piece.equations(t, o)
            G += [each.value for each in equations]
            DG += [_along(each, T, piece.place) for each in equations]
            self.parts.append((piece, T, cosine, along, equations))
        self.G = np.stack(G, -1) if G else np.zeros((c, 0))
        self.DG = np.stack(DG, 1) if DG else np.zeros((c, 0, n))

    def bend(self, multipliers: Array) -> Array:
        """The Hessian (c, N, N) of E + μ · G."""
        c, n = self.y.shape
        place, number, H = self.system.quaternion, 0, np.zeros((c, n, n))
        if place.stop > place.start:
            H[:, place, place] += multipliers[:, 0, None, None] * np.eye(place.stop - place.start)
            number = 1
        for piece, T, cosine, along, equations in self.parts:
            weighed = [(multipliers[:, number + k], each) for k, each in enumerate(equations)]
            number += len(equations)
            if cosine is not None:
                weighed.append((-cosine.value, cosine))
                H -= along[:, :, None] * along[:, None, :]
            pull = sum(weight[:, None] * each.t for weight, each in weighed)
            if place.stop > place.start:
                H[:, place, place] += 2 * np.einsum("ck,kij->cij", pull, piece.bends)
            twice = [weight[:, None, None] * each.tt for weight, each in weighed if each.tt is not None]
            if twice:
                H += np.swapaxes(T, 1, 2) @ sum(twice) @ T
            if piece.place is not None:
                j = piece.place.stop - piece.place.start
                for weight, each in weighed:
                    if each.to is not None:
                        mixed = weight[:, None, None] * np.einsum("ckj,ckn->cjn", each.to.reshape(c, 3, j), T)
                        H[:, piece.place] += mixed
                        H[:, :, piece.place] += np.swapaxes(mixed, 1, 2)
                    H[:, piece.place, piece.place] += weight[:, None, None] * np.reshape(each.oo, (-1, j, j))
        return H


def _along(local: LocalDerivatives, T: Array, place: slice | None) -> Array:
    """Return the gradient (c, N)."""
    found = np.einsum("ck,ckn->cn", local.t, T)
    if place is not None:
        found[:, place] += np.reshape(local.o, (-1, place.stop - place.start))
    return np.asarray(found)


def _quaternions(turns: Array) -> Array:
    """Return the quaternions (4, m + 1) whose vector is in the span of rotations (3, m)."""
    basis = np.zeros((4, turns.shape[1] + 1))
    basis[0, 0], basis[1:, 1:] = 1.0, turns
    return basis


def bends(h: Array, turns: Array) -> Array:
    """R h as quadratic forms (3, m + 1, m + 1) of a quaternion whose vector is in the span of turns (3, m)."""
    form = np.zeros((3, 4, 4))
    form[:, 0, 0] = h
    form[:, 0, 1:] = form[:, 1:, 0] = -hat(h)
    form[:, 1:, 1:] = -h[:, None, None] * np.eye(3)
    for k in range(3):
        form[k, 1 + k, 1:] += h
        form[k, 1:, 1 + k] += h
    basis = _quaternions(turns)
    return np.asarray(np.einsum("kij,ia,jb->kab", form, basis, basis))
