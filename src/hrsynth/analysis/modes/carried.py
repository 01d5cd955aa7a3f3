"""All modes of a platform that one leg of R and P carries, the other legs being conditions on its pose, as those of an
ankle whose two axes do not meet (docs/pages/theory.md, section 8).

With x = o + (c (1 - a aᵀ) + a aᵀ + s [a]ₓ)(y - o) for a turn about a through o, c² + s² = 1, a condition is a
polynomial of known degree d in each c, s: of degree 2 d in the tangent of the half-angle. As many conditions as the leg
has joints have at most as many isolated common zeros as the permanent of these degrees (Bézout in a product of lines).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations, permutations, product
from math import prod
from typing import Any

import numpy as np

from ...budgets import LARGEST_LOOPS, PLANAR_STARTS
from ...constraints.pattern import attached
from ...errors import NotConfined, Unsolved
from ...geometry import lines
from ...geometry.vectors import Array, frozen, hat, perpendicular, pose, unit
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.locked import carry_joint
from ...kinematics.relation import Measurement
from ...mechanism import Direction, Joint, JointType
from ...mechanism.legs import Leg
from ...mechanism.observations.encoder import Encoder
from ...tolerances import (
    CHAIN_ROUNDING,
    INDEPENDENT_RATES,
    MOVED,
    RANK_GAP,
    SAME_DIRECTION,
    SAME_POINT,
    SAME_RELATION,
)
from ..measured import MeasuredRobot
from .branches import Model
from .conditions import AtAngle, OnMovingPlane, OnMovingRevolution, OnPlane, OnRevolution, PoseCondition
from .joint_forms import closings_bound, eigenvalues
from .leg_conditions import Middle, leg_conditions, rigid_platform
from .polynomials import Polynomial, krawczyk
from .pose_boxes import FAR_FROM_REAL, PRECISION, PoseBox, UnitCircle, Zero, as_box, at_middle, told_far, zeros
from .pose_forms import Poses
from .sighted import Sight, conditions, sights
from .solve import SystemMode, SystemModes
from .systems import System

FEW_JOINTS = 2
"""Joints up to which random starts find all zeros soon."""


@dataclass(frozen=True, eq=False)
class Turn:
    """A turn about the ``axis`` through ``point`` (sizes) at the goal, or a slide along it."""

    axis: Array
    point: Array
    slides: bool

    def maps(self, of: Any) -> tuple[Any, Any, Any]:
        """What does not depend on its angle, and what c and s multiply; shape (3, 3) each."""
        along = np.outer(self.axis, self.axis)
        return of(along), of(np.eye(3) - along), of(hat(self.axis))


@dataclass(frozen=True, eq=False)
class Told:
    """A condition on the body that the first ``joints`` of the leg carry."""

    condition: PoseCondition
    joints: int
    idle: frozenset[int] = frozenset()
    """Joints that change nothing of it."""
    moved: float = 0.0
    """How far axes are off where they should be for that (sizes)."""

    @classmethod
    def of(cls, condition: PoseCondition, freedoms: Sequence[Turn]) -> Told:
        """With the joints before which nothing turns what the base tells, or after which nothing turns what is told of
        the body."""
        idle, off = set[int](), 0.0
        for order, misses in ((range(len(freedoms)), _before), (range(len(freedoms))[::-1], _after)):
            for k in order:
                miss = misses(condition, freedoms[k])
                if miss > SAME_DIRECTION:
                    break
                idle.add(k)
                off += miss if miss > CHAIN_ROUNDING else 0.0
        return cls(condition, len(freedoms), frozenset(idle), off)

    def degree(self, k: int, freedom: Turn) -> int:
        """In the tangent of half of joint k's angle, or in its slide. The square of a distance has degree one in c and
        s."""
        c = self.condition
        if k >= self.joints or k in self.idle:
            return 0
        if freedom.slides:
            return 0 if isinstance(c, AtAngle) else c.degree
        around = isinstance(c, OnRevolution | OnMovingRevolution)
        once = isinstance(c, OnMovingPlane) or (around and float(c.f[2]) == -1.0)  # type: ignore[attr-defined]
        return 2 * (1 if once else 2 if around else c.degree)


def _before(c: PoseCondition, freedom: Turn) -> float:
    """How far a joint next to the base is from changing nothing of a condition; infinite where it is none such."""
    a = freedom.axis
    if isinstance(c, OnPlane):
        return abs(float(c.n @ a)) if freedom.slides else float(np.linalg.norm(np.cross(c.n, a)))
    if isinstance(c, AtAngle):
        return 0.0 if freedom.slides else float(np.linalg.norm(np.cross(c.a, a)))
    if isinstance(c, OnRevolution) and not freedom.slides:
        tilt = 0.0 if _sphere(c) else float(np.linalg.norm(np.cross(c.a, a)))
        return max(tilt, float(np.linalg.norm(np.cross(c.o - freedom.point, a))))
    return np.inf


def _after(c: PoseCondition, freedom: Turn) -> float:
    """The same of a joint next to the body."""
    a, turned = freedom.axis, float(np.linalg.norm(np.cross(c.c, freedom.axis)))
    if freedom.slides:
        return 0.0 if isinstance(c, AtAngle) else np.inf
    return turned if isinstance(c, AtAngle) else max(turned, float(np.linalg.norm(np.cross(c.b - freedom.point, a))))


def _sphere(c: PoseCondition) -> bool:
    """Whether it tells a distance and no height."""
    return isinstance(c, OnRevolution) and float(c.f[2]) == -1.0 and float(c.f[1]) == 0.0


@dataclass(frozen=True, eq=False)
class _Equation(Zero):
    """A condition in all c, all s and slides t (0 and 1 besides), with numbers in balls."""

    freedoms: tuple[Turn, ...]
    joints: int

    @cached_property
    def _maps(self) -> list[tuple[Any, ...]]:
        return [(*each.maps(self.of), self.of(each.point), self.of(each.axis)) for each in self.freedoms]

    def carried(self, x: Sequence[Any]) -> tuple[Any, Any, list[tuple[int, Any, Any]]]:
        """The point and the arrow, and their derivatives by the unknowns, by number."""
        n = len(self.freedoms)
        p, d = self.of(self.condition.b) + 0 * x[0], self.of(self.condition.c) + 0 * x[0]
        slopes: list[tuple[int, Any, Any]] = []
        for k in range(self.joints - 1, -1, -1):
            rest, c, s, o, a = self._maps[k]
            if self.freedoms[k].slides:
                slopes.append((2 * n + k, a + 0 * p, 0 * d))
                p = p + a * x[2 * n + k]
                continue
            turn = rest + c * x[k] + s * x[n + k]
            slopes = [(j, turn @ dp, turn @ dd) for j, dp, dd in slopes]
            slopes += [(k, c @ (p - o), c @ d), (n + k, s @ (p - o), s @ d)]
            p, d = o + turn @ (p - o), turn @ d
        return p, d, slopes

    def value(self, x: Sequence[Any]) -> Any:
        """The value at x."""
        point, arrow, _ = self.carried(x)
        return self.condition.value(point, arrow, self._of)

    def slopes(self, x: Sequence[Any]) -> Any:
        """The derivative by each unknown at x."""
        point, arrow, by = self.carried(x)
        along, turned = self.condition.slopes(point, arrow, self._of)
        found = [0 * v for v in x]
        for j, dp, dd in by:
            found[j] = along @ dp + turned @ dd
        return found


@dataclass(frozen=True, eq=False)
class _Half:
    """A condition in the tangents t of half the angles and in slides, numbers as they are: with an axis a the turn of
    the quaternion 1 + t a, whatever the length of a."""

    freedoms: tuple[Turn, ...]
    told: Told

    def _placed(self, x: Sequence[Any]) -> tuple[Any, Any, list[tuple[int, Any, Any]]]:
        """The point and the arrow, and for each joint the rate of its turn and a point, or none and that of its slide.
        """
        R, p, at = _exact(np.eye(3)), _exact(np.zeros(3)), list[tuple[int, Any, Any]]()
        for k, each in enumerate(self.freedoms[:self.told.joints]):
            if k in self.told.idle:
                continue
            a, o, t = _exact(each.axis), _exact(each.point), x[k]
            if each.slides:
                at.append((k, None, R @ a))
                p = p + R @ a * t
                continue
            w = 1 + t * t * (a @ a)
            at.append((k, R @ a * (2 / w), p + R @ o))
            turn = (np.eye(3, dtype=int) * (2 - w) + np.outer(a, a) * (2 * t * t)
                    + _exact(hat(each.axis)) * (2 * t)) / w
            R, p = R @ turn, p + R @ (o - turn @ o)
        return p + R @ _exact(self.told.condition.b), R @ _exact(self.told.condition.c), at

    def value(self, x: Sequence[Any]) -> Any:
        """The value at x."""
        point, arrow, _ = self._placed(x)
        return self.told.condition.value(point, arrow, _exact)

    def slopes(self, x: Sequence[Any]) -> Any:
        """The derivative by each unknown at x."""
        point, arrow, at = self._placed(x)
        along, turned = self.told.condition.slopes(point, arrow, _exact)
        found = [0 * v for v in x]
        for k, rate, place in at:
            found[k] = along @ place if rate is None else along @ _cross(rate, point - place) + turned @ _cross(
                rate, arrow)
        return found


def _exact(values: Array) -> Any:
    """Numbers as balls without radii."""
    from flint import arb

    flat = np.array([arb(float(v)) for v in np.ravel(values)], dtype=object)
    return flat.reshape(np.shape(values)) if np.shape(values) else flat[0]


@dataclass(frozen=True)
class _Fixed:
    """An unknown, by its number, that has a value."""

    k: int
    at: int

    def value(self, x: Sequence[Any]) -> Any:
        """The value at x."""
        return x[self.k] - self.at

    def slopes(self, x: Sequence[Any]) -> Any:
        """The derivative by each unknown at x."""
        return [0 * v + (j == self.k) for j, v in enumerate(x)]


@dataclass(frozen=True, eq=False, repr=False)
class CarriedPlatform(System):
    """A platform that a leg carries; q are its angles (rad) and slides (sizes) since the goal."""

    freedoms_: tuple[Turn, ...]
    """Joints, those that carry the platform first."""
    told: tuple[Told, ...]
    middle: Middle
    start: Array
    """The platform at the goal (4, 4)."""
    seen: tuple[Sight, ...] = field(default=(), kw_only=True)
    rows: Array = field(default_factory=lambda: np.eye(3), kw_only=True)
    """Turns and conditions are told along these (3, 3)."""

    @property
    def carrying(self) -> int:
        """How many of the joints carry the platform."""
        return len(self.freedoms_)

    @property
    def size(self) -> float:
        """The unit of lengths (m)."""
        return self.middle.size

    @property
    def home(self) -> Array:
        """The goal."""
        return np.zeros(len(self.freedoms_))

    def moved(self, q: Array, joints: int | None = None) -> tuple[Array, Array]:
        """R and p (..., 3) (sizes) of what the first joints carry, at complex coordinates (..., n) too."""
        q = np.asarray(q)
        R = np.broadcast_to(np.eye(3), (*q.shape[:-1], 3, 3))
        p = np.zeros((*q.shape[:-1], 3))
        for k in range(len(self.freedoms_) if joints is None else joints)[::-1]:
            each, by = self.freedoms_[k], q[..., k, None, None]
            if each.slides:
                p = p + each.axis * by[..., 0]
                continue
            rest, c, s = each.maps(np.asarray)
            turn = rest + c * np.cos(by) + s * np.sin(by)
            p = each.point + np.einsum("...ij,...j->...i", turn, p - each.point)
            R = turn @ R
        return R, p

    def placed(self, q: Array) -> Array:
        """The platform's pose (4, 4), m."""
        R, p = self.moved(q, self.carrying)
        R, p, o = self.rows.T @ R @ self.rows, self.rows.T @ p, self.middle.origin
        return np.asarray(pose(o + self.size * p - R @ o, R) @ self.start)

    def values(self, q: Array, chosen: Sequence[Told]) -> tuple[Array, Array]:
        """The values (..., m) of conditions and their derivatives (..., m, n) by q."""
        values, slopes = [], []
        for each in chosen:
            c, columns = each.condition, []
            R, p = self.moved(q, each.joints)
            x, d = p + R @ c.b, R @ c.c
            values.append(c.value(x, d, np.asarray))
            along, turned = c.slopes(x, d, np.asarray)
            for k, freedom in enumerate(self.freedoms_):
                if k >= each.joints:
                    columns.append(0 * values[-1])
                    continue
                Q, o = self.moved(q, k)
                axis, point = Q @ freedom.axis, o + Q @ freedom.point
                by_x = axis + 0 * x if freedom.slides else _cross(axis, x - point)
                by_d = 0 * d if freedom.slides else _cross(axis, d)
                columns.append(np.sum(along * by_x + turned * by_d, axis=-1))
            slopes.append(np.stack(columns, axis=-1))
        return np.stack(values, axis=-1), np.stack(slopes, axis=-2)

    def most(self, chosen: Sequence[Told]) -> int:
        """How many isolated common zeros some conditions, as many as joints, have at most."""
        n = len(self.freedoms_)
        degrees = np.array([[each.degree(k, f) for k, f in enumerate(self.freedoms_)] for each in chosen])
        alike = [i for i, each in enumerate(chosen) if _sphere(each.condition)]
        slides = [k for k, each in enumerate(self.freedoms_) if each.slides]
        tables = [degrees]
        for one in alike if slides else ():  # the squares of slides are the same in all: differences have none
            tables.append(table := degrees.copy())
            for i in alike:
                if i != one and chosen[i].joints == chosen[one].joints:
                    table[i] = np.maximum(degrees[i], degrees[one])
                    table[i, slides] = np.minimum(table[i, slides], 1)
        found = [_permanent(table) for table in tables]
        for (i, j), table in product(combinations(range(n), 2), tables):
            rest = [k for k in range(n) if k not in (i, j)]
            if self._meets(chosen[i], chosen[j]) and not table[rest, 0].any():
                bent = np.where(degrees[[i, j], 1:].any(axis=0), 4, 0)
                found.append(_permanent(np.vstack([bent, table[rest, 1:]])))
        return min(found)

    def _meets(self, one: Told, other: Told) -> bool:
        """Whether two conditions hold one point, and give where the first joint turns what is across its axis:
        N R η = A with |R η| = |η|, so |N⁻¹ A|² = |η|², of degree two in the other joints' c and s, and one turn for
        each zero."""
        o, a = self.freedoms_[0].point, self.freedoms_[0].axis
        if self.freedoms_[0].slides or one.joints != other.joints or np.any(one.condition.b != other.condition.b):
            return False
        rows = [c.n if isinstance(c, OnPlane) else c.o - o for c in (one.condition, other.condition)
                if isinstance(c, OnPlane) or (isinstance(c, OnRevolution) and _sphere(c))]
        return len(rows) == 2 and abs(float(a @ np.cross(rows[0], rows[1]))) > SAME_DIRECTION

    @cached_property
    def square(self) -> tuple[Told, ...]:
        """As many conditions as joints, independent at the goal, with the fewest zeros; none where there are no such.
        """
        best: tuple[int, tuple[Told, ...]] | None = None
        for chosen in combinations(self.told, len(self.freedoms_)):
            most = self.most(chosen)
            if most and (best is None or most < best[0]):
                rows = self.values(self.home, chosen)[1]
                rows = rows / np.maximum(np.linalg.norm(rows, axis=1), INDEPENDENT_RATES)[:, None]
                if np.linalg.svd(rows, compute_uv=False)[-1] > INDEPENDENT_RATES:
                    best = most, chosen
        return () if best is None else best[1]

    def equation(self, each: Told) -> _Equation:
        """A condition in balls."""
        return _Equation(each.condition, Poses.spatial(), self.error / self.size, self.freedoms_, each.joints)

    def unknowns(self, q: Array) -> Array:
        """All c, all s and slides t."""
        slides = np.array([each.slides for each in self.freedoms_])
        return np.concatenate([np.where(slides, 1.0, np.cos(q)), np.where(slides, 0.0, np.sin(q)),
                               np.where(slides, q, 0.0)])


def _permanent(degrees: Array) -> int:
    """Bézout's number in a product of lines."""
    return sum(prod(int(degrees[i, j]) for i, j in enumerate(order)) for order in permutations(range(len(degrees))))


def _cross(a: Array, b: Array) -> Array:
    return np.stack([a[..., j] * b[..., k] - a[..., k] * b[..., j] for j, k in ((1, 2), (2, 0), (0, 1))], axis=-1)


def carried(measured: MeasuredRobot, goal: ClosedConfiguration, error: float) -> CarriedPlatform:
    """The platform on that leg which leaves fewest zeros. Raises ``NotConfined`` where none carries it, or what the
    others ask is not known."""
    anatomy, name = measured.setting.anatomy, measured.setting.robot.name
    body, middle = rigid_platform(measured, goal)
    rest, seen = sights(anatomy, measured.question, goal)
    found, reason = list[CarriedPlatform](), "no leg of R and P carries its platform"
    for leg in anatomy.legs:
        try:
            freedoms, told = _carrier(measured, leg, rest, goal, middle)
            moved = 0.0
            for other in anatomy.legs:
                if other is not leg:
                    branches, off = leg_conditions(anatomy, other, rest, goal, middle)
                    if len(branches) > 1:
                        raise NotConfined(name, f"leg {other.label} has {len(branches)} branches")
                    told += [(c, len(freedoms)) for c in branches[0]]
                    moved += off
        except NotConfined as refused:
            reason = refused.reason
            continue
        told += [(c, len(freedoms)) for c in conditions(seen, middle, False)]
        rows, turns, alike, off = _exactly(freedoms, [c for c, _ in told])
        asked = [Told.of(c, turns[:joints]) for c, (_, joints) in zip(alike, told, strict=True)]
        moved += middle.size * (off + max((each.moved for each in asked), default=0.0))
        error_ = error + MOVED * moved + max([0.0, *(sight.error(error, goal) for sight in seen)])
        each = CarriedPlatform((), np.zeros((0, 3)), turns, tuple(asked), middle, goal.pose(body), seen=seen,
                               error=error_, rows=rows)
        off_ = each.values(each.home, asked)[0] if asked and turns else np.zeros(0)
        if turns and np.abs(off_).max(initial=0.0) <= SAME_RELATION and each.square:
            found.append(each)
        else:
            reason = "the conditions of its legs do not decide its pose one by one"
    if not found:
        raise NotConfined(name, reason)
    return min(found, key=lambda each: each.most(each.square))


def _exactly(freedoms: Sequence[Turn], conditions: Sequence[PoseCondition]
             ) -> tuple[Array, tuple[Turn, ...], list[PoseCondition], float]:
    """Turns and conditions in rows along the first axes, so that what is parallel, at right angles, in one point or on
    one axis is so exactly, as ranks want it; and how far that moves anything (sizes)."""
    moved, turns, rows = CHAIN_ROUNDING, list[Turn](), _rows([each.axis for each in freedoms])

    def near(v: Array, others: Iterable[Array], within: float) -> Array:
        nonlocal moved
        found = next((other for other in others if float(np.linalg.norm(v - other)) <= within), v)
        off = float(np.linalg.norm(found - v))
        moved = max(moved, off if off > CHAIN_ROUNDING else 0.0)
        return found

    def direction(v: Array, known: Sequence[Array] = (), within: float = SAME_POINT / RANK_GAP) -> Array:
        flat = np.where(np.abs(v) <= within, 0.0, v)
        flat = np.sign(flat) if np.count_nonzero(flat) == 1 and abs(abs(flat.sum()) - 1.0) <= within else flat
        return near(near(v, [flat], within), [s * other for other in known for s in (1.0, -1.0)], within)

    for each in freedoms:
        a, o = direction(rows @ each.axis, [other.axis for other in turns], SAME_DIRECTION), rows @ each.point
        for k, other in enumerate(turns if not each.slides else ()):
            far = float(np.linalg.norm(np.cross(other.point - o, a)))
            at = (None if other.slides else other.point if far <= SAME_POINT / RANK_GAP else
                  lines.meeting_point([(o, a), (other.point, other.axis)], SAME_POINT / RANK_GAP))
            if at is not None:
                off = max(float(np.linalg.norm(np.cross(p - at, b))) for p, b in ((o, a), (other.point, other.axis)))
                moved = max(moved, off if off > CHAIN_ROUNDING else 0.0)
                turns[k], o = replace(other, point=at), at
                break
        turns.append(Turn(a, o, each.slides))
    found, points, arrows = list[PoseCondition](), [each.point for each in turns], [each.axis for each in turns]
    for c in conditions:
        told: dict[str, Any] = {}
        for name in (each for each in "bo" if hasattr(c, each)):
            told[name] = near(rows @ getattr(c, name), points, SAME_POINT / RANK_GAP)
            points.append(told[name])
        for name in (each for each in "candmt" if hasattr(c, each)):
            told[name] = direction(rows @ getattr(c, name), arrows)
        found.append(replace(c, **told))
    return rows, tuple(turns), found, moved


def _rows(axes: Sequence[Array]) -> Array:
    """A frame (3, 3), its third row along the first axis, its second at right angles to the first other one."""
    if not axes:
        return np.eye(3)
    z = axes[0]
    other = next((each for each in axes if np.linalg.norm(np.cross(z, each)) > SAME_DIRECTION), perpendicular(z))
    y = unit(np.cross(z, other))
    return np.stack([np.cross(y, z), y, z])


def freedoms_of(joint: Joint, at: str, goal: ClosedConfiguration, middle: Middle, held: Sequence[str]
                ) -> list[Turn]:
    """What a joint of R and P leaves free that is met from a link, none if it is ``held``. Raises ``NotConfined``."""
    turns = {JointType.REVOLUTE: 1, JointType.UNIVERSAL: 2, JointType.CYLINDRICAL: 1, JointType.PRISMATIC: 0}
    if joint.type not in turns or held.count(joint.name) not in (0, joint.type.freedoms):
        raise NotConfined(goal.twin.mechanism.name, f"joint {joint.name} is not one of R and P")
    point, axes = carry_joint(goal.twin.mechanism, joint, goal.pose)
    found = list[Turn]()
    for axis in () if joint.name in held else axes if joint.predecessor == at else axes[::-1]:
        a, o = axis / np.linalg.norm(axis), middle.point(point)
        found += [Turn(a, o, False)] * (turns[joint.type] > 0) + [Turn(a, o, True)] * joint.type.slides
    return found


def _carrier(measured: MeasuredRobot, leg: Leg, rest: Measurement, goal: ClosedConfiguration, middle: Middle
             ) -> tuple[tuple[Turn, ...], list[tuple[PoseCondition, int]]]:
    """The joints of a leg that are not held, from the base, and what is measured of it, with how many of them carry
    it."""
    anatomy, mechanism = measured.setting.anatomy, measured.setting.anatomy.mechanism
    own = [each for each in rest.observations if each.leg == leg.label]
    held = [each.joint for each in own if isinstance(each, Encoder)]
    if anatomy.floats(leg):
        raise NotConfined(mechanism.name, "nothing carries its platform: it is a free body")
    path, at, found, links = anatomy.path(leg), mechanism.base, list[Turn](), {mechanism.base: 0}
    if set(leg.joints) - {name for edge in path for name in edge.joints}:
        raise NotConfined(mechanism.name, f"leg {leg.label} has loops")
    for edge in path:
        if len(edge.joints) > 1:
            raise NotConfined(mechanism.name, f"leg {leg.label} is not one of R and P")
        found += freedoms_of(mechanism.joints[edge.joints[0]], at, goal, middle, held)
        at = edge.other(at)
        links[at] = len(found)
    told, none = list[tuple[PoseCondition, int]](), np.zeros(3)
    for each in own:
        if isinstance(each, Encoder) and each.joint in leg.joints:
            continue
        if not isinstance(each, Direction) or each.link not in links or (
                each.seen_from or rest.reference) != mechanism.base:
            raise NotConfined(mechanism.name, f"what is measured at leg {leg.label} is no direction seen from the base")
        d = goal.pose(each.link)[:3, :3] @ each.direction
        first = perpendicular(d)
        told += [(AtAngle(leg.label, none, d, e, h), links[each.link])
                 for e, h in ((first, 0.0), (np.cross(d, first), 0.0), (d, 1.0)) if links[each.link]]
    return tuple(found), told


def proposals(system: CarriedPlatform, most: int) -> Array:
    """Common zeros (k, n) that Newton's method finds from random complex starts, each with its conjugate."""
    rng, n, found = np.random.default_rng(0), len(system.freedoms_), np.zeros((0, len(system.freedoms_)))
    for _ in range(PLANAR_STARTS):
        start = rng.uniform(-np.pi, np.pi, (64, n)) + 3j * rng.normal(size=(64, n))
        found = polished(system, start, found)
        if len(found) >= most:
            break
    return found


def polished(system: CarriedPlatform, q: Array, known: Iterable[Array] = ()) -> Array:
    """The common zeros (k, n) to which Newton's method leads, each with its conjugate, after those that are known."""
    slides, found = np.array([each.slides for each in system.freedoms_]), list(known)
    with np.errstate(all="ignore"):
        for _ in range(100):
            F, J = system.values(q, system.square)
            good = np.all(np.isfinite(J), axis=(1, 2)) & np.all(np.isfinite(F), axis=1)
            q, F, J = q[good], F[good], J[good]
            try:
                step = np.linalg.solve(J, F[:, :, None])[:, :, 0]
            except np.linalg.LinAlgError:
                step = (np.linalg.pinv(J) @ F[:, :, None])[:, :, 0]
            q = q - step / np.maximum(1.0, 2.0 * np.abs(step).max(axis=1))[:, None]
    for each in (y for x in q[np.abs(step).max(axis=1) < 1e-10] for y in (x, x.conj())):
        turned = np.angle(np.exp(1j * each.real)) + 1j * each.imag
        at = np.where(slides, each, turned)
        apart = (np.abs(np.where(slides, at - other, np.exp(1j * (at - other)) - 1.0)).max() for other in found)
        if not any(far < 1e-6 for far in apart):
            found.append(at)
    return np.array(found).reshape(-1, len(slides))


def solve_carried(measured: MeasuredRobot, goal: ClosedConfiguration, error: float = 0.0
                  ) -> tuple[Model, SystemModes]:
    """All modes, with the goal known to ``error`` (m). Raises ``NotConfined``, and ``Unsolved`` where not all zeros are
    enclosed that there may be."""
    if not np.isfinite(error):
        raise NotConfined(measured.setting.robot.name, "no distance bounds how far it is from where its loops close")
    system = carried(measured, goal, error)
    (body,) = attached(measured.setting.anatomy)
    return Model(system, lambda q: {body: system.placed(q)}, system.home), _judged(system)


def enclosed(system: CarriedPlatform, proposed: Array) -> list[PoseBox]:
    """Boxes of common zeros in c, s and t, apart from each other."""
    n = len(system.freedoms_)
    equations: list[Polynomial] = [system.equation(each) for each in system.square]
    for k, each in enumerate(system.freedoms_):
        equations += [_Fixed(k, 1), _Fixed(n + k, 0)] if each.slides else [UnitCircle(k, n + k), _Fixed(2 * n + k, 0)]
    return zeros(equations, map(system.unknowns, proposed))[0]


def _far(system: CarriedPlatform, proposed: Array, known: Sequence[PoseBox]) -> list[PoseBox]:
    """Boxes of the zeros, of the numbers as they are, at which a turn is far from real, apart from those known."""
    from flint import acb, ctx

    equations: list[Polynomial] = [_Half(system.freedoms_, each) for each in system.square]
    slides, found = np.array([each.slides for each in system.freedoms_]), list[PoseBox]()
    with ctx.workprec(PRECISION):
        for q in proposed:
            if np.abs(q.imag[~slides]).max(initial=0.0) < FAR_FROM_REAL or at_middle(known, system.unknowns(q)):
                continue
            with np.errstate(all="ignore"):
                start = np.where(slides, q, np.tan(q / 2.0))
            half = krawczyk(equations, [acb(v.real, v.imag) for v in start.tolist()])
            if half is None:
                continue
            squares = [1 + t * t for t in half]
            box = as_box([*(t * 0 + 1 if slid else 2 / w - 1 for t, w, slid in zip(half, squares, slides, strict=True)),
                          *(t * 0 if slid else 2 * t / w for t, w, slid in zip(half, squares, slides, strict=True)),
                          *(t if slid else t * 0 for t, slid in zip(half, slides, strict=True))], False, 0)
            if box is not None and box.apart((*known, *found)):
                found.append(replace(box, rounded=True))
    return found


def _judged(system: CarriedPlatform) -> SystemModes:
    """The modes: as many zeros as the degrees allow."""
    from flint import ctx

    n, most = len(system.freedoms_), system.most(system.square)
    size = f"{n} joint{'s' * (n > 1)} of the leg that carries the platform"
    if most > LARGEST_LOOPS:
        raise Unsolved("the leg", f"{size}: up to {most} closings, too many (at most {LARGEST_LOOPS})")
    why, bound = "degrees in each (Bézout)", "class"
    boxes = enclosed(system, proposals(system, most)) if n <= FEW_JOINTS else []
    if len(boxes) < most and (counted := closings_bound(system, system.square)) is not None:
        most, why, bound = counted.most, "ranks modulo a prime of 62 bits", "rank"
        proposed = polished(system, eigenvalues(system, system.square, counted))
        boxes = enclosed(system, proposed)
        boxes += _far(system, proposed, boxes)
    at_goal = [box for box in boxes if box.real and box.holds(system.unknowns(system.home))]
    if len(boxes) != most or len(at_goal) != 1:
        raise Unsolved("the leg", f"{size}: of {most} closings at most ({why}) {len(boxes)} have boxes")
    bodies = [_body(system, box) for box in boxes]
    if any(all((a - b).contains(0) for a, b in zip(one, other, strict=True))
           for k, one in enumerate(bodies) for other in bodies[:k]):
        raise Unsolved("the leg", f"{size}: several of {most} closings have one pose of the platform")
    besides = [system.equation(each) for each in system.told if each not in system.square]
    real = [box for box in boxes if box.real]
    with ctx.workprec(PRECISION):
        kept = [box for box in real if box is at_goal[0]
                or not any(not each.value(box.box).contains(0) for each in besides)]
        modes = [as_mode(system, box, not besides or box is at_goal[0]) for box in kept]
    proof = (f"{size}: at most {most} closings by {why}, {len(boxes)} enclosed apart from each other, complex ones "
             f"too{told_far(boxes)}, {len(real)} real")
    if not besides:
        return SystemModes(len(boxes), tuple(modes), True, proof, bound=bound, enclosed=True)
    return SystemModes.of_more(modes, len(real) - len(kept), f"from {n} of {len(system.told)} conditions: {proof}",
                               bound)


def _body(system: CarriedPlatform, box: PoseBox) -> list[Any]:
    """The position and the three columns of the turn that carries the platform from the goal, in balls."""
    from flint import ctx

    found = list[Any]()
    with ctx.workprec(PRECISION):
        for c in np.vstack([np.zeros(3), np.eye(3)]):
            told = Told(PoseCondition("", np.zeros(3), c), system.carrying)
            at, arrow, _ = system.equation(told).carried(box.box)
            found += [*(arrow if c.any() else at)]
    return found


def as_mode(system: CarriedPlatform, box: PoseBox, proved: bool, miss: float | None = None) -> SystemMode:
    """A real box as a mode, or as one that fits; ``miss``: how far it is from meeting all (sizes)."""
    n, x = len(system.freedoms_), box.middle.real
    q = np.array([x[2 * n + k] if each.slides else np.arctan2(x[n + k], x[k])
                  for k, each in enumerate(system.freedoms_)])
    spread = [float(v.rad()) for v in _body(system, box)]
    shift, turn = system.size * float(np.linalg.norm(spread[:3])), 2.0 * float(np.linalg.norm(spread[3:]))
    if miss is None:
        values, slopes = system.values(q, system.told)
        miss = float(np.max(np.abs(values) / np.maximum(1.0, np.linalg.norm(slopes, axis=-1))))
    return SystemMode((), max(shift / system.size, turn), shift, turn, miss, frozen(system.placed(q)), frozen(q),
                      proved=proved, fits=not proved)
