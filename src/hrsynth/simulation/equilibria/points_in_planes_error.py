"""Error to a goal of a platform on rods that slide, each of which keeps a point of it in a plane of the base: the parts
of its pose depend on each other.

The planes are n_i · (p + R b_i) = h_i, N has the rows n_i. So p = N⁺ (h_i − n_i · R b_i)_i + D s, with D the directions
that all planes share. Where rows depend on each other, Σ λ_i n_i = 0, Σ λ_i (n_i · R b_i − h_i) = 0 is a condition on R
alone: a quadratic form of its quaternion q. One of rank two with both signs is a product of two factors: there are two
families of poses, q at right angles to a vector, both smooth, which meet where both factors vanish. Another form is one
equation more. Where families meet, what is critical in one need not be so in the other.

Coordinates: s, the components of q along a basis of a family but one, which is 1, and the joints as in
:mod:`.joint_error`. Charts with each of the components as 1, the others between −1 and 1, together hold all turns.

Without planes such a platform is not searched. Of the 3-RPS, 202,948 boxes prove 288 of its 320 equilibria in 24 s.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...analysis.aspects.path_segments import PathCoordinates
from ...analysis.aspects.vector_expressions import NoLegForm
from ...analysis.observed import ObservedRobot
from ...equations.box_formula import BoxFormula, trace_formula
from ...geometry.affine import make_affine, stack
from ...geometry.components import Components, combine_columns, cross, plus, scale
from ...geometry.duals import Dual
from ...geometry.so3 import convert_to_quaternions
from ...geometry.vectors import Array
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.platform_motion import PlatformMotion
from ...mechanism import JointType, Mechanism
from ...mechanism.legs import Leg
from ...tolerances import AFFINE_ROUNDING, CRITICAL_POINT_DISTANCE_TOL, EXACT_INCIDENCE_TOL, HIDDEN_ROBOT_RESIDUAL_TOL
from .joint_error import JointError, total
from .pose_error import EnclosureFailure, Number, PoseError, require_directions
from .pose_system import bends


@dataclass(frozen=True, eq=False, repr=False)
class PlaneError(JointError):
    """Error of one family, in a chart. The whole ``error`` counts three shifts and three rotations; the platform's
    point has the distance ``offset`` + ``follow`` · R (by rows) + ``along`` · s from the goal's."""

    offset: Array = field(kw_only=True)
    follow: Array = field(kw_only=True)
    along: Array = field(kw_only=True)
    span: Array = field(kw_only=True)
    """The basis (4, r) of quaternions, orthonormal."""
    forms: Array = field(kw_only=True)
    """Quadratic forms (l, 4, 4) of quaternions that vanish."""
    one: int = field(default=0, kw_only=True)
    """Component that is 1."""

    @classmethod
    def families(cls, setup: ObservedRobot, goal: ClosedConfiguration) -> list[PlaneError]:
        """Return the errors of all families of poses of such a platform; raises ``EnclosureFailure``."""
        require_directions(setup)
        configurations, observation_model = (
            [setup.all_samples.start, *setup.configurations],
            setup.samples.observation_model,
        )
        motion = PlatformMotion.of(configurations, replace(observation_model, observations=()))
        depends = EnclosureFailure("the variable parts of the platform's pose depend on each other")
        legs = setup.decomposition.legs
        normals = [_normal(setup.mechanism, leg) for leg in legs]
        if not motion.body or motion.twists.shape[1] < 6 or any(normal is None for normal in normals):
            raise depends
        coordinates = PathCoordinates(motion, True, goal.model.length)
        try:
            error = PoseError.along(setup, goal, coordinates)
        except NoLegForm as why:
            raise EnclosureFailure(str(why)) from why
        if [str(limb.label) for limb in error.limbs] != [leg.label for leg in legs] or not all(
            limb.slides for limb in error.limbs
        ):
            raise depends
        N, places = np.array(normals), coordinates.of([goal, *configurations])
        h = [limb.tip.value(*places) @ n for limb, n in zip(error.limbs, N, strict=True)]
        if max(map(np.ptp, h)) > HIDDEN_ROBOT_RESIDUAL_TOL:
            raise depends
        limbs = tuple(limb.turning_about(n) for limb, n in zip(error.limbs, N, strict=True))
        whole = JointError.of(replace(error, limbs=limbs))
        if len(whole.joints) < len(limbs):
            raise depends
        rest = np.array([each[0] - n @ limb.tip.constant for each, n, limb in zip(h, N, limbs, strict=True)])
        arms = np.array([np.outer(n, limb.tip.turned).ravel() for n, limb in zip(N, limbs, strict=True)])
        U, sizes, V = np.linalg.svd(N)
        rank, back = int(np.sum(sizes > EXACT_INCIDENCE_TOL)), np.linalg.pinv(N, rcond=EXACT_INCIDENCE_TOL)
        along, follow = V[rank:].T, -back @ arms
        offset = back @ rest - error.p
        offset -= along @ (along.T @ offset)
        forms = [
            c * np.eye(4) - np.tensordot(row, TURNED, 1)
            for c, row in zip(U.T[rank:] @ rest, U.T[rank:] @ arms, strict=True)
        ]
        return [
            cls(
                whole.error,
                whole.joints,
                whole.error,
                offset=offset,
                follow=follow,
                along=along,
                span=span,
                forms=np.array(left).reshape(-1, 4, 4),
            )
            for span, left in factors(np.eye(4), forms)
        ]

    @property
    def charts(self) -> tuple[JointError, ...]:
        """Charts that together hold all poses of the family."""
        near = [replace(self, one=k) for k in range(self.span.shape[1])]
        return (*near, *(replace(each, far=k) for each in near for k in range(self.along.shape[1])))

    def list_charts(self, bounded: bool) -> tuple[JointError, ...]:
        return self.charts

    def has_rotation(self, R: Array) -> bool:
        """Return True if a rotation is in the family, up to the tolerance of equal rotations."""
        q = convert_to_quaternions(R)
        return bool(np.abs(q - self.span @ (self.span.T @ q)).max() < CRITICAL_POINT_DISTANCE_TOL)

    @property
    def ends(self) -> Array:
        return np.zeros((0, 3))

    @property
    def shifts(self) -> Array:
        return self.along

    @property
    def freedoms(self) -> int:
        return int(self.along.shape[1] + self.span.shape[1]) - 1

    @property
    def turning(self) -> tuple[int, ...]:
        n = self.size[0]
        return (*range(self.along.shape[1], self.freedoms), *range(n + len(self.joints), n + self.size[1]))

    @property
    def size(self) -> tuple[int, int]:
        return self.freedoms + len(self.joints), len(self.joints) + len(self.forms)

    def box(self, low: Array, high: Array, reach: float) -> tuple[Array, Array]:
        """The corners of all coordinates, for shifts between two corners, or beyond ``reach``."""
        k, ways = self.along.shape[1], self.along.T @ self.error.shifts
        middle, room = ways @ (low + high)[:3] / 2, np.abs(ways) @ (high - low)[:3] / 2
        inner, outer = super().box(np.append(low[:3], np.zeros(3)), np.append(high[:3], np.zeros(3)), reach)
        if self.far is not None:
            middle, room = np.zeros(k), np.where(np.arange(k) == self.far, 1 / reach, 1.0)
        turns = np.ones(self.freedoms - k)
        return (np.concatenate([middle - room, -turns, inner[6:]]), np.concatenate([middle + room, turns, outer[6:]]))

    def _place_platform(self, y: Sequence[Any], number: Number) -> tuple[Dual, Components, list[Dual], list[Dual]]:
        w, point, turned, u = super()._place_platform(y, number)
        point = plus(plus(scale(w, number(self.offset)), combine_columns(turned, self.follow, number)), point)
        return w, point, turned, u

    def _rotate(self, x: Sequence[Dual], number: Number) -> list[Dual]:
        """R by rows, of the components but that which is 1."""
        r = self.span.shape[1]
        q = [*x[: self.one], number(1.0), *x[self.one :]]
        size = 1.0 / total(each * each for each in q)
        parts = {(i, j): q[i] * q[j] * size for i in range(r) for j in range(i, r)}
        found = list[Dual]()
        for form in TURNED:
            own = self.span.T @ form @ self.span
            found.append(total(number(own[i, j] * (1 if i == j else 2)) * part for (i, j), part in parts.items()))
        return found

    def parts(self, y: Sequence[Any], known: Number) -> tuple[list[Dual], list[Sequence[Dual]], list[Dual]]:
        """Return the parts as for a free pose; and the forms that vanish."""
        g, seen, margins = super().parts(y, known)
        if len(self.forms):
            q, number = self.unknowns(y, range(self.along.shape[1], self.freedoms)), self.make_constant(known)
            q.insert(self.one, number(1.0))
            for form in self.forms:
                own, r = self.span.T @ form @ self.span, len(q)
                g.append(
                    total(q[i] * q[j] * number(own[i, j] * (1 if i == j else 2)) for i in range(r) for j in range(i, r))
                )
        return g, seen, margins

    @property
    def periods(self) -> Array:
        """Periods of the results of :meth:`enclose_chart`."""
        return np.append(np.full(6, np.inf), super().periods[6:])

    @cached_property
    def told(self) -> BoxFormula:
        """w, the platform's point from the goal's, times w, and the axis of its turn from the goal's, times the sine of
        its angle."""

        def formula(y: Sequence[Any], known: Number) -> list[Any]:
            number = self.make_constant(known)
            w, point, _, _ = self._place_platform(y, number)
            k = self.along.shape[1]
            R = self._rotate([Dual(each, [0.0] * self.size[0]) for each in y[k : self.freedoms]], number)
            turn = [cross(number(self.error.R[:, j]), [R[3 * i + j] for i in range(3)]) for j in range(3)]
            axis = scale(0.5, plus(plus(turn[0], turn[1]), turn[2]))
            return [each.value for each in (w, *point, *axis)]

        return trace_formula(formula, self.freedoms)

    def enclose_chart(self, middle: Array, half: Array) -> tuple[Array, Array]:
        """Return shifts from the goal, axes of the rotation times its sine, and joints of boxes (c, n)."""
        f, eye = self.freedoms, np.eye(self.freedoms)
        forms = [
            make_affine(middle[:, i], half[:, i, None] * eye[i], AFFINE_ROUNDING * (1 + np.abs(middle[:, i])))
            for i in range(f)
        ]
        w, *rest = self.told.at(forms)
        found = stack(rest)
        low, high = found.low.copy(), found.high.copy()
        if self.far is not None:
            with np.errstate(all="ignore"):
                ends = np.array(
                    [each / w_end for each in (low[:, :3], high[:, :3]) for w_end in (w.low[:, None], w.high[:, None])]
                )
            low[:, :3], high[:, :3] = ends.min(axis=0), ends.max(axis=0)
            endless = (w.low <= 0) & (w.high >= 0)
            low[endless, :3], high[endless, :3] = -np.inf, np.inf
        shifts = self.error.shifts
        with np.errstate(invalid="ignore"):
            at, room = (low + high)[:, :3] / 2 @ shifts, (high - low)[:, :3] / 2 @ np.abs(shifts)
        known = np.isfinite(low).all(axis=1)
        low[known, :3], high[known, :3] = (at - room)[known], (at + room)[known]
        joints, wide = middle[:, f:], half[:, f:]
        return np.concatenate([low, joints - wide], axis=1), np.concatenate([high, joints + wide], axis=1)

    def pose(self, y: Array) -> tuple[Array, Array]:
        """The platform's point (c, 3), in characteristic lengths, and rotation (c, 3, 3) at coordinates (c, n)."""
        k = self.along.shape[1]
        q = np.insert(y[:, k : self.freedoms], self.one, 1.0, axis=1) @ self.span.T
        R = np.einsum("eij,ci,cj->ce", TURNED, q, q) / np.sum(q * q, axis=1)[:, None]
        s = y[:, :k].copy()
        if self.far is not None:
            w = s[:, self.far].copy()
            s[:, self.far] = 1.0
            s = s / w[:, None]
        return self.error.p + self.offset + R @ self.follow.T + s @ self.along.T, R.reshape(-1, 3, 3)


TURNED = np.stack([bends(each, np.eye(3)) for each in np.eye(3)], axis=1).reshape(9, 4, 4)
"""R by rows as quadratic forms of a unit quaternion."""


def factors(span: Array, forms: Sequence[Array]) -> Iterator[tuple[Array, list[Array]]]:
    """Spaces (4, r) of quaternions in whose union forms vanish, each with the forms that do not vanish all over it;
    raises ``EnclosureFailure`` where one vanishes with its slope."""
    if not forms:
        yield span, []
        return
    first, *rest = forms
    values, vectors = np.linalg.eigh(span.T @ first @ span)
    large = np.abs(values) > EXACT_INCIDENCE_TOL
    if not large.any():
        yield from factors(span, rest)
    elif large.sum() == 2 and values[large].prod() < 0:
        one, other = np.sqrt(np.abs(values[large]))[:, None] * vectors.T[large]
        for normal in (one + other, one - other):
            yield from factors(span @ np.linalg.svd(normal[None])[2][1:].T, rest)
    elif values[large].min() < 0 < values[large].max():
        yield from ((own, [first, *left]) for own, left in factors(span, rest))
    elif not large.all():
        raise EnclosureFailure("planes of legs are tangent to each other at some poses")


def _normal(mechanism: Mechanism, leg: Leg) -> Array | None:
    """The normal of the plane in which a leg's ball stays: its other joints turn about this direction, or slide at
    right angles to it."""
    *own, ball = [mechanism.joints[name] for name in leg.joints]
    turns = [each for each in own if each.type is JointType.REVOLUTE]
    slides = [each for each in own if each.type is JointType.PRISMATIC]
    if (
        leg.has_loops
        or ball.type is not JointType.SPHERICAL
        or leg.platform_link not in ball.links
        or not turns
        or (len(turns) + len(slides) < len(own))
    ):
        return None
    normal = turns[0].axis
    off = [*(np.cross(normal, each.axis) for each in turns), *(np.array([normal @ each.axis]) for each in slides)]
    return None if max(np.abs(each).max() for each in off) > EXACT_INCIDENCE_TOL else normal
