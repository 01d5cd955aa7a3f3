"""Closing of the loops of a joint graph: tree joints are moved until the two frames of every other joint meet.

Pinocchio's model of a spanning tree, with constraints between the frames of the other joints. Damped Gauss-Newton on
the coordinates of the tree joints that lie in loops. Directions in which the loops hardly resist (redundant
constraints, disturbed by rounded numbers) are not followed. Lengths in characteristic lengths.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from ...geometry.ranks import Rank, decompose_matrix, draw_in_space, rank_of
from ...geometry.so3 import turn_about
from ...geometry.vectors import Array, invert_pose, normalise_vector
from ...mechanism.model import JointType, Mechanism
from ...mechanism.screws import split_elementary
from ...solving.gauss_newton import DampingFactor, Residual, descend
from ...tolerances import (
    CLOSURE_SOLVER_TOL,
    DIRECTION_SINE_TOL,
    EXACT_INCIDENCE_TOL,
    INCIDENCE_TOL,
    LOOP_COORDINATES_MAX,
    RANK_CUTOFF_FRACTION,
    RANK_GAP_MIN,
    VECTOR_LENGTH_MIN,
)
from ..conversion import list_coupling_specs, list_joint_specs
from ..jointgraph import (
    ORIGIN,
    CouplingSpec,
    JointSpec,
    Posture,
    TreeJoint,
    build_spanning_tree,
    compute_zero_poses,
    scale_pose,
)
from ..jointmotion import compute_closure_errors

WEAK_CONSTRAINT_FRACTION = 1e-3
"""Relative singular value of a file's loops below which only rounding constrains a direction."""
LIMIT_INSET_MIN = 0.1
"""Distance (radians, characteristic lengths) inside its limits at which a joint starts when loops close beyond them."""
NEARLY_SINGULAR_ZERO_FRACTION = 5e-3
"""Relative smallest singular value below which a foreign file's zero configuration is replaced."""
NEWTON_STEP_TO_RESIDUAL_MAX = 1e4
"""Length of a Newton step in a foreign file's loops, per residual, beyond which it follows rounding."""
LOOP_ASSEMBLY_STEP_MAX = 0.4
"""Largest change of a coordinate per step of the loop solver (characteristic lengths, radians)."""
LOOP_ASSEMBLY_VISITS_MAX = 100_000
"""Work limit of the loop solver in joint visits (some seconds)."""
LOOP_ASSEMBLY_TRIES_MAX = 24
"""Random restarts of the loop solver."""
FIXED_JOINT_TRIES_COUNT = 4
"""Restarts with motors, or joints at their limits, locked."""
SINGULAR_STEPS = (0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0)
"""Steps (radians, characteristic lengths) that leave a singular zero configuration; the first that does is used."""
FIRMER_ZERO_MIN_FRACTION = 2.0
"""Factor by which another configuration must be less singular to replace a nearly singular zero."""

DAMPING = DampingFactor(start=1.0, eased=0.1, least=1e-3, most=1e6)
SINGLE = (JointType.REVOLUTE, JointType.PRISMATIC)
_BALLS = (JointType.SPHERICAL, JointType.FREE)
Values = Array
"""Configuration (nq,) of Pinocchio's model of the spanning tree."""


class LoopAssembly:
    """Spanning tree of a joint graph as a Pinocchio model, with constraints that close its loops, and couplings.

    Zero may be a keyframe. Lengths inside are characteristic lengths; limits, keyframes and coordinates are in metres.
    A closure residual below ``noise`` may be due to rounding.
    """

    def __init__(
        self, base: str, joints: Sequence[JointSpec], gears: Sequence[CouplingSpec] = (), start: Posture | None = None
    ) -> None:
        import pinocchio as pin

        self.base, self.noise, self._start, self._pin = base, INCIDENCE_TOL, start or {}, pin
        self.tree = build_spanning_tree(base, joints)
        self.length = _spread(base, self.tree)
        self.model = pin.Model()
        self._bodies = {base: (0, pin.SE3.Identity())}
        self._columns: dict[str, NDArray[np.intp]] = {}
        self._units = np.zeros(0)
        for joint, parent, child in self.tree:
            self._add(joint, parent, child)
        self.loops = [
            joint for joint in joints if joint.name not in self._columns and self._bodies.keys() >= {*joint.links}
        ]
        through = np.zeros((len(self.loops), self.model.nv), dtype=bool)
        self._closures, self._misses = pin.StdVec_ConstraintModel(), pin.StdVec_ConstraintData()
        for number, loop in enumerate(self.loops):
            (one, X), (two, Y) = (self._bodies[str(end.link)] for end in loop.ends)
            X, Y = (Z * self._place(end.X) for Z, end in zip((X, Y), loop.ends, strict=True))
            self._closures.append(pin.ConstraintModel(pin.FrameAnchorConstraintModel(self.model, one, X, two, Y)))
            self._misses.append(self._closures[-1].createData())
            for body in {*self.model.supports[one]} ^ {*self.model.supports[two]}:
                through[number, self.model.idx_vs[body] :][: self.model.nvs[body]] = True
        self._through, moved = through, np.asarray(through.any(axis=0))
        first = {name: columns[0] for name, columns in self._columns.items() if columns.size}
        self.gears = [gear for gear in gears if first.keys() >= {gear.driver, gear.driven}]
        self._couplings: list[tuple[np.intp, np.intp, Polynomial]] = []
        for gear in self.gears:
            driver, driven = first[gear.driver], first[gear.driven]
            gear = gear.scaled(1 / self._units[driver], 1 / self._units[driven])
            self._couplings.append((driver, driven, gear.polynomial))
            moved[[driven, driver]] = True
        self.active = [joint for joint, _, _ in self.tree if moved[self._columns[joint.name]].any()]
        self._moved, self._loose = np.flatnonzero(moved), np.flatnonzero(~moved)
        self.size = len(self._moved)
        self._effort = len(self.tree) + len(self.loops) + self.size**2 // 50
        self._spent = 0

    def _add(self, joint: JointSpec, parent: str, child: str) -> None:
        """Add a joint of the tree: one for each dof, or a ball; in reverse order if the child is the predecessor."""
        pin, parts = self._pin, split_elementary(joint.kind, joint.axes)
        forward, ball = joint.links[0] == parent, joint.kind in _BALLS
        near, far = joint.ends if forward else joint.ends[::-1]
        way = 1 if forward or ball else -1
        slide, turn = pin.JointModelPrismaticUnaligned, pin.JointModelRevoluteUnaligned
        motions = [
            (slide if kind is JointType.PRISMATIC else turn)(way * normalise_vector(axis))
            for kind, axis in parts[::way]
        ]
        if ball:
            motions = [pin.JointModelFreeFlyer() if joint.kind is JointType.FREE else pin.JointModelSpherical()]
        body, X = self._bodies[parent]
        X = X * self._place(near.X)
        for motion in motions:
            body, X = self.model.addJoint(body, motion, X, str(self.model.njoints)), pin.SE3.Identity()
        self._bodies[child] = body, X * self._place(far.X).inverse()
        self._columns[joint.name] = np.arange(len(self._units), self.model.nv)[::way]
        units = [self.length if kind is JointType.PRISMATIC else 1.0 for kind, _ in parts[::way]]
        self._units = np.concatenate([self._units, units])

    def _place(self, X: Array) -> Any:
        """Return a pose (4, 4) in metres as Pinocchio's, its lengths in characteristic lengths."""
        return self._pin.SE3(np.array(X[:3, :3]), X[:3, 3] / self.length)

    @cached_property
    def _data(self) -> Any:
        return self.model.createData()

    @property
    def is_too_large(self) -> bool:
        """There are too many coordinates for Pinocchio's data: its memory grows with their third power."""
        return self.size > 0 and max(self.model.nv, len(self.loops)) > LOOP_COORDINATES_MAX

    def zero(self) -> Values:
        """Return the values with all tree joints at zero, or in the keyframe."""
        step = np.zeros(self.model.nv)
        for joint, parent, _ in self.tree:
            value, columns = self._start.get(joint.name, np.zeros(0)), self._columns[joint.name]
            if joint.kind in _BALLS and value.ndim == 2:
                X = self._place(value if joint.links[0] == parent else invert_pose(value))
                step[columns] = self._pin.log6(X).vector[-len(columns) :]
            elif joint.kind not in _BALLS and value.shape == columns.shape:
                step[columns] = value / self._units[columns]
        return self._integrate(self._pin.neutral(self.model), step)

    def _integrate(self, values: Values, step: Array) -> Values:
        return np.asarray(self._pin.integrate(self.model, values, step))

    def _measure(self, values: Values) -> Array:
        """Return the coordinates (nv,), lengths in characteristic lengths."""
        return np.asarray(self._pin.difference(self.model, self._pin.neutral(self.model), values))

    def coordinates(self, values: Values) -> dict[str, Array]:
        """Return the coordinates (m, rad) of the tree joints: of a spherical joint the rotation vector, of a free joint
        the twist, of its link farther from the base."""
        q = self._units * self._measure(values)
        return {name: q[columns] for name, columns in self._columns.items()}

    def with_coordinates(self, values: Values, wanted: Mapping[str, float]) -> Values:
        """Return the values with R and P of the tree at these coordinates (m, rad)."""
        step, q = np.zeros(self.model.nv), self._measure(values)
        for name, value in wanted.items():
            step[self._columns[name]] = value / self._units[self._columns[name]] - q[self._columns[name]]
        return self._integrate(values, step)

    def scaled_poses(self, values: Values) -> dict[str, Array]:
        """Return the pose (4, 4) of every link in the base frame, lengths in characteristic lengths."""
        model, placements = self.model, [self._pin.SE3.Identity()]
        for number in range(1, model.njoints):  # without the data of the whole model, which large trees do not have
            motion = model.joints[number].createData()
            model.joints[number].calc(motion, values)
            placements.append(placements[model.parents[number]] * model.jointPlacements[number] * motion.M)
        return {link: (placements[body] * X).homogeneous for link, (body, X) in self._bodies.items()}

    def poses(self, values: Values) -> dict[str, Array]:
        """Return the pose (4, 4) of every link in the base frame, in metres."""
        return {link: scale_pose(X, self.length) for link, X in self.scaled_poses(values).items()}

    def _relate(self, values: Values) -> tuple[Array, Array]:
        """Return the pose (k, 4, 4) of the second frame of every loop in its first, and its twist there for unit rates
        of the coordinates (k, 6, nv)."""
        if not self.loops:
            return np.zeros((0, 4, 4)), np.zeros((0, 6, self.model.nv))
        self._pin.computeJointJacobians(self.model, self._data, values)
        for closure, miss in zip(self._closures, self._misses, strict=True):
            closure.calc(self.model, self._data, miss)
        J = self._pin.getConstraintsJacobian(self.model, self._data, self._closures, self._misses)
        D = np.array([miss.extract().c1Mc2.homogeneous for miss in self._misses])
        return D, J.reshape(-1, 6, self.model.nv)

    def _couple(self, values: Values) -> tuple[Array, Array]:
        """Return the residuals of the couplings (c,), and their derivatives by the coordinates (c, nv)."""
        x, errors = self._measure(values), np.zeros(len(self._couplings))
        rows = np.zeros((len(errors), self.model.nv))
        for number, (driver, driven, law) in enumerate(self._couplings):
            errors[number] = x[driven] - law(x[driver])
            rows[number, driven] += 1.0
            rows[number, driver] -= law.deriv()(x[driver])
        return errors, rows

    def system(self, values: Values) -> tuple[Array, Array]:
        """Return the closure residual of all loops and couplings (rows,), and its derivative by the active coordinates
        (rows, size)."""
        self._spent += self._effort
        D, twists = self._relate(values)
        errors, wrenches, of = compute_closure_errors(self.loops, D)
        slips, slopes = self._couple(values)
        rows = np.vstack([(wrenches[:, None] @ twists[of])[:, 0], slopes])
        return np.concatenate([errors, slips]), rows[:, self._moved]

    def find_still_joints(self, values: Values) -> set[str]:
        """Return the joints in loops that no velocity moves."""
        rates = np.zeros(self.model.nv)
        rates[self._moved] = np.linalg.norm(self.kernel(values), axis=1)
        return {joint.name for joint in self.active if rates[self._columns[joint.name]].max() < DIRECTION_SINE_TOL}

    def list_loop_joints(self, name: str) -> list[str]:
        """Return the joints of the tree in the loop that a joint closes; none if it closes none."""
        passed = np.array([loop.name == name for loop in self.loops]) @ self._through
        return [joint.name for joint in self.active if passed[self._columns[joint.name]].any()]

    def velocities(self, values: Values, links: Iterable[str]) -> dict[str, Array]:
        """Return the twists (6, n) of links (linear at the base origin, angular) for a basis of the velocities that
        keep the loops closed, joints in no loop last; lengths in characteristic lengths."""
        kernel, found = self.kernel(values), {}
        self._pin.computeJointJacobians(self.model, self._data, values)
        for link in links:
            J = self._pin.getJointJacobian(self.model, self._data, self._bodies[link][0], self._pin.WORLD)
            found[link] = np.hstack([J[:, self._moved] @ kernel, J[:, self._loose]])
        return found

    def apart(self, one: Values, other: Values) -> float:
        """Return the largest difference of the links' poses, lengths in characteristic lengths."""
        X, Y = self.scaled_poses(one), self.scaled_poses(other)
        return max(float(np.abs(X[link] - Y[link]).max()) for link in X)

    def step(self, values: Values, step: Array, loose: Array | float = 0.0) -> Values:
        """Return the values after a step in the active coordinates, and one of joints in no loop."""
        whole = np.zeros(self.model.nv)
        whole[self._moved], whole[self._loose] = step, loose
        return self._integrate(values, whole)

    def draw(self, values: Values, size: float, rng: np.random.Generator) -> Values:
        """Return the values a random step ahead that keeps the loops closed to first order; no coordinate moves more
        than ``size``."""
        step = draw_in_space(self.kernel(values), rng)
        return self.step(values, size / max(float(np.max(np.abs(step), initial=0.0)), EXACT_INCIDENCE_TOL) * step)

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
        moving = np.ones(self.model.nv)
        for name in held:
            moving[self._columns[name]] = 0.0
        return moving[self._moved]

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

    def misses(self, values: Values) -> dict[str, float]:
        """Return the closure residual of each loop, then of each coupling."""
        errors, _, of = compute_closure_errors(self.loops, self._relate(values)[0])
        sizes = *np.sqrt(np.bincount(of, errors**2, len(self.loops))), *np.abs(self._couple(values)[0])
        names = [*(loop.name for loop in self.loops), *(gear.name for gear in self.gears)]
        return {name: float(size) for name, size in zip(names, sizes, strict=True)}

    def worst(self, values: Values) -> tuple[str, float]:
        """Return the loop with the largest closure residual, and this residual."""
        miss, name = max(((miss, name) for name, miss in self.misses(values).items()), default=(0.0, "none"))
        return name, miss

    @property
    def leaders(self) -> tuple[frozenset[str], frozenset[str]]:
        """Return the joints that drive others, motors and couplings, and the motors alone."""
        motors = frozenset(joint.name for joint in self.active if joint.motor is not None)
        followers = {gear.driven for gear in self.gears}
        return motors | {gear.driver for gear in self.gears if gear.driver not in followers}, motors

    def followed(self, values: Values) -> Values:
        """Return the values with each driven joint of a coupling where its driver puts it."""
        before = self._measure(values)
        after = before.copy()
        for _ in self.gears:  # a driven joint may drive another one
            for driver, driven, law in self._couplings:
                after[driven] = law(after[driver])
        return self._integrate(values, after - before)

    def beyond(self, values: Values) -> dict[str, float]:
        """Return the R and P outside of their limits, each with the nearest coordinate (m, rad) a little within
        them."""
        found, known = {}, self.closing(values) | self.singles(values)
        for joint in [*(joint for joint, _, _ in self.tree), *self.loops]:
            if joint.limits is None or joint.kind not in SINGLE:
                continue
            lower = -np.inf if joint.limits.lower is None else joint.limits.lower
            upper = np.inf if joint.limits.upper is None else joint.limits.upper
            q, unit = known.get(joint.name, 0.0), self.length if joint.kind is JointType.PRISMATIC else 1.0
            if lower < upper and not lower - EXACT_INCIDENCE_TOL * unit <= q <= upper + EXACT_INCIDENCE_TOL * unit:
                inside = min(LIMIT_INSET_MIN * unit, (upper - lower) / 4)
                found[joint.name] = float(np.clip(q, lower + inside, upper - inside))
        return found

    def singles(self, values: Values) -> dict[str, float]:
        """Return the coordinates (m, rad) of the R and P of the tree."""
        q = self.coordinates(values)
        return {joint.name: float(q[joint.name][0]) for joint, _, _ in self.tree if joint.kind in SINGLE}

    def wound(self, values: Values, residual: float) -> tuple[Values, float]:
        """Return the values (and their closure residual) with full rotations added that bring joints within their
        limits."""
        geared = {name for gear in self.gears for name in (gear.driver, gear.driven)}
        free = {joint.name for joint, _, _ in self.tree if joint.kind is JointType.REVOLUTE} - geared
        q = self.singles(values)
        turns = {
            name: q[name] + 2 * np.pi * np.round((inside - q[name]) / (2 * np.pi))
            for name, inside in self.beyond(values).items()
            if name in free
        }
        still = self.beyond(self.with_coordinates(values, turns))
        turns = {name: turn for name, turn in turns.items() if name not in still}
        return self.with_coordinates(values, turns), residual

    def closing(self, values: Values) -> dict[str, float]:
        """Return the distance from their zero (m, rad) of the R and P that close loops: that of a closure is where all
        tree joints are at zero, that of a joint of the file's tree where its two frames meet."""
        now, then = (self._relate(each)[0] for each in (values, self._pin.neutral(self.model)))
        found = {}
        for spec, D, D_0 in zip(self.loops, now, then, strict=True):
            X = ORIGIN if spec.in_tree else D_0
            if spec.kind is JointType.PRISMATIC:
                found[spec.name] = float(normalise_vector(spec.axes[0]) @ (D - X)[:3, 3]) * self.length
            elif spec.kind is JointType.REVOLUTE:
                found[spec.name] = turn_about(normalise_vector(spec.axes[0]), D[:3, :3] @ X[:3, :3].T)[0]
        return {name: q for name, q in found.items() if abs(q) > EXACT_INCIDENCE_TOL}

    @classmethod
    def of(cls, mechanism: Mechanism) -> LoopAssembly:
        """Return the assembly of a mechanism's joints: closed at zero."""
        return cls(mechanism.base, list_joint_specs(mechanism), list_coupling_specs(mechanism))


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
        movable = assembly.singles(values).keys() - held
        inside = {name: q for name, q in assembly.beyond(values).items() if name in movable}
        if not inside:
            break
        near, left = assembly.wound(
            *assembly.close(assembly.followed(assembly.with_coordinates(values, inside)), held=held | inside.keys())
        )
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
    found: list[tuple[int, float, Values]] = []
    rng = np.random.default_rng(0)

    def look(ahead: Values) -> bool:
        """Return True if a step leads to closed values; they are kept if the loops have a higher rank, or a clearer
        one, there."""
        there, residual = assembly.close(ahead)
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

    closed = [look(assembly.draw(values, size, rng)) for size in (0.3, 0.15, 0.5)]
    if (
        here.weakest > NEARLY_SINGULAR_ZERO_FRACTION
        and any(closed)
        and not any(value > here.value for value, _, _ in found)
    ):
        return None
    kernel = assembly.kernel(values)
    every = rng.permutation(kernel @ kernel.T)  # each joint moved, as the loops allow
    sizes = [np.max(np.abs(way)) for way in every]
    ways = [way / size for way, size in zip(every, sizes, strict=True) if size > VECTOR_LENGTH_MIN]
    for size in SINGULAR_STEPS:
        before = len(found)
        for way in ways[: LOOP_ASSEMBLY_TRIES_MAX // 2]:
            look(assembly.step(values, size * way))
            look(assembly.step(values, -size * way))
        most = max((value for value, _, _ in found), default=0)
        firm = [each for each in found[before:] if each[0] == most and each[1] > NEARLY_SINGULAR_ZERO_FRACTION]
        if firm:
            there = max(firm, key=lambda each: each[1])[2]
            further = regular_values(assembly, there)  # other loops may still be singular
            return there if further is None else further
    return max(found, key=lambda each: each[:2])[2] if found else None


def _spread(base: str, tree: Sequence[TreeJoint]) -> float:
    """Return the characteristic length (m): mean distance of the joints' centres from their centroid, all at zero."""
    if not tree:
        return 1.0
    X = compute_zero_poses(base, tree)
    points = np.array([(X[parent] @ joint.ends[joint.links[0] != parent].X)[:3, 3] for joint, parent, _ in tree])
    spread = float(np.mean(np.linalg.norm(points - np.mean(points, axis=0), axis=1)))
    return spread if spread > 1e-9 else 1.0
