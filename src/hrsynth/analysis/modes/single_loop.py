"""All modes of one loop of up to five free R and P, as a paradoxical linkage with a joint driven (docs/pages/proofs.md,
section 8).

In dual quaternions a joint is c + s h, h that of its axis. The loop is g₃ g₄ g₅ = λ (g₁ g₂)⁻¹ with c₁ c₂, s₁ c₂, c₁ s₂,
s₁ s₂ and those of g₄, g₅ as unknowns (M. L. Husty, M. Pfurner and H.-P. Schröcker, Mech. Mach. Theory 42, 2007): eight
linear equations in eight unknowns, whose determinant is of degree four in s₃ / c₃. That the unknowns are such products
is checked besides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...constraints.pattern import list_leg_ends
from ...errors import ExternalSolverFailure, UnsupportedLocus
from ...geometry.vectors import Array, compare_poses
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.tasks import FixedValuesTask
from ...kinematics.tasks import solve as close
from ...kinematics.velocity_relation import ObservationModel
from ...mechanism import Direction
from ...mechanism.observations.encoder import Encoder
from ...tolerances import CLOSURE_SOLVER_TOL, INDEPENDENT_RATES_MIN, NUMBER_ROUNDING
from ..measured import MeasuredRobot
from .branches import Model
from .carrying_leg import freedoms_of
from .carrying_leg_modes import as_mode
from .carrying_leg_system import CarriedPlatform, Turn
from .leg_conditions import OriginAndUnit
from .pose_boxes import POSE_BOX_BITS_COUNT, PoseBox, as_box, zeros
from .solve import SystemMode, SystemModes

SINGLE_LOOP_JOINTS_MAX = 5
MIDDLE_JOINT_OFFSET_RAD = 0.7
"""Rotation of the middle joint (rad), so that none of its angles of interest is a half-turn."""


@dataclass(frozen=True, eq=False, repr=False)
class SingleLoop(CarriedPlatform):
    """The free joints of one loop from the base around, those before the platform first; q are all their angles (rad)
    and slides (sizes)."""

    before: int
    body: str
    goal: ClosedConfiguration
    observation_model: ObservationModel
    places: tuple[tuple[int, int], ...]
    """The coordinate of each in the whole robot, and its sense."""

    @property
    def carrying(self) -> int:
        """Number of joints that carry the platform."""
        return self.before

    def close(self, q: Array) -> tuple[ClosedConfiguration, float]:
        """The robot closed from there on with what is measured held, and what is left of that."""
        model, step = self.goal.model, np.zeros(self.goal.model.nv)
        for (place, sense), value in zip(self.places, q, strict=True):
            step[place] = sense * float(value)  # slides are in characteristic lengths there too
        held = FixedValuesTask.at(
            model, self.goal.q, self.observation_model.reference, self.observation_model.observations
        )
        found, residual = close(model, model.integrate(self.goal.q, step), held, tolerance=CLOSURE_SOLVER_TOL)
        return ClosedConfiguration.of(model, found), residual

    def axes(self) -> list[Any]:
        """h of each, in balls; shape (8,)."""
        from flint import arb

        found = []
        for each in self.freedoms_:
            parts = [np.zeros(3), each.axis / 2] if each.slides else [each.axis, np.cross(each.point, each.axis)]
            off = self.error / self.size * (1.0 + float(np.linalg.norm(each.point)))
            values = [0.0, *parts[0], 0.0, *parts[1]]
            found.append(
                np.array(
                    [
                        arb(v, 0.0 if v == 0.0 and k in (0, 4) else off + NUMBER_ROUNDING * (1.0 + abs(v)))
                        for k, v in enumerate(values)
                    ],
                    dtype=object,
                )
            )
        return found


def dual_product(a: Any, b: Any) -> Any:
    """The product of dual quaternions (8,)."""

    def product(p: Any, q: Any) -> Any:
        v, w = p[1:], q[1:]
        turned = [v[j] * w[k] - v[k] * w[j] for j, k in ((1, 2), (2, 0), (0, 1))]
        return np.array([p[0] * q[0] - v @ w, *(p[0] * w + q[0] * v + turned)], dtype=object)

    return np.concatenate([product(a[:4], b[:4]), product(a[:4], b[4:]) + product(a[4:], b[:4])])


_Place = tuple[Turn, int, int]
"""A joint, its coordinate in the whole robot and its sense."""


def single_loop(measured: MeasuredRobot, goal: ClosedConfiguration, error: float) -> SingleLoop:
    """The mechanism as one loop, what is measured held. Raises ``UnsupportedLocus`` where it is none, or what is
    measured does not hold joints one by one."""
    mechanism, seen = goal.model.mechanism, measured.observation_model.observations
    bodies = list_leg_ends(measured.setup.decomposition)
    ends = [link for joint in mechanism.joints.values() for link in joint.links]
    if (
        mechanism.couplings
        or len(bodies) != 1
        or measured.setup.decomposition.point is not None
        or any(ends.count(link) != 2 for link in mechanism.links)
    ):
        raise UnsupportedLocus(mechanism.name, "it is not one loop that contains the platform")
    middle = OriginAndUnit(goal.pose(bodies[0])[:3, 3], goal.model.length)
    held = [each.joint for each in seen if isinstance(each, Encoder)]
    way, at, left = list[tuple[list[_Place], str]](), mechanism.base, list(mechanism.joints.values())
    while left:
        joint = next(each for each in left if at in each.links)
        left.remove(joint)
        forward, places = joint.predecessor == at, list(goal.model.coordinates.get(joint.name, ()))
        found = freedoms_of(joint, at, goal, middle, held)
        at = joint.other(at)
        way.append(
            (
                [
                    (f, place, 1 if forward else -1)
                    for f, place in zip(found, places if forward else places[::-1], strict=False)
                ],
                at,
            )
        )
    for each in seen:
        if isinstance(each, Encoder):
            continue
        if (
            not isinstance(each, Direction)
            or (each.seen_from or measured.observation_model.reference) != mechanism.base
        ):
            raise UnsupportedLocus(mechanism.name, "an observation is not a direction from the base")
        k = [link for _, link in way].index(each.link) + 1
        d = goal.pose(each.link)[:3, :3] @ each.direction
        for side in (way[:k], way[k:]):
            turning = [one for part, _ in side for one in part if not one[0].slides]
            if not turning:
                break
            if len(turning) == 1 and np.linalg.norm(np.cross(turning[0][0].axis, d)) > INDEPENDENT_RATES_MIN:
                for part, _ in side:
                    part[:] = [one for one in part if one is not turning[0]]
                break
        else:
            raise UnsupportedLocus(mechanism.name, f"the observation at {each.link} locks no joint")
    k = [link for _, link in way].index(bodies[0]) + 1
    chain = [one for part, _ in way for one in part]
    if not 0 < len(chain) <= SINGLE_LOOP_JOINTS_MAX:
        raise UnsupportedLocus(mechanism.name, f"its loop has {len(chain)} free joints")
    return SingleLoop(
        (),
        np.zeros((0, 3)),
        tuple(one[0] for one in chain),
        (),
        middle,
        goal.pose(bodies[0]),
        sum(len(part) for part, _ in way[:k]),
        bodies[0],
        goal,
        measured.observation_model,
        tuple(one[1:] for one in chain),
        error=error,
    )


@dataclass(frozen=True, eq=False)
class _Linear:
    """The linear equations of a loop whose joints are taken from number ``first`` on."""

    loop: SingleLoop
    first: int

    @property
    def order(self) -> list[int]:
        """The joints: two, the one in the middle where there are five, and the others."""
        n = len(self.loop.freedoms_)
        return [(self.first + k) % n for k in range(n)]

    def columns(self) -> tuple[list[Any], list[Any], Any]:
        """Factors of the first two, conjugate, of the last, and the axis in the middle."""
        h = [self.loop.axes()[k] for k in self.order]
        one = np.array([1, 0, 0, 0, 0, 0, 0, 0], dtype=object)
        two, rest = h[:2], h[2 + (len(h) == SINGLE_LOOP_JOINTS_MAX) :]
        start = [one, -1 * two[0], -1 * two[1], dual_product(two[1], two[0])] if len(two) == 2 else [one, -1 * two[0]]
        end = (
            [one]
            if not rest
            else [one, rest[0]]
            if len(rest) == 1
            else [one, rest[0], rest[1], dual_product(rest[0], rest[1])]
        )
        return start, end, h[2] if len(h) == SINGLE_LOOP_JOINTS_MAX else None

    def matrix(self, t: Any) -> Any:
        """The eight rows, where the middle one's tangent of half an angle, counted from ``TURN``, is t."""
        start, end, h = self.columns()
        if h is not None:
            c, s = np.cos(MIDDLE_JOINT_OFFSET_RAD), np.sin(MIDDLE_JOINT_OFFSET_RAD)
            by = np.array([c - s * t if k == 0 else 0 for k in range(8)], dtype=object) + h * (s + c * t)
            end = [dual_product(by, each) for each in end]
        return np.stack([*end, *(-1 * each for each in start)], axis=1)


def _has_full_column_rank(rows: Any) -> bool:
    """Return True if columns are independent for all numbers in their balls."""
    from flint import arb_mat
    from scipy.linalg import qr

    middle = rows.astype(float)
    chosen = np.sort(qr(middle.T, pivoting=True, mode="r")[1][: rows.shape[1]])
    inverse = np.linalg.pinv(middle[chosen])
    return not (arb_mat(inverse.tolist()) * arb_mat(rows[chosen].tolist())).det().contains(0)


@dataclass(frozen=True, eq=False)
class _Polynomial:
    """One with balls as coefficients, the constant first."""

    coefficients: Sequence[Any]

    def value(self, x: Sequence[Any]) -> Any:
        """The value at x."""
        total = 0 * x[0]
        for c in self.coefficients[::-1]:
            total = total * x[0] + c
        return total

    def slopes(self, x: Sequence[Any]) -> Any:
        """The derivative at x."""
        return [_Polynomial([k * c for k, c in enumerate(self.coefficients)][1:]).value(x)]


def _determinant(linear: _Linear) -> list[Any]:
    """Its coefficients by the middle joint's tangent, in balls."""
    from flint import arb, arb_mat

    nodes, values = [-2, -1, 0, 1, 2], []
    for t in nodes:
        M = arb_mat(linear.matrix(arb(t)).tolist())
        try:  # det M = det m · det m⁻¹ M with m the middle: less spread
            values.append([M.mid().det() * (M.mid().inv() * M).det()])
        except ZeroDivisionError:
            values.append([M.det()])
    powers = arb_mat([[t**k for k in range(5)] for t in nodes])
    return [row[0] for row in (powers.inv() * arb_mat(values)).table()]


def _products(linear: _Linear, t: Any) -> Any:
    """Return the unknowns (8,) at a zero, the last joints' first, in balls; None if they are not determined."""
    from flint import arb, arb_mat
    from scipy.linalg import qr

    M = linear.matrix(t)
    middle = M.astype(float)
    guess = np.linalg.svd(middle)[2][-1]
    one = int(np.argmax(np.abs(guess)))
    others = [k for k in range(8) if k != one]
    chosen = np.sort(qr(middle[:, others].T, pivoting=True, mode="r")[1][:7])
    inverse = arb_mat(np.linalg.pinv(middle[chosen][:, others]).tolist())
    try:
        found = (inverse * arb_mat(M[chosen][:, others].tolist())).solve(
            inverse * arb_mat([[-M[k, one]] for k in chosen])
        )
    except ZeroDivisionError:
        return None
    x = np.array([arb(1)] * 8, dtype=object)
    x[others] = [row[0] for row in found.table()]
    return x


def _halves(x: Any) -> list[tuple[Any, Any]]:
    """(c, s) of two joints whose products c₁ c₂, s₁ c₂, c₁ s₂, s₁ s₂ are given, up to factors."""
    far = int(np.argmax(np.abs(x.astype(float))))
    i, j = far % 2, far // 2
    return [(x[2 * j], x[2 * j + 1]), (x[i], x[2 + i])]


def solve_loop(measured: MeasuredRobot, goal: ClosedConfiguration, error: float = 0.0) -> tuple[Model, SystemModes]:
    """All modes, with the goal known to ``error`` (m). Raises ``UnsupportedLocus`` and ``ExternalSolverFailure``."""
    from flint import ctx

    if not np.isfinite(error):
        raise UnsupportedLocus(
            measured.setup.robot.name, "the distance to the exact closed configuration is not bounded"
        )
    loop, (body,) = single_loop(measured, goal, error), list_leg_ends(measured.setup.decomposition)
    with ctx.workprec(POSE_BOX_BITS_COUNT):
        found = _five(loop) if len(loop.freedoms_) == SINGLE_LOOP_JOINTS_MAX else _few(loop)
    return Model(loop, lambda q: {body: loop.pose(q)}, loop.home, closing=lambda q: loop.close(q)[0]), found


def _box(loop: SingleLoop, halves: Sequence[tuple[Any, Any]]) -> PoseBox | None:
    """The box of all joints, from (c, s) of half angles or of slides."""
    cos, sin, slid = [], [], []
    for each, (c, s) in zip(loop.freedoms_, halves, strict=True):
        square = c * c + s * s
        cos.append(c * 0 + 1 if each.slides else (c * c - s * s) / square)
        sin.append(c * 0 if each.slides else 2 * c * s / square)
        slid.append(s / c if each.slides else c * 0)
    return as_box([*cos, *sin, *slid], True, 0)


def _few(loop: SingleLoop) -> SystemModes:
    """Up to four joints: one closing where the linear equations have one solution."""
    from flint import arb

    n = len(loop.freedoms_)
    if not _has_full_column_rank(
        np.delete(_Linear(loop, 0).matrix(None), 0, axis=1)
    ):  # the goal has c₁ c₂ and the like alone
        raise ExternalSolverFailure(
            "the loop", f"{n} free joints: the linear equations of its products have several solutions"
        )
    box = _box(loop, [(arb(1), arb(0))] * n)
    assert box is not None
    proof = (
        f"{n} free joint{'s' * (n > 1)} of one loop: at most one solution by the rank of linear equations in "
        "balls, which is the goal"
    )
    return SystemModes(1, (as_mode(loop, box, True, 0.0),), True, proof, bound="rank", enclosed=True)


def _five(loop: SingleLoop) -> SystemModes:
    """List five joints: zeros of a determinant in one of them, that which separates most."""
    found = [each for first in range(SINGLE_LOOP_JOINTS_MAX) if (each := _zeros(_Linear(loop, first))) is not None]
    if not found:
        raise ExternalSolverFailure(
            "the loop", f"{SINGLE_LOOP_JOINTS_MAX} free joints: a determinant does not distinguish its solutions"
        )
    return min(found, key=lambda each: (not each.complete, max(mode.radius for mode in each.modes)))


def _zeros(linear: _Linear) -> SystemModes | None:
    """Return the modes, if all zeros are separated."""
    f = _determinant(linear)
    if f[-1].contains(0):
        return None
    sure = zeros([_Polynomial(f)], np.roots([float(c) for c in f[::-1]])[:, None])[0]
    if len(sure) < len(f) - 1:
        return None
    found = [_box_of_joints(linear, box.box[0]) for box in sure if box.real]
    home = linear.loop.unknowns(linear.loop.home)
    told = [each for each in found if each is not None]
    at_goal = [each for each in told if each[0].has_pose(home)]
    if len(told) < len(found) or len(at_goal) != 1:
        return None
    kept = [each for each in told if each is at_goal[0] or not each[1]]
    modes = [_mode(linear.loop, each[0], each is at_goal[0]) for each in kept]
    proof = (
        f"{SINGLE_LOOP_JOINTS_MAX} free joints of one loop: "
        f"at most {len(sure)} solutions by the degree of a determinant, "
        f"{len(sure)} zeros enclosed, all distinct, complex ones too, {len(told)} real"
    )
    out = [as_mode(linear.loop, box, False) for box, excluded in told if (box, excluded) not in kept]
    return SystemModes.of_more(modes, out, proof, "class")


def _box_of_joints(linear: _Linear, t: Any) -> tuple[PoseBox, bool] | None:
    """Return the box of all joints at a real zero, and whether its unknowns are no products; None if they are not
    determined."""
    x = _products(linear, t)
    if x is None:
        return None
    c, s = np.cos(MIDDLE_JOINT_OFFSET_RAD), np.sin(MIDDLE_JOINT_OFFSET_RAD)
    last, two = x[:4], x[4:]
    halves = dict(zip(linear.order, [*_halves(two), (c - s * t, s + c * t), *_halves(last)], strict=True))
    if any((a * a + b * b).contains(0) for a, b in halves.values()):
        return None
    box = _box(linear.loop, [halves[k] for k in range(SINGLE_LOOP_JOINTS_MAX)])
    out = any(not (v[0] * v[3] - v[1] * v[2]).contains(0) for v in (last, two))
    return None if box is None else (box, out)


def _mode(loop: SingleLoop, box: PoseBox, goal: bool) -> SystemMode:
    """A box as a mode; where the robot closes within it, with what is left of its loop."""
    if goal:
        return as_mode(loop, box, True, 0.0)
    mode = as_mode(loop, box, False, np.inf)
    at, residual = loop.close(mode.q)
    inside = compare_poses(at.pose(loop.body), loop.pose(mode.q), loop.size) <= mode.radius
    return as_mode(loop, box, False, residual) if inside else mode
