"""Closing of the loops of a joint graph: tree joints are moved until the two frames of every other joint meet.

Damped Gauss-Newton on the coordinates of the tree joints that lie in loops. Directions in which the loops hardly
resist (redundant constraints, disturbed by rounded numbers) are not followed. Lengths in characteristic lengths.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...budgets import (
    FIRMER_ZERO_MIN_FRACTION,
    FIXED_JOINT_TRIES_COUNT,
    LOOP_ASSEMBLY_STEP_MAX,
    LOOP_ASSEMBLY_TRIES_MAX,
    LOOP_ASSEMBLY_VISITS_MAX,
    SINGULAR_STEPS,
)
from ...geometry.gauss_newton import DampingFactor, Residual, descend
from ...geometry.ranks import Rank, decompose_matrix, rank_of
from ...geometry.so3 import convert_to_quaternions
from ...geometry.vectors import Array, build_pose, invert_pose, normalise_vector
from ...mechanism.model import JointType, Mechanism
from ...tolerances import (
    CLOSURE_SOLVER_TOL,
    EXACT_INCIDENCE_TOL,
    INCIDENCE_TOL,
    LIMIT_INSET_MIN,
    NEARLY_SINGULAR_ZERO_FRACTION,
    NEWTON_STEP_TO_RESIDUAL_MAX,
    RANK_CUTOFF_FRACTION,
    RANK_GAP_MIN,
    VECTOR_LENGTH_MIN,
    WEAK_CONSTRAINT_FRACTION,
)
from ..jointgraph import (
    ORIGIN,
    CouplingSpec,
    FrameSpec,
    JointSpec,
    Posture,
    TreeJoint,
    build_spanning_tree,
    compute_zero_poses,
    scale_pose,
)
from ..jointmotion import compute_closure_error, compute_joint_pose, compute_joint_screws, get_zero_value, step_along

DAMPING = DampingFactor(start=1.0, eased=0.1, least=1e-3, most=1e6)
SINGLE = (JointType.REVOLUTE, JointType.PRISMATIC)
Values = dict[str, Array]
"""Value of every tree joint."""


class LoopAssembly:
    """Tree, loops and couplings of a joint graph with values of its tree joints; zero may be a keyframe. A closure
    residual below ``noise`` may be due to rounding."""

    def __init__(
        self, base: str, joints: Sequence[JointSpec], gears: Sequence[CouplingSpec] = (), start: Posture | None = None
    ) -> None:
        self.base, self.noise = base, INCIDENCE_TOL
        self._start = start or {}
        tree = build_spanning_tree(base, joints)
        self.length = _spread(base, tree)
        self.tree = [(_scale(joint, self.length), parent, child) for joint, parent, child in tree]
        used = {joint.name for joint, _, _ in tree}
        self._parent = {child: (joint, parent) for joint, parent, child in self.tree}
        reached = {base, *self._parent}
        self.loops = [
            _scale(joint, self.length) for joint in joints if joint.name not in used and reached.issuperset(joint.links)
        ]
        units = {joint.name: self.unit(joint) for joint in joints}
        self.gears = [
            replace(g, ratio=g.ratio * units[g.driver] / units[g.driven], offset=g.offset / units[g.driven])
            for g in gears
            if g.driver in used and g.driven in used
        ]
        ways = [(self._way(loop.links[0]), self._way(loop.links[1])) for loop in self.loops]
        active = {name for one, two in ways for name in set(one) ^ set(two)}
        active |= {name for gear in self.gears for name in (gear.driver, gear.driven)}
        self.active = [joint for joint, _, _ in self.tree if joint.name in active]
        self._columns: dict[str, slice] = {}
        self.size = 0
        for joint in self.active:
            self._columns[joint.name] = slice(self.size, self.size + joint.kind.freedoms)
            self.size += joint.kind.freedoms
        self._carried = [self._signs(after) - self._signs(before) for before, after in ways]
        self._ends = [
            (joint.ends[0].X, invert_pose(joint.ends[1].X))
            if joint.links[0] == parent
            else (joint.ends[1].X, invert_pose(joint.ends[0].X))
            for joint, parent, _ in self.tree
        ]
        self._last: tuple[Values, dict[str, Array]] | None = None
        self._effort = len(self.tree) + len(self.loops) + self.size**2 // 50
        self._spent = 0

    def _way(self, link: str) -> dict[str, float]:
        """Return the tree joints on the path to a link, 1 if passed from predecessor to successor, else −1."""
        signs = {}
        while link != self.base:
            joint, link = self._parent[link]
            signs[joint.name] = 1.0 if joint.links[0] == link else -1.0
        return signs

    def _signs(self, way: dict[str, float]) -> Array:
        """Return these signs, one for each active coordinate, (size,)."""
        signs = np.zeros(self.size)
        for joint in self.active:
            signs[self._columns[joint.name]] = way.get(joint.name, 0.0)
        return signs

    def zero(self) -> Values:
        """Return the values with all tree joints at zero, or in the keyframe."""
        return {joint.name: self._at_start(joint) for joint, _, _ in self.tree}

    def _at_start(self, joint: JointSpec) -> Array:
        """Return the value of a joint in the keyframe, its lengths in characteristic lengths."""
        at_zero = get_zero_value(joint)
        value = self._start.get(joint.name, at_zero)
        if value.shape != at_zero.shape:
            return at_zero
        return scale_pose(value, 1 / self.length) if value.ndim == 2 else value / self.unit(joint)

    def unit(self, joint: JointSpec) -> float:
        """Return metres or radians in one unit of a joint's coordinate."""
        return self.length if joint.type is JointType.PRISMATIC else 1.0

    def scaled_poses(self, values: Values) -> dict[str, Array]:
        """Return the pose (4, 4) of every link in the base frame, lengths in characteristic lengths."""
        if self._last is not None and self._last[0] is values:
            return self._last[1]
        X = {self.base: np.eye(4)}
        for (joint, parent, child), (near, far) in zip(self.tree, self._ends, strict=True):
            D = compute_joint_pose(joint, values[joint.name])
            X[child] = X[parent] @ near @ (D if joint.links[0] == parent else invert_pose(D)) @ far
        self._last = values, X
        return X

    def poses(self, values: Values) -> dict[str, Array]:
        """Return the pose (4, 4) of every link in the base frame, in metres."""
        return {link: scale_pose(X, self.length) for link, X in self.scaled_poses(values).items()}

    def system(self, values: Values) -> tuple[Array, Array]:
        """Return the closure residual of all loops and couplings (rows,), and its derivative by the active coordinates
        (rows, size)."""
        self._spent += self._effort
        X = self.scaled_poses(values)
        twists = np.zeros((6, self.size))
        for joint in self.active:
            twists[:, self._columns[joint.name]] = (
                np.array(compute_joint_screws(joint, *joint.frames(X))).reshape(-1, 6).T
            )
        errors, rows = [np.zeros(0)], [np.zeros((0, self.size))]
        for loop, signs in zip(self.loops, self._carried, strict=True):
            error, by_twist = compute_closure_error(loop, *loop.frames(X))
            relative, own = np.zeros((6, self.size)), signs != 0
            relative[:, own] = signs[own] * twists[:, own]
            errors.append(error)
            rows.append(by_twist @ relative)
        for gear in self.gears:
            row = np.zeros((1, self.size))
            row[0, self._columns[gear.driven]] += 1.0
            row[0, self._columns[gear.driver]] -= gear.ratio
            errors.append(_slip(gear, values))
            rows.append(row)
        return np.concatenate(errors), np.vstack(rows)

    def velocities(self, values: Values, links: Iterable[str]) -> dict[str, Array]:
        """Return the twists (6, n) of links (linear at the base origin, angular) for a basis of the velocities that
        keep the loops closed, joints in no loop last; lengths in characteristic lengths."""
        X, kernel = self.scaled_poses(values), self.kernel(values)
        columns, size = dict(self._columns), self.size
        for joint, _, _ in self.tree:
            if joint.name not in columns:
                columns[joint.name] = slice(size, size + joint.kind.freedoms)
                size += joint.kind.freedoms
        found = {}
        for name in links:
            link, twists = name, np.zeros((6, size))
            while link != self.base:
                joint, parent = self._parent[link]
                sign = 1.0 if joint.links[0] == parent else -1.0
                twists[:, columns[joint.name]] = (
                    sign * np.array(compute_joint_screws(joint, *joint.frames(X))).reshape(-1, 6).T
                )
                link = parent
            found[name] = np.hstack([twists[:, : self.size] @ kernel, twists[:, self.size :]])
        return found

    def apart(self, one: Values, other: Values) -> float:
        """Return the largest difference of the links' poses, lengths in characteristic lengths."""
        X, Y = self.scaled_poses(one), self.scaled_poses(other)
        return max(float(np.abs(X[link] - Y[link]).max()) for link in X)

    def step(self, values: Values, step: Array) -> Values:
        """Return the values after a step in the active coordinates."""
        X, after = self.scaled_poses(values), dict(values)
        for joint in self.active:
            R = joint.frames(X)[0][:3, :3] if values[joint.name].ndim == 2 else ORIGIN[:3, :3]
            after[joint.name] = step_along(joint, values[joint.name], step[self._columns[joint.name]], R)
        return after

    def close(self, values: Values, iterations: int = 60, held: Collection[str] = ()) -> tuple[Values, float]:
        """Return the closed values reached from ``values``, some joints fixed, and the closure residual."""
        before = np.inf
        moving = self.moving(held)

        def system(values: Values) -> tuple[Array, Array]:
            error, J = self.system(values)
            return error, J * moving

        def content(at: Residual) -> bool:
            nonlocal before
            gain, before = before - at.size, at.size
            stalled = 0 < gain < 1e-6 * at.size and at.size < self.noise
            return at.size <= CLOSURE_SOLVER_TOL or stalled or not self.size or self._spent > LOOP_ASSEMBLY_VISITS_MAX

        def propose(values: Values, at: Residual, factor: float) -> Values:
            return self.step(values, self._damped_step(at, factor))

        values, left = descend(values, system, propose, DAMPING, iterations, content)
        return (
            self._polish(values, left, system) if CLOSURE_SOLVER_TOL < left.size < self.noise else (values, left.size)
        )

    def moving(self, held: Collection[str]) -> Array:
        """Return 1 for active coordinates, 0 for those of fixed joints, (size,)."""
        return np.array([float(joint.name not in held) for joint in self.active for _ in range(joint.kind.freedoms)])

    def _polish(
        self, values: Values, at: Residual, system: Callable[[Values], tuple[Array, Array]]
    ) -> tuple[Values, float]:
        """Plain Newton steps, faint directions too, as long as they are short for the residual that they remove."""
        start = (values, at.size)
        for _ in range(10):
            step: Array = np.asarray(-np.linalg.lstsq(at.J, at.error, rcond=RANK_CUTOFF_FRACTION)[0], dtype=float)
            if np.max(np.abs(step), initial=0.0) > NEWTON_STEP_TO_RESIDUAL_MAX * at.size:
                return start
            values = self.step(values, step)
            at = Residual.of(*system(values))
            if at.size <= CLOSURE_SOLVER_TOL:
                return values, at.size
        return start

    def _damped_step(self, at: Residual, factor: float) -> Array:
        """Return the damped step, no longer than ``LOOP_ASSEMBLY_STEP_MAX``; near the solution the plain one without
        weak directions."""
        U, s, Vt = decompose_matrix(at.J)
        if at.size < self.noise and factor <= 1.0:
            kept = s > WEAK_CONSTRAINT_FRACTION * s[0]
            step = -(Vt[kept].T @ ((U.T @ at.error)[kept] / s[kept]))
        else:
            step = -(Vt.T @ (s / (s**2 + factor * max(at.size**2, 1e-12)) * (U.T @ at.error)))
        largest = float(np.max(np.abs(step), initial=0.0))
        return np.asarray(step * min(1.0, LOOP_ASSEMBLY_STEP_MAX / largest) if largest > 0 else step)

    def rank(self, values: Values, cutoff: float = RANK_CUTOFF_FRACTION) -> Rank:
        """Return the rank of the constraints of loops and couplings on the joints in loops."""
        return rank_of(np.asarray(np.linalg.svd(self.system(values)[1], compute_uv=False)), cutoff=cutoff)

    def freedoms(self, rank: Rank) -> int:
        """Return the mobility of the joints in loops for constraints of a rank."""
        return self.size - rank.value

    def kernel(self, values: Values) -> Array:
        """Return a basis (size, mobility) of the velocities that keep the loops closed."""
        _, s, Vt = decompose_matrix(self.system(values)[1], full_matrices=True)
        return np.asarray(Vt[int(np.sum(s > RANK_CUTOFF_FRACTION * max(s, default=1.0))) :].T)

    def worst(self, values: Values) -> tuple[str, float]:
        """Return the loop with the largest closure residual, and this residual."""
        X = self.scaled_poses(values)
        found = [
            (float(np.linalg.norm(compute_closure_error(loop, *loop.frames(X))[0])), loop.name) for loop in self.loops
        ]
        found += [(abs(float(_slip(gear, values)[0])), gear.name) for gear in self.gears]
        miss, name = max(found, default=(0.0, "none"))
        return name, miss

    @property
    def leaders(self) -> tuple[frozenset[str], frozenset[str]]:
        """Return the joints that drive others, motors and couplings, and the motors alone."""
        motors = frozenset(joint.name for joint in self.active if joint.motor is not None)
        followers = {gear.driven for gear in self.gears}
        return motors | {gear.driver for gear in self.gears if gear.driver not in followers}, motors

    def followed(self, values: Values) -> Values:
        """Return the values with each driven joint of a coupling where its driver puts it."""
        found = dict(values)
        for _ in self.gears:  # a driven joint may drive another one
            found |= {gear.driven: gear.ratio * found[gear.driver] + gear.offset for gear in self.gears}
        return found

    def beyond(self, values: Values) -> dict[str, Array]:
        """Return the R and P outside of their limits, each with the nearest value a little within them."""
        found, closing = {}, self.closing(values)
        for joint in [*(joint for joint, _, _ in self.tree), *self.loops]:
            if joint.limits is None or joint.kind not in SINGLE:
                continue
            unit = self.unit(joint)
            lower, upper = (
                far if bound is None else bound / unit
                for bound, far in ((joint.limits.lower, -np.inf), (joint.limits.upper, np.inf))
            )
            value = values.get(joint.name, np.array([closing.get(joint.name, 0.0) / unit]))
            if lower < upper and not lower - EXACT_INCIDENCE_TOL <= value[0] <= upper + EXACT_INCIDENCE_TOL:
                inside = min(LIMIT_INSET_MIN, (upper - lower) / 4)
                found[joint.name] = np.clip(value, lower + inside, upper - inside)
        return found

    def wound(self, values: Values, residual: float) -> tuple[Values, float]:
        """Return the values (and their closure residual) with full rotations added that bring joints within their
        limits."""
        geared = {name for gear in self.gears for name in (gear.driver, gear.driven)}
        free = {joint.name for joint, _, _ in self.tree if joint.kind is JointType.REVOLUTE} - geared
        turns = {
            name: values[name] + 2 * np.pi * np.round((inside - values[name]) / (2 * np.pi))
            for name, inside in self.beyond(values).items()
            if name in free
        }
        still = self.beyond(values | turns)
        return values | {name: value for name, value in turns.items() if name not in still}, residual

    def closing(self, values: Values) -> dict[str, float]:
        """Return the distance from their zero (m, rad) of the R and P that close loops: that of a closure is where all
        tree joints are at zero, that of a joint of the file's tree where its two frames meet."""
        now, then = (
            self.scaled_poses(values),
            self.scaled_poses({joint.name: get_zero_value(joint) for joint, _, _ in self.tree}),
        )
        found = {}
        for spec in self.loops:
            if spec.kind not in SINGLE:
                continue
            X, Y = spec.frames(now)
            X_0, Y_0 = spec.frames(then)
            D, D_0 = invert_pose(X) @ Y, np.eye(4) if spec.in_tree else invert_pose(X_0) @ Y_0
            axis = normalise_vector(spec.axes[0])
            if spec.kind is JointType.PRISMATIC:
                found[spec.name] = float(axis @ (D[:3, 3] - D_0[:3, 3])) * self.length
            else:
                turn = convert_to_quaternions(D[:3, :3] @ D_0[:3, :3].T)
                found[spec.name] = 2 * math.atan2(float(axis @ turn[1:]), float(turn[0]))
        return {name: q for name, q in found.items() if abs(q) > EXACT_INCIDENCE_TOL}

    @classmethod
    def of(cls, mechanism: Mechanism) -> LoopAssembly:
        """Return the assembly of a mechanism's joints: closed at zero."""
        return cls(mechanism.base, joints_of(mechanism), gears_of(mechanism))


def joints_of(mechanism: Mechanism) -> list[JointSpec]:
    """Return a mechanism's joints as a file would give them: both frames at the joint's centre, parallel to the
    base's."""
    found = []
    for joint in mechanism.joints.values():
        one, two = (
            FrameSpec(link, invert_pose(mechanism.links[link].pose) @ build_pose(joint.point)) for link in joint.links
        )
        found.append(JointSpec(joint.name, joint.type, (one, two), joint.axes, in_tree=joint.in_tree))
    return found


def gears_of(mechanism: Mechanism) -> list[CouplingSpec]:
    """Return a mechanism's couplings by the joints that carry their links."""
    carrier = {joint.successor: joint.name for joint in mechanism.joints.values() if joint.in_tree}
    return [
        CouplingSpec(each.name, carrier[each.predecessor], carrier[each.successor], each.ratio)
        for each in mechanism.couplings
    ]


@dataclass(frozen=True, eq=False)
class LoopSolution:
    """Closed values, their closure residual, and True if a random push was needed."""

    values: Values
    residual: float
    pushed: bool = False
    beyond: tuple[str, ...] = ()
    """Joints outside of their limits."""


def solve(assembly: LoopAssembly, seed: int = 0) -> LoopSolution:
    """Close all loops from zero, within the joint limits if possible: by passive joints, else by drivers of couplings
    too, else by all. If that stalls (flat and collinear configurations), from randomly pushed values too."""
    found: list[LoopSolution] = []
    start = assembly.followed(assembly.zero())
    for held in dict.fromkeys((*assembly.leaders, frozenset[str]())):
        rng = np.random.default_rng(seed)
        for number in range(LOOP_ASSEMBLY_TRIES_MAX + 1 if not held else FIXED_JOINT_TRIES_COUNT):
            values = start
            if number:
                push = (0.1, 0.3, 0.6, 1.0)[min(3, (number - 1) // 6)]
                values = assembly.step(start, push * rng.normal(size=assembly.size) * assembly.moving(held))
            solution = _within_limits(assembly, values, held, number > 0)
            found.append(solution)
            if solution.residual <= assembly.noise and not solution.beyond:
                return solution
            if any(each.residual <= assembly.noise for each in found) and number >= FIXED_JOINT_TRIES_COUNT:
                break
    return min(found, key=lambda each: each.residual if each.residual > assembly.noise else 0.0)


def _within_limits(assembly: LoopAssembly, values: Values, held: frozenset[str], pushed: bool) -> LoopSolution:
    """Return the closed values; for joints outside of their limits, with these fixed within them, or released again
    where the closure residual is smallest."""
    values, residual = assembly.wound(*assembly.close(values, held=held))
    first = LoopSolution(values, residual, pushed, tuple(assembly.beyond(values)))
    for _ in range(FIXED_JOINT_TRIES_COUNT if residual <= assembly.noise else 0):
        inside = {name: value for name, value in assembly.beyond(values).items() if name in values and name not in held}
        if not inside:
            break
        near, left = assembly.wound(*assembly.close(assembly.followed(values | inside), held=held | inside.keys()))
        values, residual = assembly.wound(*assembly.close(near, held=held))
        if left <= assembly.noise:
            values, residual, held = near, left, held | inside.keys()
    if residual <= assembly.noise and not assembly.beyond(values):
        return LoopSolution(values, residual, pushed)
    return first


def regular_values(assembly: LoopAssembly, values: Values) -> Values | None:
    """Return nearby closed values at which the loops have a lower mobility or a much larger smallest singular value, if
    ``values`` are singular or nearly so; else, or if none are found, None."""
    here = assembly.rank(values)
    if assembly.freedoms(here) == 0:
        return None
    kernel = assembly.kernel(values)
    found: list[tuple[int, float, Values]] = []
    rng = np.random.default_rng(0)

    def look(size: float, direction: Array) -> bool:
        """Return True if a step leads to closed values; they are kept if the loops have a higher rank, or a clearer
        one, there."""
        there, residual = assembly.close(assembly.step(values, size / float(np.max(np.abs(direction))) * direction))
        rank = assembly.rank(there)
        if (
            residual <= 10 * CLOSURE_SOLVER_TOL
            and rank.gap >= RANK_GAP_MIN
            and (
                rank.value > here.value
                or (rank.value == here.value and rank.weakest > FIRMER_ZERO_MIN_FRACTION * here.weakest)
            )
        ):
            found.append((rank.value, rank.weakest, there))
        return residual <= 10 * CLOSURE_SOLVER_TOL

    closed = [look(size, kernel @ rng.normal(size=kernel.shape[1])) for size in (0.3, 0.15, 0.5)]
    if (
        here.weakest > NEARLY_SINGULAR_ZERO_FRACTION
        and any(closed)
        and not any(value > here.value for value, _, _ in found)
    ):
        return None
    every = rng.permutation(kernel @ kernel.T)  # each joint moved, as the loops allow
    ways = [way for way in every if np.max(np.abs(way)) > VECTOR_LENGTH_MIN][: LOOP_ASSEMBLY_TRIES_MAX // 2]
    for size in SINGULAR_STEPS:
        before = len(found)
        for way in ways:
            look(size, way)
            look(size, -way)
        most = max((value for value, _, _ in found), default=0)
        firm = [each for each in found[before:] if each[0] == most and each[1] > NEARLY_SINGULAR_ZERO_FRACTION]
        if firm:
            there = max(firm, key=lambda each: each[1])[2]
            return regular_values(assembly, there) or there  # other loops may still be singular
    return max(found, key=lambda each: each[:2])[2] if found else None


def _slip(gear: CouplingSpec, values: Values) -> Array:
    """Return the residual of a coupling, (1,)."""
    return values[gear.driven][:1] - gear.ratio * values[gear.driver][:1] - gear.offset


def _scale(joint: JointSpec, length: float) -> JointSpec:
    one, two = (FrameSpec(end.link, scale_pose(end.X, 1 / length), end.line) for end in joint.ends)
    return replace(joint, ends=(one, two))


def _spread(base: str, tree: Sequence[TreeJoint]) -> float:
    """Return the characteristic length (m): mean distance of the joints' centres from their centroid, all at zero."""
    if not tree:
        return 1.0
    X = compute_zero_poses(base, tree)
    points = np.array([(X[parent] @ joint.ends[joint.links[0] != parent].X)[:3, 3] for joint, parent, _ in tree])
    spread = float(np.mean(np.linalg.norm(points - np.mean(points, axis=0), axis=1)))
    return spread if spread > 1e-9 else 1.0
