"""Equilibria of a loop of two observed legs, by the direction of the force that closes it.

Two rods u₁, u₂ of constant length, their cranks or sliders and the platform between them close one vector equation,
each term of which has variables of its own: r₁ u₁ + k + Σ f_j(q_j) = r₂ u₂. At an equilibrium of
E = ½ Σ (1 − (u_i · u_i*)²) there is a λ = |λ| n with n · f_j′(q_j) = 0 and, c_i = u_i · u_i*, with c₁ u₁* − r₁ λ along
u₁, c₂ u₂* + r₂ λ along u₂. Where λ vanishes each u_i is along u_i* or at right angles to it. Elsewhere n, u₁ and u₁*
lie in one plane. In polar coordinates about u₁*, n = cos t u₁* + sin t w(β), u₁ = cos θ u₁* + sin θ w(β), this is
smooth; and with the joints as unknowns, determined by g_j = n · f_j′, nothing is special where n lies along an axis.
The closure gives u₂, a unit vector in a plane with n and u₂*, with the same |λ|:
r₁ sin(t − θ) c₂ (u₂* × u₂) = r₂ cos θ sin θ (n × u₂).

Of a 4-R-{2-SS} with legs 1 and 4 observed, 175,542 boxes prove all 51 equilibria in 18 s. Without forces 700,000 boxes
over the pose prove none in 200 s, and leave 80 % of the space undecided.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...closed_forms.legs import ClosedFormLeg, LegJoint
from ...equations.box_formula import BoxFormula
from ...geometry.affine import AffineForms, stack
from ...geometry.components import Components, cosine, cross, dot, minus, plus, scale, sine
from ...geometry.vectors import Array
from ...tolerances import EXACT_INCIDENCE_TOL, HIDDEN_ROBOT_RESIDUAL_TOL
from .elimination import Flags, Places, away, pivots
from .joint_error import JointError, of_robot
from .pose_error import EnclosureFailure, Number, PoseError
from .subdivision import CRITICAL_BOX_HALF_EDGE_MIN, POSE_BOX_MIN_FRACTION, CriticalBox, Subdivision, forms_of, hull

ZERO_NARROWINGS_COUNT = 16
"""Number of times that the place of a zero is narrowed."""


@dataclass(frozen=True, eq=False, repr=False)
class ForceError(JointError):
    """Equations of forces that balance, beside g, in the place of the gradient of E."""

    @property
    def flat(self) -> int:
        """Number of observed directions at right angles to the desired ones at which equilibria are not searched."""
        return 1

    def rest(self, y: Sequence[Any], number: Number) -> list[Any]:
        """Return the equations beside g."""
        raise NotImplementedError

    @cached_property
    def left(self) -> BoxFormula:
        """Equations beside g."""
        return of_robot(self.rest, self.size[0])

    @cached_property
    def bends(self) -> BoxFormula:
        """The rates of all equations, one after the other."""

        def formula(y: Sequence[Any], known: Number) -> list[Any]:
            x, number = self.unknowns(y, range(self.size[0])), self.make_constant(known)
            return [rate for each in (*self.close(x, number), *self.rest(x, number)) for rate in each.rates]

        return of_robot(formula, self.size[0])


@dataclass(frozen=True, eq=False, repr=False)
class LoopError(ForceError):
    """Equations over β (in space), t, θ and the joints of the terms; ``joints`` are the observed legs."""

    @classmethod
    def about(cls, error: PoseError) -> LoopError:
        """Build the equations of a pose's error; raises ``EnclosureFailure`` if it is not that of such a loop."""
        joints = tuple(each.limb for each in error.seen if each.limb is not None)
        found = cls(error, joints, error, shortest=0.0)
        if len(error.seen) != 2 or len(set(joints)) != 2 or len(found.rods) != 2:
            raise EnclosureFailure("the observed legs are not two rods of constant length")
        if error.turns.shape[1] > 1 or any(abs(each.size) < EXACT_INCIDENCE_TOL for each in found.terms):
            raise EnclosureFailure("the observed legs do not determine the platform's rotation")
        if error.shifts.shape[1] == 2:
            normal = np.cross(*error.shifts.T)
            off = [
                *(normal @ each for each in found.desired),
                *(
                    np.linalg.norm(np.cross(normal, each.axis)) if each.start is not None else normal @ each.axis
                    for each in found.terms
                ),
            ]
        if error.shifts.shape[1] not in (2, 3) or (
            error.shifts.shape[1] == 2 and np.abs(off).max() > HIDDEN_ROBOT_RESIDUAL_TOL
        ):
            raise EnclosureFailure("the motion is neither planar nor spatial")
        return found

    @cached_property
    def rods(self) -> list[ClosedFormLeg]:
        """Observed legs that are rods of constant length."""
        return [limb for i in self.joints if not (limb := self.error.limbs[i]).slides]

    @cached_property
    def over_pose(self) -> JointError:
        """Same error over the pose and the joints of the observed legs."""
        return JointError(self.error, self.joints, self.error, shortest=0.0)

    @property
    def flat(self) -> int:
        """Number of observed directions at right angles to the desired ones, the others along theirs, at which
        equilibria without a force form curves or surfaces in space."""
        return 1 if self.error.size > self.error.shifts.shape[1] else 2

    @cached_property
    def desired(self) -> list[Array]:
        """u* of both rods."""
        return [np.array(each) for each in self.wanted]

    @cached_property
    def terms(self) -> list[LegJoint]:
        """Terms of the cranks or sliders, and of the platform's rotation."""
        error = self.error
        found = [replace(joint, size=sign * joint.size) for sign, joint in zip((1.0, -1.0), self.feet, strict=True)]
        for axis in error.turns.T:
            arm = self._arm - axis * (axis @ self._arm)
            size = float(np.linalg.norm(arm))
            found.append(LegJoint(axis, arm / size if size else arm, -size))
        return found

    @property
    def _arm(self) -> Array:
        """Vector from the second tip to the first at the goal, as far as it rotates."""
        one, two = (each.tip.turned for each in self.rods)
        return np.asarray(self.error.R @ (one - two))

    @property
    def _still(self) -> Array:
        """k."""
        one, two = self.rods
        axes = self.error.turns
        still = self._arm if not axes.shape[1] else axes @ (axes.T @ self._arm)
        return np.asarray(one.centre - one.tip.constant - two.centre + two.tip.constant - still)

    @property
    def freedoms(self) -> int:
        """Angles."""
        return int(self.error.shifts.shape[1])

    @property
    def size(self) -> tuple[int, int]:
        """Numbers of coordinates, and of the equations that determine joints."""
        return self.freedoms + len(self.terms), len(self.terms)

    def box(self, low: Array, high: Array, reach: float) -> tuple[Array, Array]:
        """Return the corners of the box: n counts up to its sign, and the sign of w."""
        most = np.array([*(np.pi / 2 for _ in range(self.freedoms - 1)), np.pi])
        inner, outer = self.over_pose.box(low, high, reach)
        places = [*range(self.error.size, len(inner)), *range(self.freedoms, self.error.size)]
        return np.concatenate([-most, inner[places]]), np.concatenate([most, outer[places]])

    def vectors(self, y: Sequence[Any], number: Number) -> tuple[list[Components], list[Any]]:
        """n, u₁ and u₂; and g."""
        one, two = self.rods
        u, m = self.desired[0], self.freedoms
        first = np.linalg.svd(u[None])[2][1] if m == 3 else np.cross(np.cross(*self.error.shifts.T), u)
        w = (
            number(first)
            if m == 2
            else plus(scale(cosine(y[0]), number(first)), scale(sine(y[0]), number(np.cross(u, first))))
        )
        n, rod = (plus(scale(cosine(z), number(u)), scale(sine(z), w)) for z in y[m - 2 : m])
        tip, g = plus(scale(number(one.rod), rod), number(self._still)), list[Any]()
        for z, term in zip(y[m:], self.terms, strict=True):
            f, rate = term.carry(z, number)
            tip = plus(tip, f)
            g.append(dot(n, rate))
        return [n, rod, scale(number(1 / two.rod), tip)], g

    def rest(self, y: Sequence[Any], number: Number) -> list[Any]:
        """Return the equations beside g: the length of u₂; the force, across u₂; in space the plane of u₂."""
        one, two = self.rods
        (n, _, u), _ = self.vectors(y, number)
        t, theta = y[self.freedoms - 2 : self.freedoms]
        wanted, across_u = number(self.desired[1]), cross(n, u)
        force = minus(
            scale(number(one.rod) * sine(t - theta) * dot(u, wanted), cross(wanted, u)),
            scale(number(two.rod) * cosine(theta) * sine(theta), across_u),
        )
        length = (dot(u, u) - 1.0) * 0.5
        if self.freedoms == 2:
            return [length, dot(force, number(np.cross(*self.error.shifts.T)))]
        return [length, *force, dot(across_u, wanted)]

    def close(self, y: Sequence[Any], number: Number) -> list[Any]:
        return self.vectors(y, number)[1]

    @property
    def rotates(self) -> list[bool | None]:
        return [None if each.start is None else True for each in self.terms]

    @cached_property
    def slips(self) -> BoxFormula:
        """sin(t − θ) and n × u₂, which vanish together where the closure is singular."""

        def formula(y: Sequence[Any], number: Number) -> list[Any]:
            n, _, u = self.vectors(y, number)[0]
            return [sine(y[self.freedoms - 2] - y[self.freedoms - 1]), *cross(n, u)]

        return of_robot(formula, self.size[0])

    @cached_property
    def told(self) -> BoxFormula:
        """Coordinates about the goal: shifts, the rotation, the joints of the observed legs."""

        def formula(y: Sequence[Any], number: Number) -> list[Any]:
            error, m = self.error, self.freedoms
            limb = self.rods[0]
            rod = self.vectors(y, number)[0][1]
            point = plus(
                number(limb.centre - limb.tip.constant - error.p),
                plus(scale(number(limb.rod), rod), self.terms[0].carry(y[m], number)[0]),
            )
            arm = error.R @ limb.tip.turned
            for axis, z in zip(error.turns.T, y[m + 2 :], strict=True):
                c, s = cosine(z), sine(z)
                point = minus(
                    point, plus(scale(s, number(np.cross(axis, arm))), scale(c, number(arm - axis * (axis @ arm))))
                )
                arm = axis * (axis @ arm)
            point = minus(point, number(arm))
            return [*(dot(point, number(way)) for way in error.shifts.T), *y[m + 2 :], *y[m : m + 2]]

        return of_robot(formula, self.size[0])

    def enclose_chart(self, middle: Array, half: Array) -> tuple[Array, Array]:
        found = self.told.together(forms_of(middle, half))
        return found.low, found.high


class LoopSubdivision(Subdivision):
    """Boxes of these coordinates. At most one equilibrium with a λ lies in each box that is settled as a zero; that
    there is one is proved over the pose."""

    error: LoopError

    def _settle(self, tube: list[AffineForms], P: Places, N: Places) -> tuple[Flags, AffineForms]:
        F = self.error.left.together(tube)
        settled = away(F, N.shape[1])
        # where n may lie along both rods |λ| may have no bound: the closure itself may be singular
        small = np.all(np.stack([each.spread for each in tube], axis=1) <= self.singular * self.whole, axis=1)
        slips = self.error.slips.together(tube)
        F.r[small & ~settled & ~np.any((slips.low > 0) | (slips.high < 0), axis=1)] = np.inf
        return settled, F

    def _multipliers(self, middle: Array, wide: Array, P: Places) -> tuple[AffineForms, Flags]:
        none = AffineForms(np.zeros((middle.shape[1] + 1, len(middle), 0)), np.zeros((len(middle), 0)))
        return none, np.ones(len(middle), dtype=bool)

    def _equations(self, at: Array, forms: list[AffineForms]) -> tuple[AffineForms, AffineForms]:
        still = forms_of(at, 0 * at)
        F = stack([*self.error.closing.at(still), *self.error.left.at(still)])
        K = self.error.bends.together(forms)
        shape = (*F.r.shape, at.shape[1])
        return F, AffineForms(K.v.reshape(-1, *shape), K.r.reshape(shape))

    def _report(self, x: Array, reach: Array, frame: Array) -> list[CriticalBox]:
        """Return the equilibria at zeros, each once: over the pose exactly one is proved in a box that holds all that
        lie in that of the zero. Those that an unobserved leg does not reach are left out; undecided ones stay open."""
        over, kept, reach = self.error.over_pose, list[int](), self._narrow_zeros(x)
        y, (low, high) = np.mean(self.error.enclose_chart(x, 0 * x), axis=0), self.error.enclose_chart(x, reach)
        room = np.maximum(high - y, y - low)
        for k in range(len(x)):
            apart = np.abs(y[kept] - y[k])
            if not np.any(
                np.all(np.minimum(apart, np.abs(over.periods - apart)) + room[k] < CRITICAL_BOX_HALF_EDGE_MIN, axis=1)
            ):
                kept.append(k)
        x, reach, y, room = (each[kept] for each in (x, reach, y, room))
        # as wide as the smallest boxes are to be in which a zero nearby is sought
        whole = np.full(y.shape[1], max(1.0, float(room.max()) / POSE_BOX_MIN_FRACTION))
        part = Subdivision(over, -whole, whole)
        P = pivots(part._values(forms_of(y, 0 * y))[1].v[0])[0]
        settled = np.all(room < CRITICAL_BOX_HALF_EDGE_MIN, axis=1) & part._unique(
            y, np.full(y.shape, CRITICAL_BOX_HALF_EDGE_MIN), P, 1.0
        )
        rest = np.flatnonzero(~settled)
        if len(rest):
            settled[rest] = part._near_zero(y[rest], room[rest], P[rest])
        zeros = part.zeros()
        if zeros:
            forms = forms_of(*(np.array([getattr(each, name) for each in zeros]) for name in ("x", "radius")))
            margins = stack([*part._values(forms)[3], 0.0 * forms[0] + 1.0])
            reached, beyond = np.all(margins.low > 0, axis=1), np.any(margins.high < 0, axis=1)
            for zero in (each for each, known in zip(zeros, reached | beyond, strict=True) if not known):
                settled[np.abs(y - zero.x).max(axis=1).argmin()] = False
            zeros = [each for each, good in zip(zeros, reached, strict=True) if good]
        self.left += list(zip(x[~settled], reach[~settled], strict=True))
        return zeros

    def _narrow_zeros(self, x: Array) -> Array:
        """Return the distance of zeros from places (c, n). With more equations than unknowns there need be none: the
        bound is narrowed from the whole box."""
        at, room, frame = self._rooms()
        reach = hull(room, frame) + np.abs(x - at)
        for _ in range(ZERO_NARROWINGS_COUNT):
            reach = np.fmin(reach, self._krawczyk(x, reach)[1])
        return reach
