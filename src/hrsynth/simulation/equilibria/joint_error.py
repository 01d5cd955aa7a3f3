"""Error over the platform's pose and the coordinates of the legs' joints at the base, closed by equations: smooth at
all limits of legs.

Coordinates y: shifts of the platform's point, the angle of its turn, and the joint of each leg that has one, by which
the leg states its equation g (:mod:`~...closed_forms.legs`). At a leg's limit g does not change with the leg's
own joint; nothing is singular there but the pose as coordinates.

Where all rods slide, poses may be anywhere: a 3-RPR has an equilibrium 274 lengths away. A chart of those ``far`` away
has P / w in the place of the point, one component of P being 1: with all lengths times w the equations are smooth at
w = 0, and so are rates along (1 / w) ∂/∂ψ, which are taken there. Without, 16 of the 20 equilibria of the RPRPR are
missed, up to 15 lengths away. Of a platform that translates in space on rods that
slide, a chart about a ``short`` one has its length d and its direction u in the place of the point, A + d u, A where
its length vanishes: u = v / |v| with one component of v being 1. E is smooth at d = 0, where the point does not
determine u: a 3-UPU has equilibria there.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import islice, product
from typing import Any

import numpy as np

from ...closed_forms.legs import ClosedFormLeg, LegJoint
from ...equations.box_formula import BoxFormula, trace_formula
from ...geometry.affine import AffineForms
from ...geometry.components import (
    Components,
    combine_columns,
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
from ...geometry.duals import Dual
from ...geometry.so3 import convert_vectors_to_rotations
from ...geometry.vectors import Array, hat
from ...results import Value
from ...tolerances import EXACT_INCIDENCE_TOL, HIDDEN_ROBOT_RESIDUAL_TOL, SLIDING_ROD_LENGTH_MIN
from .joint_bounds import narrow_angle, narrow_travel
from .pose_error import Number, PoseError

FILE_NUMBER_TOL = 1e-12
"""Uncertainty of the file's numbers (lengths in characteristic lengths) in proofs of all equilibria."""

of_robot = partial(trace_formula, off=FILE_NUMBER_TOL)


def rodless(error: PoseError) -> Array:
    """Return the platform's point where each sliding rod in space has no length, (legs, 3)."""
    return np.array([limb.centre - limb.tip.constant - error.R @ limb.tip.turned for limb in error.limbs])


@dataclass(frozen=True, eq=False, repr=False)
class JointError(Value):
    """Error to a goal in these coordinates; ``joints`` are the legs with a joint among them, the others are closed
    forms of the pose; ``far``: the shift that is w in a chart of distant poses; ``short``: the leg that is short in a
    chart about it, and the component of v that is 1. Other rods without a joint must be ``shortest`` long at least; the
    desired directions are those at the ``goal`` (its pose and legs), from which ``error`` may be rotated. If only poses
    without error are searched, the ``square`` observed direction may be at right angles to the desired one instead."""

    error: PoseError
    joints: tuple[int, ...]
    goal: PoseError
    far: int | None = None
    short: tuple[int, int] | None = None
    shortest: float = SLIDING_ROD_LENGTH_MIN
    square: int | None = None

    @classmethod
    def of(
        cls, error: PoseError, goal: PoseError | None = None, shortest: float = SLIDING_ROD_LENGTH_MIN
    ) -> JointError:
        """Build the error about the goal; a sliding rod in a plane rotates about the plane's normal."""
        limbs = tuple(_in_plane(error, limb) for limb in error.limbs)
        joints = tuple(i for i, limb in enumerate(limbs) if limb.joint is not None)
        return cls(replace(error, limbs=limbs), joints, goal or error, shortest=shortest)

    @cached_property
    def feet(self) -> list[LegJoint]:
        """The joints at the base."""
        return [joint for i in self.joints if (joint := self.error.limbs[i].joint) is not None]

    @property
    def is_endless(self) -> bool:
        """Return True if no leg bounds where the platform can be."""
        return all(limb.reach is None for limb in self.error.limbs)

    @property
    def charts(self) -> tuple[JointError, ...]:
        """Charts that together hold all poses: this one, and, where all rods slide, those of distant poses and about
        short rods; else this one alone."""
        if not self.is_endless or any(
            each.limb is None and (each.rule is None or np.any(each.rule.turned)) for each in self.error.seen
        ):
            return (self,)
        about = product(range(len(self.ends)), range(3))
        return (
            self,
            *(replace(self, far=k) for k in range(self.error.shifts.shape[1])),
            *(replace(self, short=each) for each in about),
        )

    def list_charts(self, bounded: bool) -> tuple[JointError, ...]:
        """Return the charts to search, of poses that are ``bounded`` by the legs' reach or not."""
        return (self,) if bounded else self.charts

    @property
    def ends(self) -> Array:
        """Positions of the platform's point, from that of the goal, at which freely rotating sliding rods in space have
        no length, (legs, 3); none where length and direction of one do not determine the platform's position."""
        error = self.error
        if error.shifts.shape[1] != 3 or self.size[0] != 3 or not self.is_endless:
            return np.zeros((0, 3))
        return rodless(error) - error.p

    @property
    def idle(self) -> list[ClosedFormLeg]:
        """Unobserved legs."""
        watched = {each.limb for each in self.error.seen}
        return [each for i, each in enumerate(self.error.limbs) if i not in watched]

    @property
    def shifts(self) -> Array:
        """The basis of shifts (3, k)."""
        return self.error.shifts

    @property
    def freedoms(self) -> int:
        """Coordinates of the pose."""
        return self.error.size

    @property
    def turning(self) -> tuple[int, ...]:
        """Joints of these legs that rotate the platform; and the equations, after all coordinates, that contain these
        alone."""
        return tuple(range(self.error.shifts.shape[1], self.freedoms))

    @property
    def size(self) -> tuple[int, int]:
        """Coordinates and equations."""
        return self.freedoms + len(self.joints), len(self.joints)

    @property
    def periods(self) -> Array:
        """Periods of the coordinates (n,)."""
        shifts, turns = self.error.shifts.shape[1], self.error.turns.shape[1]
        return np.array([*[np.inf] * shifts, *[2 * np.pi] * turns, *(each.period for each in self.feet)])

    def box(self, low: Array, high: Array, reach: float) -> tuple[Array, Array]:
        """The lower and the upper corner of all coordinates, for shifts between two corners, or beyond ``reach``."""
        error, k, most = self.error, self.error.shifts.shape[1], self.periods / 2
        if self.short is not None:
            high = np.array([self.shortest, 1.0, 1.0])
            return -high, high
        if self.far is not None:
            low, high = (sign * np.where(np.arange(k) == self.far, 1 / reach, 1.0) for sign in (-1.0, 1.0))
        low, high = np.concatenate([low[:k], -most[k:]]), np.concatenate([high[:k], most[k:]])
        for place, (i, joint) in enumerate(zip(self.joints, self.feet, strict=True), error.size):
            limb = error.limbs[i]
            if limb.reach is not None and joint.start is None:
                ways = joint.axis @ error.shifts
                middle = joint.axis @ (error.p + limb.tip.constant - limb.centre) + ways @ (low[:k] + high[:k]) / 2
                room = limb.reach + np.linalg.norm(limb.tip.turned) + np.abs(ways) @ (high[:k] - low[:k]) / 2
                room += HIDDEN_ROBOT_RESIDUAL_TOL
                low[place], high[place] = middle - room, middle + room
        return low, high

    def near(self, y: Array) -> Array:
        """Coordinates (…, n) of a chart in the one about the goal, no numbers where w vanishes."""
        y = y.copy()
        if self.short is not None:
            v = np.insert(y[..., 1:], self.short[1], 1.0, axis=-1)
            u = v / np.linalg.norm(v, axis=-1, keepdims=True)
            return np.asarray((self.ends[self.short[0]] + y[..., :1] * u) @ self.error.shifts)
        if self.far is not None:
            w, k = y[..., self.far].copy(), self.error.shifts.shape[1]
            y[..., self.far] = 1.0
            with np.errstate(all="ignore"):
                y[..., :k] /= w[..., None]
        return y

    def enclose_chart(self, middle: Array, half: Array) -> tuple[Array, Array]:
        """Return the box in the chart about the goal that holds boxes (c, n), unbounded where w may vanish."""
        if self.short is not None:
            # |∂u/∂v| ≤ 1
            at, off = self.near(middle), half[:, :1] + (np.abs(middle) + half)[:, :1] * half[:, 1:].sum(1)[:, None]
            return at - off, at + off
        if self.far is None:
            return middle - half, middle + half
        ends = np.stack([self.near(middle + half * signs) for signs in product((-1.0, 1.0), repeat=middle.shape[1])])
        low, high = ends.min(axis=0), ends.max(axis=0)
        k, endless = self.error.shifts.shape[1], np.abs(middle[:, self.far]) <= half[:, self.far]
        low[endless, :k], high[endless, :k] = -np.inf, np.inf
        return low, high

    def pose(self, y: Array) -> tuple[Array, Array]:
        """The platform's point (c, 3), in characteristic lengths, and rotation (c, 3, 3) at coordinates (c, n)."""
        y, k = self.near(y), self.error.shifts.shape[1]
        turn = convert_vectors_to_rotations(y[:, k : self.error.size] @ self.error.turns.T)
        return self.error.p + y[:, :k] @ self.error.shifts.T, turn @ self.error.R

    def unknowns(self, y: Sequence[Any], places: Iterable[int]) -> list[Dual]:
        """Some of the coordinates with their rates."""
        return [Dual(y[i], [float(i == j) for j in range(self.size[0])]) for i in places]

    def make_constant(self, known: Number) -> Number:
        """Return the function that makes numbers with rates, which vanish, of the robot's numbers and lists of them."""
        none = [0.0] * self.size[0]

        def number(value: Any) -> Any:
            return [number(each) for each in value] if np.ndim(value) else Dual(known(value), none)

        return number

    def parts(self, y: Sequence[Any], known: Number) -> tuple[list[Dual], list[Sequence[Dual]], list[Dual]]:
        """Return g, the observed directions, and of legs without a joint the reach margins minus the rod's least length
        (of distant ones times w²), with their rates by the coordinates (n,), which ``known`` makes numbers too."""
        error, number = self.error, self.make_constant(known)
        w, point, turned, u = self._place_platform(y, number)
        g, margins, told = list[Dual](), list[Dual](), list[Sequence[Dual]]()
        least = self.shortest if self.short is None else 0.0
        for i, limb in enumerate(error.limbs):
            if self.short is not None and i == self.short[0]:
                told.append(u)
                continue
            tip = plus(point, scale(w, number(error.p + limb.tip.constant)))
            if np.any(limb.tip.turned):
                tip = plus(tip, transform_vector(turned, number(limb.tip.turned)))
            if i not in self.joints:
                tip = plus(tip, scale(number(1.0) - w, number(limb.centre)))
                margin, carried = limb.at(tip, number, limb.mode)
                margins.append(margin - w * w * number(least**2))
                told.append(carried)
                continue
            (z,) = self.unknowns(y, [self.freedoms + self.joints.index(i)])
            closed, rod = limb.close(minus(tip, scale(w, number(limb.centre))), w, z, number)
            g.append(closed)
            told.append(rod)
        seen = list[Sequence[Dual]]()
        for each in error.seen:
            if each.limb is not None:
                seen.append(scale(each.sense, told[each.limb]))
            elif each.rule is not None:
                seen.append(plus(transform_vector(turned, number(each.rule.turned)), number(each.rule.constant)))
        return g, seen, margins

    def _place_platform(self, y: Sequence[Any], number: Number) -> tuple[Dual, Components, list[Dual], list[Dual]]:
        """w, the shift of the platform's point and the platform's rotation by rows, both times w, and u of a chart
        about a short rod."""
        k, x = self.shifts.shape[1], self.unknowns(y, range(self.freedoms))
        w, place = number(1.0), list(x[:k])
        if self.far is not None:
            w, place[self.far] = x[self.far], w
        point, u = combine_columns(place, self.shifts, number), list[Dual]()
        if self.short is not None:
            v = [x[1], x[2]]
            v.insert(self.short[1], w)
            u = scale(number(1.0) / sqrt(dot(v, v)), v)
            point = plus(number(self.ends[self.short[0]]), scale(x[0], u))
        return w, point, [self._times(w, each) for each in self._rotate(x[k:], number)], u

    def _rotate(self, x: Sequence[Dual], number: Number) -> list[Dual]:
        """R by rows: R₀ + sin ψ K R₀ + (1 − cos ψ) K² R₀."""
        R = self.error.R
        if not x:
            return list(number(R.ravel()))
        K, c, s = hat(self.error.turns[:, 0]), cosine(x[0]), sine(x[0])
        rows = zip((R + K @ K @ R).ravel(), (-K @ K @ R).ravel(), (K @ R).ravel(), strict=True)
        return [number(still) + number(even) * c + number(odd) * s for still, even, odd in rows]

    def _times(self, w: Dual, turned: Dual) -> Dual:
        """w times what turns alone decide; far away with rates by these over w."""
        if self.far is None:
            return turned
        rates = list(turned.rates)
        rates[self.far] = turned.value
        return Dual(w.value * turned.value, rates)

    @cached_property
    def wanted(self) -> list[Components]:
        """The desired directions."""
        goal = self.goal
        return [goal._direction(each, goal.p, goal.R.ravel(), lambda value: value) for each in goal.seen]

    def close(self, y: Sequence[Any], number: Number) -> list[Any]:
        """Return g (k), as many equations as joints first, each of one joint."""
        return [each.value for each in self.parts(y, number)[0]]

    @cached_property
    def closing(self) -> BoxFormula:
        """g (k)."""
        return of_robot(self.close, self.size[0])

    @property
    def rotates(self) -> list[bool | None]:
        """True for joints that turn, False for those that slide, None for those that their equation is free of."""
        return [each.start is not None for each in self.feet]

    @cached_property
    def joint_coefficients(self) -> BoxFormula:
        """Coefficients of each equation in its joint z: A, B, C, −A / ‖(B, C)‖ of A + B cos z + C sin z of an angle, or
        B, B² − 2 A of A + B z + z² / 2 of a travel."""

        def formula(y: Sequence[Any], known: Number) -> list[Any]:
            def number(value: Any) -> Any:
                return [number(each) for each in value] if np.ndim(value) else Dual(known(value), [0.0, 0.0])

            x, coefficients = [Dual(each, [0.0, 0.0]) for each in y], list[Any]()
            for k, rotates in enumerate(self.rotates):
                if rotates is not None:
                    i, z = self.freedoms + k, _CosineAndSine() if rotates else Dual(0.0, [1.0, 0.0])
                    g = self.close([*x[:i], z, *x[i + 1 :]], number)[k]
                    A, (B, C) = g.value, g.rates
                    coefficients += [A, B, C, A * (-1.0 / sqrt(B * B + C * C))] if rotates else [B, B * B - A * 2.0]
            return coefficients

        return of_robot(formula, self.size[0])

    def narrow(self, forms: list[AffineForms], low: Array, high: Array) -> tuple[Array, Array]:
        """The corners (c, n) of boxes, whose coordinates are ``forms``, with the joints where the legs can have them:
        without, the 3-RRR needs 1.5 times as many boxes and 1.4 times the time, the PRRRP twice as many boxes."""
        low, high, bounds = low.copy(), high.copy(), ((x.low, x.high) for x in self.joint_coefficients.at(forms))
        for i, rotates in enumerate(self.rotates, self.freedoms):
            if rotates is not None:
                narrow, count = (narrow_angle, 4) if rotates else (narrow_travel, 2)
                low[:, i], high[:, i] = narrow(list(islice(bounds, count)), (low[:, i], high[:, i]))
        return low, high

    @cached_property
    def errors(self) -> BoxFormula:
        """u × u* of all that is observed."""
        return of_robot(
            lambda y, number: [e.value for u, wanted in self._directions(y, number) for e in cross(u, wanted)],
            self.size[0],
        )

    @cached_property
    def asked(self) -> BoxFormula:
        """Components that vanish where only poses without error are searched."""
        return of_robot(
            lambda y, number: [
                each.value
                for k, (u, wanted) in enumerate(self._directions(y, number))
                for each in ([dot(u, wanted)] if k == self.square else cross(u, wanted))
            ],
            self.size[0],
        )

    @cached_property
    def directions(self) -> BoxFormula:
        """u of all that is observed."""
        return of_robot(lambda y, number: [e.value for u, _ in self._directions(y, number) for e in u], self.size[0])

    def _directions(self, y: Sequence[Any], number: Number) -> list[tuple[Sequence[Dual], list[Dual]]]:
        """The observed directions and the desired ones."""
        none = [0.0] * self.size[0]
        return [
            (u, [Dual(number(each), none) for each in wanted])
            for u, wanted in zip(self.parts(y, number)[1], self.wanted, strict=True)
        ]

    @cached_property
    def slopes(self) -> BoxFormula:
        """g (k), its rates (k n), those of E (n), the reach margins of legs without a joint."""
        n, _ = self.size

        def formula(y: Sequence[Any], number: Number) -> list[Any]:
            g, _, margins = self.parts(y, number)
            slopes = [-total(c.value * c.rates[j] for c in self._cosines(y, number)) for j in range(n)]
            return [
                *(each.value for each in g),
                *(rate for each in g for rate in each.rates),
                *slopes,
                *(each.value for each in margins),
            ]

        return of_robot(formula, n)

    @cached_property
    def apart(self) -> list[tuple[int, list[int]]]:
        """Indices, for each point of the platform about which it rotates and on which legs act, of one of these legs,
        and of those that act elsewhere; none unless all legs have joints and are observed: an unobserved leg would push
        at its limit."""
        if self.far is not None or self.short is not None or self.error.turns.shape[1] != 1:
            return []
        if not set(range(len(self.error.limbs))) == set(self.joints) == {each.limb for each in self.error.seen}:
            return []
        axis, found = self.error.R.T @ self.error.turns[:, 0], list[tuple[int, list[int]]]()
        tips = [each.tip.turned for each in self.error.limbs]
        for i, tip in enumerate(tips):
            rest = [
                k for k, other in enumerate(tips) if np.abs(np.cross(axis, other - tip)).max() > EXACT_INCIDENCE_TOL
            ]
            if rest and rest not in [each for _, each in found]:
                found.append((i, rest))
        return found

    @cached_property
    def moments(self) -> BoxFormula:
        """Moments that vanish at a critical point: those about an observed leg's tip, to which the legs there add
        nothing. That of a leg is c (∂c g_θ − c_θ ∂g) / g_θ along a rotation about the tip, all times all g_θ. The 3-RRR
        needs 1.3 times as many boxes without."""

        def formula(y: Sequence[Any], number: Number) -> list[Any]:
            error, k, found = self.error, self.error.shifts.shape[1], list[Any]()
            g = self.parts(y, number)[0]
            rotation = self._place_platform(y, self.make_constant(number))[2]
            cosines = dict(zip([each.limb for each in error.seen], self._cosines(y, number), strict=True))
            # all legs have joints, in their order
            slopes = [each.rates[self.freedoms + i] for i, each in enumerate(g)]
            for at, rest in self.apart:
                arm = transform_vector([each.value for each in rotation], number(error.limbs[at].tip.turned))
                way = cross(arm, number(error.turns[:, 0]))
                along = [dot(way, number(each)) for each in error.shifts.T]
                parts = []
                for i in rest:
                    c = cosines[i]
                    of_c, of_g = (
                        total([each.rates[k], *(a * b for a, b in zip(along, each.rates, strict=False))])
                        for each in (c, g[i])
                    )
                    part = c.value * (of_c * slopes[i] - c.rates[self.freedoms + i] * of_g)
                    for other in rest:
                        part = part if other == i else part * slopes[other]
                    parts.append(part)
                found.append(total(parts))
            return found

        return of_robot(formula, self.size[0])

    def _cosines(self, y: Sequence[Any], number: Number) -> list[Dual]:
        return [dot(u, wanted) for u, wanted in self._directions(y, number)]

    @cached_property
    def bends(self) -> BoxFormula:
        """Derivatives of ∇E + μ ∇g (n n) and of g (k n) by the coordinates, as functions of coordinates and
        multipliers."""
        n, k = self.size
        none = [0.0] * n

        def formula(y: Sequence[Any], number: Number) -> list[Any]:
            x, known = self.unknowns(y, range(n)), self.make_constant(number)
            mu = [Dual(each, none) for each in y[n:]]
            g, cosines = self.parts(x, known)[0], self._cosines(x, known)
            rows = [
                total(
                    [
                        *(c.value * c.rates[j] * -1.0 for c in cosines),
                        *(each.rates[j] * own for each, own in zip(g, mu, strict=True)),
                    ]
                )
                for j in range(n)
            ]
            return [
                rate
                for each in (*rows, *(each.value for each in g))
                for rate in (each.rates if isinstance(each, Dual) else none)
            ]

        return of_robot(formula, n + k)


class _CosineAndSine:
    """An angle of which cosine and sine are unknowns."""

    def cos(self) -> Dual:
        """Its cosine."""
        return Dual(0.0, [1.0, 0.0])

    def sin(self) -> Dual:
        """Its sine."""
        return Dual(0.0, [0.0, 1.0])


def total(parts: Any) -> Any:
    """Their sum, without a zero to begin with."""
    first, *rest = parts
    for each in rest:
        first = first + each
    return first


def _in_plane(error: PoseError, limb: ClosedFormLeg) -> ClosedFormLeg:
    """A rod that slides, with the normal of the plane in which it stays as its axis."""
    if error.shifts.shape[1] != 2:
        return limb
    normal = np.cross(*error.shifts.T)
    off = [
        normal @ (error.p + limb.tip.constant + error.R @ limb.tip.turned - limb.centre),
        *(np.cross(normal, error.turns.T).ravel()),
    ]
    return limb if np.abs(off).max() > HIDDEN_ROBOT_RESIDUAL_TOL else limb.turning_about(normal)
