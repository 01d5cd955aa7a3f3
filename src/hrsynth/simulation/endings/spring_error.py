"""Rests of a platform that moves as it likes on three watched rods that slide, as equilibria of springs.

Rod i goes from a base point a_i to a point b_i of the platform, along u_i; c_i = u_i · u_i*. E = ½ Σ (1 − c_i²) pulls
at b_i with f_i = c_i (u_i* − c_i u_i) / |b_i − a_i|. With t_i = c_i / |b_i − a_i| and H_i = a_i + u_i* / t_i, a point of
the desired line, this is t_i² (H_i − b_i), a spring of no length; and f_i · (b_i − a_i) = 0. Three forces that balance
each other on a body lie in the plane m · x = d of their points b_i. So where no c_i vanishes it holds all H_i, and
tells t_i = m · u_i* / (d − m · a_i). Springs in this plane tell the platform's place there, and its angle ψ but for
half a turn. Three unknowns are left, two of m and d, for the three equations f_i · (b_i − a_i) = 0.

Coordinates: the components of m but that which is 1; d, or for planes far away w = 1 / d; α_i, whose tangents are t_i,
or t_i / w; ψ. Nothing is special where a plane holds a desired line (α_i is free) or where springs do not tell ψ. Where
a rod is short its equation vanishes by itself: f_i · (u_i* − f_i / t_i) = 0 is asked of the force that the other two
leave, too. Far away the three equations depend on each other: Σ f_i · (R b_i − a_i) = 0 is asked as well.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations, product
from typing import Any

import numpy as np

from ...batch.enclosures import BoxFormula
from ...closed_forms.legs import ClosedFormLeg, SlidingRod
from ...geometry.affine import AffineForms, combine
from ...geometry.components import combination, cosine, dot, minus, plus, scale, sine, sqrt, transform_vector
from ...geometry.so3 import quaternions
from ...geometry.vectors import Array
from ...tolerances import BOX_ROUNDING, EXACT, MET_AGAIN, SAME_ENDING
from .elimination import Flags, Places, away
from .joint_error import JointError, of_robot
from .loop_error import LoopSubdivision, Tell
from .planes import TURNED, PlaneError
from .pose_error import NotEnclosed, Number, PoseError
from .reached import narrow_joint
from .subdivision import CriticalBox, Subdivision, forms_of

NEAREST_FAR = 2.0
"""How far (characteristic lengths) planes are from which on they count as far away."""


@dataclass(frozen=True, eq=False, repr=False)
class SpringError(JointError):
    """The equations in a chart: component ``one`` of m is 1, planes are ``distant`` or not, and the platform's normal
    is ``side`` n."""

    one: int = field(default=0, kw_only=True)
    distant: bool = field(default=False, kw_only=True)
    side: float = field(default=1.0, kw_only=True)

    @classmethod
    def about(cls, error: PoseError) -> SpringError:
        """Those of a pose's error; raises ``NotEnclosed`` where it is not that of three such rods."""
        limbs = [error.limbs[each.limb] for each in error.seen if each.limb is not None]
        if error.size < 6 or len(error.seen) != 3 or len(limbs) != 3 or not all(
                isinstance(each, SlidingRod) and each.aside == 0 and each.axis is None for each in limbs):
            raise NotEnclosed("the platform turns about more than one axis, and not three rods that slide are watched")
        found = cls(error, (), error, shortest=0.0)
        if abs(np.linalg.det(found.desired)) < SAME_ENDING or found.sizes[3] < SAME_ENDING:
            raise NotEnclosed("the watched legs do not tell the platform's plane")
        return found

    @property
    def limbs(self) -> list[SlidingRod]:
        """The watched ones."""
        return [limb for each in self.error.seen if each.limb is not None
                and isinstance(limb := self.error.limbs[each.limb], SlidingRod)]

    @property
    def idle(self) -> list[ClosedFormLeg]:
        """The limbs that are not watched."""
        watched = {each.limb for each in self.error.seen}
        return [each for i, each in enumerate(self.error.limbs) if i not in watched]

    @property
    def flat(self) -> int:
        """How many watched directions are at right angles to the desired ones where rests are not looked at."""
        return 1

    @cached_property
    def desired(self) -> Array:
        """u* (3, 3)."""
        error = self.error
        return np.array([error._direction(each, error.p, error.R.ravel(), lambda value: value) for each in error.seen])

    @cached_property
    def bases(self) -> Array:
        """a (3, 3)."""
        return np.array([each.centre - each.tip.constant for each in self.limbs])

    @cached_property
    def frame(self) -> Array:
        """Axes of the platform (3, 3): along b₂ − b₁, across it in the plane of the b, and normal to it."""
        b = np.array([each.tip.turned for each in self.limbs])
        one, normal = b[1] - b[0], np.cross(b[1] - b[0], b[2] - b[0])
        with np.errstate(all="ignore"):
            one, normal = one / np.linalg.norm(one), normal / np.linalg.norm(normal)
        return np.array([one, np.cross(normal, one), normal])

    @cached_property
    def sizes(self) -> Array:
        """The sides b₁b₂, b₁b₃, b₂b₃ of the triangle, and twice its area over the longest."""
        b = np.array([each.tip.turned for each in self.limbs])
        sides = [float(np.linalg.norm(b[i] - b[j])) for i, j in combinations(range(3), 2)]
        area = float(np.linalg.norm(np.cross(b[1] - b[0], b[2] - b[0])))
        return np.array([*sides, area / max(*sides, EXACT)])

    @property
    def charts(self) -> tuple[JointError, ...]:
        """Those that together hold all planes, and both sides of the platform."""
        return tuple(replace(self, one=one, distant=distant, side=side)
                     for one, distant, side in product(range(3), (False, True), (1.0, -1.0)))

    def list_charts(self, bounded: bool) -> tuple[JointError, ...]:
        return self.charts

    @property
    def ends(self) -> Array:
        return np.zeros((0, 3))

    @property
    def freedoms(self) -> int:
        return 3

    @property
    def size(self) -> tuple[int, int]:
        """Coordinates, and equations that tell α and ψ."""
        return 7, 4

    def enclose_chart(self, middle: Array, half: Array) -> tuple[Array, Array]:
        """Of boxes that are left open it is not told where they are."""
        return np.full((len(middle), 6), -np.inf), np.full((len(middle), 6), np.inf)

    @property
    def periods(self) -> Array:
        """Of what is told of the pose."""
        return np.full(6, np.inf)

    def box(self, low: Array, high: Array, reach: float) -> tuple[Array, Array]:
        most = 1 / NEAREST_FAR if self.distant else NEAREST_FAR
        high = np.array([1.0, 1.0, most, *(np.pi / 2 for _ in range(3)), np.pi])
        return -high, high

    def plane(self, y: Sequence[Any], number: Number) -> tuple[list[Any], list[Any], list[Any]]:
        """m, and of each rod h and m · u*, of planes far away h w."""
        m = list(y[:2])
        m.insert(self.one, number(1.0))
        along = [dot(m, number(each)) for each in self.bases]
        h = [1.0 - y[2] * each if self.distant else y[2] - each for each in along]
        return m, h, [dot(m, number(each)) for each in self.desired]

    def across(self, m: list[Any], number: Number) -> list[list[Any]]:
        """Two unit vectors in the plane, and its normal: the axes, turned by the shortest way to it."""
        size = 1.0 / sqrt(dot(m, m))
        n = scale(size, m)
        eye = number(np.eye(3))
        both = plus(n, eye[self.one])
        return [*(minus(eye[k], scale(n[k] * (1.0 / (1.0 + n[self.one])), both)) for k in self._others), n]

    @property
    def _others(self) -> list[int]:
        return [(self.one + 1) % 3, (self.one + 2) % 3]

    def springs(self, y: Sequence[Any], number: Number) -> dict[str, Any]:
        """In the plane's axes: b from the platform's first point, a, u* (3, 2); sines, cosines of α; weights of b and
        of u*; b − a times w, the moment, forces."""
        m, *_ = self.plane(y, number)
        x1, x2, _ = self.across(m, number)
        w = y[2] if self.distant else number(1.0)
        S, C = [sine(z) for z in y[3:6]], [cosine(z) for z in y[3:6]]
        a = [[dot(x, number(each)) for x in (x1, x2)] for each in self.bases]
        u = [[dot(x, number(each)) for x in (x1, x2)] for each in self.desired]
        K = [C[j] * C[j] * (C[k] * C[k]) for j, k in ((1, 2), (0, 2), (0, 1))]
        weights, pulls = ([s * each * k for s, each, k in zip(S, some, K, strict=True)] for some in (S, C))
        b = self._points(y[6], number)
        whole = weights[0] + weights[1] + weights[2]
        inverse = 1.0 / whole
        place = [inverse * total for total in _sum(
            plus(scale(z, own), scale(w * g, minus(at, point)))
            for z, g, own, at, point in zip(pulls, weights, u, a, b, strict=True))]
        away_ = [plus(place, scale(w, minus(point, at))) for point, at in zip(b, a, strict=True)]
        forces = [minus(scale(z, own), scale(g, each)) for z, g, own, each in zip(
            pulls, weights, u, away_, strict=True)]
        return {"b": b, "a": a, "u": u, "S": S, "C": C, "away": away_, "forces": forces, "place": place, "w": w,
                "weights": weights, "pulls": pulls, "whole": whole}

    def _points(self, angle: Any, number: Number) -> list[list[Any]]:
        """The b in the plane's axes, from the first, turned by ψ."""
        c, s, side, found = cosine(angle), sine(angle), self.side, list[list[Any]]()
        b = np.array([each.tip.turned for each in self.limbs])
        for x, z in (b - b[0]) @ self.frame[:2].T:
            x, z = number(x), number(z)
            found.append([c * x - s * (side * z), s * x + c * (side * z)])
        return found

    def rest(self, y: Sequence[Any], number: Number) -> list[Any]:
        """What is left: of each rod f · (b − a) by its length, and by its force; and Σ f · (R b − a)."""
        at = self.springs(y, number)
        S, C, u, B = (at[name] for name in ("S", "C", "u", "away"))
        found = [s * _dot(each, each) - c * _dot(own, each) for s, c, own, each in zip(S, C, u, B, strict=True)]
        pull = [minus(scale(s * c, own), scale(s * s, each)) for s, c, own, each in zip(S, C, u, B, strict=True)]
        for i in range(3):
            j, k = (each for each in range(3) if each != i)
            left = scale(-1.0, plus(scale(C[k] * C[k], pull[j]), scale(C[j] * C[j], pull[k])))
            both = C[j] * C[j] * (C[k] * C[k])
            found.append(S[i] * both * _dot(u[i], left) - C[i] * _dot(left, left))
        found.append(_total(_dot(f, minus(b, a)) for f, b, a in zip(at["forces"], at["b"], at["a"], strict=True)))
        return found

    def told_joints(self, y: Sequence[Any], number: Number) -> list[Any]:
        """sin α h − cos α m · u*, and the moment of the springs about the platform's place."""
        _, h, along = self.plane(y, number)
        found = [sine(z) * each - cosine(z) * own for z, each, own in zip(y[3:6], h, along, strict=True)]
        across, level = self.turn(y, number)
        return [*found, cosine(y[6]) * across + sine(y[6]) * level]

    def turn(self, y: Sequence[Any], number: Number) -> tuple[Any, Any]:
        """The moment's part with cos ψ, and with sin ψ: of each two rods the sides of the triangle and of the H."""
        at = self.springs([*y[:6], number(0.0)], number)
        S, C, u, b = (at[name] for name in ("S", "C", "u", "b"))
        across, level = list[Any](), list[Any]()
        for i, j in combinations(range(3), 2):
            rest, both = C[3 - i - j], S[i] * S[j]
            ends = plus(scale(at["w"] * both, minus(at["a"][i], at["a"][j])),
                        minus(scale(S[j] * C[i], u[i]), scale(S[i] * C[j], u[j])))
            pull, side = scale(rest * rest * both, ends), minus(b[i], b[j])
            across.append(_cross(side, pull))
            level.append(-_dot(side, pull))
        return _total(across), _total(level)

    @cached_property
    def closing(self) -> BoxFormula:
        return of_robot(self.told_joints, 7)

    @cached_property
    def left(self) -> BoxFormula:
        """What is left beside these."""
        return of_robot(self.rest, 7)

    @cached_property
    def bends(self) -> BoxFormula:
        """The rates of all equations, one after the other."""
        def formula(y: Sequence[Any], known: Number) -> list[Any]:
            x, number = self.unknowns(y, range(7)), self.make_constant(known)
            return [rate for each in (*self.told_joints(x, number), *self.rest(x, number)) for rate in each.rates]

        return of_robot(formula, 7)

    def over_pose(self, one: int) -> PlaneError:
        """The same error over the pose, in the chart of its turn in which a component of the quaternion is 1."""
        error = self.error
        return PlaneError(error, (), error, shortest=0.0, offset=np.zeros(3), follow=np.zeros((3, 9)),
                          along=error.shifts, span=np.eye(4), forms=np.zeros((0, 4, 4)), one=one)

    def tell_pose(self, one: int) -> BoxFormula:
        """Its coordinates there."""
        def formula(y: Sequence[Any], number: Number) -> list[Any]:
            at, (m, *_) = self.springs(y, number), self.plane(y, number)
            x1, x2, n = self.across(m, number)
            c, s, error = cosine(y[6]), sine(y[6]), self.error
            axes = [plus(scale(c, x1), scale(s, x2)),
                    scale(self.side, minus(scale(c, x2), scale(s, x1))), scale(self.side, n)]
            # R by rows, from the axes of the platform
            R = [_total(axis[i] * number(own[j]) for axis, own in zip(axes, self.frame, strict=True))
                 for i in range(3) for j in range(3)]
            near = sqrt(dot(m, m))
            scaled = 1.0 / y[2] if self.distant else number(1.0)
            depth = (scaled if self.distant else y[2]) * (1.0 / near)
            point = plus(scale(scaled, plus(scale(at["place"][0], x1), scale(at["place"][1], x2))), scale(depth, n))
            point = minus(minus(point, transform_vector(R, number(self.limbs[0].tip.turned))), number(error.p))
            parts = [combination([*R, number(1.0)], row[None], number)[0] for row in PRODUCTS[one]]
            inverse = 1.0 / parts[one]
            return [*(dot(point, number(way)) for way in error.shifts.T),
                    *(inverse * each for k, each in enumerate(parts) if k != one)]

        return of_robot(formula, 7)

    @cached_property
    def ways(self) -> BoxFormula:
        """h and m · u* of each rod."""
        def formula(y: Sequence[Any], number: Number) -> list[Any]:
            _, h, along = self.plane(y, number)
            return [each for pair in zip(h, along, strict=True) for each in pair]

        return of_robot(formula, 3)

    @cached_property
    def turns(self) -> BoxFormula:
        """What ψ follows from."""
        return of_robot(self.turn, 6)


PRODUCTS = np.linalg.pinv(np.concatenate([TURNED.reshape(9, 16), np.eye(4).reshape(1, 16)])).reshape(4, 4, 10)
"""Products of two components of a unit quaternion, as forms of R by rows and of 1."""


def _cross(a: Sequence[Any], b: Sequence[Any]) -> Any:
    return a[0] * b[1] - a[1] * b[0]


def _dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    return a[0] * b[0] + a[1] * b[1]


def _total(parts: Any) -> Any:
    first, *rest = parts
    for each in rest:
        first = first + each
    return first


def _sum(parts: Any) -> list[Any]:
    return [_total(each) for each in zip(*parts, strict=True)]


class SpringSubdivision(LoopSubdivision):
    """Boxes of these coordinates."""

    error: SpringError  # type: ignore[assignment]

    def _narrow(self, middle: Array, half: Array) -> tuple[Array, Array]:
        low, high = middle - half, middle + half
        forms = forms_of(middle, half)
        rod = SlidingRod("", self.error.limbs[0].tip, 1.0, centre=np.zeros(3), axis=np.eye(3)[2])
        ways = [(each.low, each.high) for each in self.error.ways.at(forms[:3])]
        for k in range(3):
            i = 3 + k
            low[:, i], high[:, i] = narrow_joint(rod, (0 * low[:, 0], 0 * low[:, 0]), ways[2 * k], ways[2 * k + 1],
                                                 (low[:, i], high[:, i]))
        good = np.all(low <= high, axis=1)
        across, level = ((each.low, each.high) for each in self.error.turns.at(forms[:6]))
        known = good & np.isfinite([*across, *level]).all(axis=0)
        if known.any():
            one = (level[0][known], level[1][known])
            two = (-across[1][known], -across[0][known])
            zero = 0 * one[0]
            low[known, 6], high[known, 6] = narrow_joint(rod, (zero, zero), one, two, (low[known, 6], high[known, 6]))
        low[:, 0] = np.where(self._apart(low, high), np.inf, low[:, 0])
        return low, high

    def _apart(self, low: Array, high: Array) -> Flags:
        """Whether sides of the triangle are too long or too short: b_i is on the sphere over a_i H_i."""
        error = self.error
        found = np.zeros(len(low), dtype=bool)
        with np.errstate(all="ignore"):
            ends = 1 / np.tan(np.stack([low[:, 3:6], high[:, 3:6]]))
            through = (low[:, 3:6] <= 0) & (high[:, 3:6] >= 0)
            lo, hi = np.where(through, -np.inf, ends[1]), np.where(through, np.inf, ends[0])
            if error.distant:
                w = np.stack([low[:, 2], high[:, 2]])
                inv = 1 / w
                bad = (w[0] <= 0) & (w[1] >= 0)
                every = np.stack([t * i[:, None] for t in (lo, hi) for i in inv])
                lo, hi = (np.where(bad[:, None], sign * np.inf, pick(every, axis=0)) for sign, pick in (
                    (-1.0, np.min), (1.0, np.max)))
            for length, (i, j) in zip(error.sizes, combinations(range(3), 2), strict=False):
                middle = error.bases[i] - error.bases[j] + (
                    ((lo + hi)[:, i, None] * error.desired[i] - (lo + hi)[:, j, None] * error.desired[j]) / 4)
                room = (hi - lo)[:, i] / 4 + (hi - lo)[:, j] / 4
                radius = np.maximum(np.abs(lo), np.abs(hi))
                radius = (radius[:, i] + radius[:, j]) / 2 + room
                off = np.linalg.norm(middle, axis=1)
                found |= np.abs(off - length) > (radius + BOX_ROUNDING * (1 + off)) * (1 + BOX_ROUNDING)
        return found

    def _settle(self, tube: list[AffineForms], P: Places, N: Places) -> tuple[Flags, AffineForms]:
        F = self.error.left.together(tube)
        return away(F), F

    def _over_pose(self, x: Array) -> Iterator[tuple[JointError, Tell, Flags]]:
        q = np.abs(quaternions(np.array([self._turn(each) for each in x])))
        for one in range(4):
            own = q.argmax(axis=1) == one
            if own.any():
                told = self.error.tell_pose(one)

                def tell(middle: Array, half: Array, told: BoxFormula = told) -> tuple[Array, Array]:
                    found = told.together(forms_of(middle, half))
                    return found.low, found.high

                yield self.error.over_pose(one), tell, own

    def _turn(self, y: Array) -> Array:
        """R at coordinates (n,)."""
        m, *_ = self.error.plane(list(y), np.asarray)
        x1, x2, n = (np.array(each) for each in self.error.across(m, np.asarray))
        c, s, side = np.cos(y[6]), np.sin(y[6]), self.error.side
        return np.asarray(np.stack([c * x1 + s * x2, side * (c * x2 - s * x1), side * n], axis=1) @ self.error.frame)

    def _excepted(self, over: JointError, y: Array, room: Array) -> Flags:
        """Those at which a watched direction is at right angles to the desired one."""
        u, wanted = over.directions.together(forms_of(y, room)), np.zeros((3, 9))
        for k in range(3):
            wanted[k, 3 * k : 3 * k + 3] = self.error.desired[k]
        return np.asarray(np.any(combine(np.broadcast_to(wanted, (len(y), 3, 9)), u).size < SAME_ENDING, axis=1))

    def _reached(self, part: Subdivision, y: Array, settled: Flags) -> list[CriticalBox]:
        """A rod that slides reaches any place but its own base point."""
        found, error = list[CriticalBox](), self.error.error
        for zero in part.zeros():
            near = 2 * float(zero.radius.max()) + MET_AGAIN
            away_ = [np.linalg.norm(zero.p / error.length + zero.R @ each.tip.turned + each.tip.constant - each.centre)
                     for each in error.limbs]
            if min(away_) > near * (1 + max(float(np.linalg.norm(each.tip.turned)) for each in error.limbs)):
                found.append(zero)
            else:
                settled[:] = False
        return found
