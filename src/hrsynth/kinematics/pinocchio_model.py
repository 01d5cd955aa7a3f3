"""Pinocchio model of a mechanism: a spanning tree and exact loop constraints for every joint type.

Lengths are in characteristic lengths of the given mechanism (``length``), so that Jacobians mix no metres with radians.
Every tree joint's frame has the base's orientation at the zero configuration. A spherical loop joins two points; any
other loop is cut through the joint: the joint is added as a leaf and the leaf welded to the other link
(:mod:`.loop_rows`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
import pinocchio as pin

from ..errors import BadMechanism, BadRequest
from ..geometry.so3 import convert_rotations_to_vectors, decompose_rotation
from ..geometry.vectors import Array, invert_pose, transform
from ..mechanism import Joint, JointType, Mechanism, graphs
from ..mechanism.screws import split_elementary
from ..tolerances import CLOSURE_RESIDUAL_TOL, GEAR_RATIO_MAX, GEOMETRY_DIFFERENCE_TOL
from .loop_rows import LoopRows, Places, read_numbers

MODEL_COORDINATES_MAX = 256
"""Coordinates above which a mechanism is refused: Pinocchio's data hold several cubes of their number."""

_UPRIGHT = np.eye(3)


class PinocchioModel:
    """Pinocchio model of a mechanism; ``at(q)`` brings its kinematics up to date."""

    def __init__(self, mechanism: Mechanism, length: float | None = None) -> None:
        self.mechanism = mechanism
        self.length = mechanism.length if length is None else length
        self.model = pin.Model()
        self._body: dict[str, int] = {mechanism.base: 0}
        self._centre: dict[int, Array] = {0: np.zeros(3)}
        self.coordinates: dict[str, tuple[int, ...]] = {}
        """Velocity indices of each joint, in the order of its axes."""
        self._parts: list[tuple[Joint, str, tuple[str, ...]]] = []
        tree, loops = self._span()
        for joint, parent in tree:
            still = joint.type is JointType.FIXED
            self._body[joint.other(parent)] = self._body[parent] if still else self._add(joint, parent, "")
        ends = [self._loop(joint) for joint in loops]
        self.spanned = tuple(joint for joint, _ in tree), tuple(loops)
        """Joints of the tree, from the base outwards, and those at which loops are cut."""
        self._gears = self._gear_rows()
        self._geared = len(self._gears) > 0
        if self.model.nv > MODEL_COORDINATES_MAX:
            raise BadRequest(f"{mechanism.name}: joint coordinates", self.model.nv, f"at most {MODEL_COORDINATES_MAX}")
        self.data = self.model.createData()
        self.nv: int = self.model.nv
        self.q0: Array = pin.neutral(self.model)
        self._links = {name: (self._body[name], self._pose_from_body(name)) for name in mechanism.links}
        self._placements, self._screws = read_numbers(self.data.oMi), self.data.J.reshape(6, self.nv)
        self._several: dict[tuple[str, ...], tuple[Places, Array, Array]] = {}
        self._masks = {0: np.zeros(self.nv)}
        self._rows = LoopRows(self.model, self.data, ends, self._supports)
        self._q: Array | None = None
        self.measured: tuple[tuple[object, ...], Array, tuple[Array, Array, list[Array], list[Array]]] | None = None
        """Last measured values: their observations, configuration and result."""

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.mechanism.name}>"

    def __reduce__(self) -> tuple[type[PinocchioModel], tuple[Mechanism, float]]:
        """Pickled and copied by its recipe: Pinocchio's own objects are built again."""
        return type(self), (self.mechanism, self.length)

    @cached_property
    def loops(self) -> tuple[str, ...]:
        """The names of the loops, as the file has them: each cut that the file has elsewhere is called by a loop of the
        file in the ring that it closes, no two by the same (the exchange of two spanning trees)."""
        tree, cuts = self.spanned
        way: dict[str, frozenset[str]] = {self.mechanism.base: frozenset()}
        for joint, near, far in graphs.order_outward(self.mechanism.base, tree):
            way[far] = way[near] | {joint.name}
        rings = {
            joint.name: [
                name
                for name in (joint.name, *sorted(way[joint.predecessor] ^ way[joint.successor]))
                if not self.mechanism.joints[name].in_tree
            ]
            for joint in cuts
        }
        called: dict[str, str] = {}

        def give(name: str, asked: set[str]) -> bool:
            for loop in rings[name]:
                if loop not in asked:
                    asked.add(loop)
                    if loop not in called or give(called[loop], asked):
                        called[loop] = name
                        return True
            return False

        for name in rings:
            give(name, set())
        names = {name: loop for loop, name in called.items()}
        return tuple(names.get(joint.name, joint.name) for joint in cuts)

    def _pose_from_body(self, link: str) -> Array:
        X = self.mechanism.links[link].pose.copy()
        X[:3, 3] -= self._centre[self._body[link]] * self.length
        return X

    def _span(self) -> tuple[list[tuple[Joint, str]], list[Joint]]:
        mechanism = self.mechanism
        joints = [joint for joint in mechanism.joints.values() if joint.name not in mechanism.idle]
        coupled = mechanism.coupled_joints
        weights = [(joint.type.freedoms, joint.name not in coupled) for joint in joints]
        tree = graphs.build_spanning_forest(mechanism.links, joints, weights)
        ordered = [(joint, parent) for joint, parent, _ in graphs.order_outward(mechanism.base, tree)]
        if len(ordered) != len(mechanism.links) - 1:
            reached = {mechanism.base, *(child.other(parent) for child, parent in ordered)}
            missing = sorted(set(mechanism.links) - reached)
            raise BadMechanism(
                f"{mechanism.name}: links that no joint connects to the base",
                ", ".join(missing),
                remedy="Connect each to another link.",
            )
        used = {joint.name for joint, _ in ordered}
        driven = ", ".join(name for name in mechanism.idle if mechanism.joints[name].is_actuated)
        if driven:
            raise BadMechanism(
                f"{mechanism.name}: a motor on a floating joint whose link other joints hold",
                driven,
                remedy="Put the motors on these joints.",
            )
        return ordered, [joint for joint in joints if joint.name not in used]

    def _chain(self, joint: Joint, parent: str) -> list[object]:
        """Pinocchio's joint models for a joint seen from ``parent``."""
        turned = joint if joint.predecessor == parent else joint.turned()
        match joint.type:
            case JointType.SPHERICAL:
                return [pin.JointModelSpherical()]
            case JointType.FREE:
                return [pin.JointModelFreeFlyer()]
            case _:
                return [
                    pin.JointModelPrismaticUnaligned(axis)
                    if kind is JointType.PRISMATIC
                    else pin.JointModelRevoluteUnaligned(axis)
                    for kind, axis in split_elementary(joint.type, turned.axes, choose_slide_direction)
                ]

    def _add(self, joint: Joint, parent: str, suffix: str) -> int:
        """Add the joint models on ``parent``; the last one's index. Its frame sits at the joint's centre."""
        index = self._body[parent]
        turned = joint.predecessor != parent
        point = joint.point / self.length
        placement = pin.SE3(_UPRIGHT, point - self._centre[index])
        start = self.model.nv
        names = []
        for number, model in enumerate(self._chain(joint, parent)):
            names.append(f"{joint.name}{suffix}{number or ''}")
            index = self.model.addJoint(index, model, placement, names[-1])
            placement = pin.SE3.Identity()
        self._parts.append((joint, parent, tuple(names)))
        self._centre[index] = point
        span = range(start, self.model.nv)
        swapped = turned and joint.type is JointType.UNIVERSAL
        self.coordinates[joint.name] = tuple(reversed(span)) if swapped else tuple(span)
        return index

    def _loop(self, joint: Joint) -> tuple[int, int, bool]:
        """The two frames of a loop, and whether a ball holds their points together: one that no motor turns."""
        near, far = (self._body[link] for link in joint.links)
        ball = joint.type is JointType.SPHERICAL and not joint.is_actuated
        if not ball and joint.type is not JointType.FIXED:
            near = self._add(joint, joint.predecessor, "__cut")
        point = joint.point / self.length
        first, second = (
            self.model.addFrame(
                pin.Frame(
                    f"{joint.name}__{end}", body, pin.SE3(_UPRIGHT, point - self._centre[body]), pin.FrameType.OP_FRAME
                )
            )
            for end, body in enumerate((near, far))
        )
        return first, second, ball

    def _gear_rows(self) -> Array:
        """One row a coupling: the driven joint's rate − ratio × the driver's (metres, radians)."""
        rows = np.zeros((len(self.mechanism.couplings), self.model.nv))
        for row, coupling in zip(rows, self.mechanism.couplings, strict=True):
            for name, factor in ((coupling.driven, 1.0), (coupling.driver, -coupling.ratio)):
                unit = self.length if self.mechanism.joints[name].type is JointType.PRISMATIC else 1.0
                row[self.coordinates[name][0]] += factor * unit
        return rows

    def parts(self) -> list[tuple[Joint, str, tuple[str, ...]]]:
        """Return the joints of the tree and the cut ones: each with its link and the names of its parts."""
        return list(self._parts)

    def start(self, part: str) -> int:
        """Return the start index in q of a joint's part."""
        return int(self.model.joints[self.model.getJointId(part)].idx_q)

    def at(self, q: Array) -> None:
        """Bring placements and the screws of the joints up to date with ``q``."""
        if self._q is not q:
            model, data = self.model, self.data
            pin.computeJointJacobians(model, data, q)
            pin.updateFramePlacements(model, data)
            self._q = q

    def residual(self, q: Array) -> Array:
        """Loop residuals, stacked in the order of ``loops`` (characteristic lengths, radians)."""
        self.at(q)
        errors = self._rows.residual()
        return np.concatenate([errors, self._gear_errors(q)]) if self._geared else errors

    def _gear_errors(self, q: Array) -> Array:
        """Return the residuals of the couplings."""
        return np.asarray(self._gears @ pin.difference(self.model, self.q0, q))

    def gear_errors(self, q: Array) -> dict[str, float]:
        """Return the residual of each coupling (m, rad)."""
        return dict(zip((each.name for each in self.mechanism.couplings), self._gear_errors(q).tolist(), strict=True))

    def jacobian(self, q: Array) -> Array:
        """The derivative of :meth:`residual` at closure, shape (rows, nv)."""
        self.at(q)
        J = self._rows.jacobian()
        return np.vstack([J, self._gears]) if self._geared else J

    @property
    def blocks(self) -> tuple[tuple[str, ...], tuple[int, ...]]:
        """Owners of the rows of :meth:`jacobian`: names of loops, then of couplings, and rows of each."""
        gears = tuple(coupling.name for coupling in self.mechanism.couplings)
        return (*self.loops, *gears), (*self._rows.sizes, *[1] * len(gears))

    def worst_loop(self, q: Array) -> tuple[str, float]:
        """Return the loop with the largest residual, and that residual."""
        parts = np.split(self.residual(q), np.cumsum(self._rows.sizes))
        misses = [(float(np.linalg.norm(part)), name) for part, name in zip(parts, self.loops, strict=False)]
        miss, name = max(misses, default=(0.0, "none"))
        return name, miss

    def pose(self, q: Array, link: str) -> Array:
        """X_BL of a link in the base frame (4, 4), metres."""
        self.at(q)
        body, offset = self._links[link]
        if body == 0:
            return offset
        placement: Array = self.data.oMi[body].homogeneous
        placement[:3, 3] *= self.length
        return placement @ offset

    def velocity(self, q: Array, link: str) -> Array:
        """V (6, nv): joint rates to the (linear, angular) velocity of the link frame's origin, base axes; linear part
        in characteristic lengths a second."""
        self.at(q)
        return self.frames(q, (link,))[1][0]

    def frames(self, q: Array, links: tuple[str, ...], whole: int | None = None) -> tuple[Array, Array]:
        """Poses (k, 4, 4) and velocities (k, 6, nv) of several links at once; after the first ``whole`` (default: all)
        the linear parts are those of the points at the base's origin."""
        X = self.poses(q, links)
        return X, self._moving(X, self._screws, links, whole)

    def _moving(self, X: Array, J: Array, links: tuple[str, ...], whole: int | None) -> Array:
        """The velocities (…, k, 6, nv) of links with poses X (…, k, 4, 4), by Pinocchio's J (…, 6, nv)."""
        V: Array = J[..., None, :, :] * self._several[links][2]
        if whole != 0:
            first = V[..., :whole, :, :]
            p, turn = X[..., :whole, :3, 3, None] / self.length, first[..., 3:, :]
            # the origin's velocity: ω × p more than that of the base's origin
            first[..., :3, :] += (
                turn[..., [1, 2, 0], :] * p[..., [2, 0, 1], :] - turn[..., [2, 0, 1], :] * p[..., [1, 2, 0], :]
            )
        return V

    def poses(self, q: Array, links: tuple[str, ...]) -> Array:
        """X_BL (k, 4, 4) of several links at once, metres."""
        self.at(q)
        bodies, offsets, _ = self._several.get(links) or self._together(links)
        return self._homogeneous(self._placements.take(bodies, 0)) @ offsets

    def states(
        self, places: Sequence[Array], links: tuple[str, ...], whole: int | None = None
    ) -> tuple[Array, Array, Array, Array]:
        """Return :meth:`residual` (n, rows), :meth:`jacobian` (n, rows, nv) and
        :meth:`frames` (n, k, 4, 4), (n, k, 6, nv) of several configurations."""
        bodies = (self._several.get(links) or self._together(links))[0] if links else np.zeros(0, dtype=np.intp)
        errors, loops, J, X = [], [], [], []
        for q in places:
            errors.append(self.residual(q))
            loops.append(self.jacobian(q))
            if links:
                J.append(self._screws.copy())
                X.append(self._placements.take(bodies, 0))
        n = len(places)
        if not links:
            return np.array(errors), np.array(loops), np.zeros((n, 0, 4, 4)), np.zeros((n, 0, 6, self.nv))
        poses = self._homogeneous(np.array(X)) @ self._several[links][1]
        return np.array(errors), np.array(loops), poses, self._moving(poses, np.array(J), links, whole)

    def _homogeneous(self, placements: Array) -> Array:
        """The matrices (…, 4, 4), metres, of placements by their numbers (…, 12)."""
        X = np.empty((*placements.shape[:-1], 4, 4))
        X[..., :3, :3] = placements[..., :9].reshape(*placements.shape[:-1], 3, 3).swapaxes(-1, -2)
        X[..., :3, 3] = placements[..., 9:] * self.length
        X[..., 3, :] = 0.0, 0.0, 0.0, 1.0
        return X

    def _together(self, links: tuple[str, ...]) -> tuple[Places, Array, Array]:
        """Return the bodies that carry several links, their placements (k, 4, 4), and the marks of what moves them (k,
        1, nv)."""
        bodies = [self._links[link][0] for link in links]
        offsets = np.array([self._links[link][1] for link in links])
        masks = np.array([self._supports(body) for body in bodies])[:, None, :]
        self._several[links] = np.array(bodies, dtype=np.intp), offsets, masks
        return self._several[links]

    def _supports(self, body: int) -> Array:
        """1 for the velocity indices that move a body, 0 for the others, (nv,)."""
        if body not in self._masks:
            mask = self._supports(self.model.parents[body]).copy()
            joint = self.model.joints[body]
            mask[joint.idx_v : joint.idx_v + joint.nv] = 1.0
            self._masks[body] = mask
        return self._masks[body]

    def read(self, pose: Callable[[str], Array]) -> Array:
        """The configuration at which all links have their poses X_BL (4, 4), m, as far as the tree's joints allow;
        coupled rotations have the whole turns at which couplings close, if there are some."""
        D = {link: pose(link) @ invert_pose(each.pose) for link, each in self.mechanism.links.items()}
        step = np.zeros(self.nv)
        for joint, parent, _ in self._parts:
            own = joint if joint.predecessor == parent else joint.turned()
            places = sorted(self.coordinates[joint.name])
            moved = invert_pose(D[parent]) @ D[joint.other(parent)]
            R, shift = moved[:3, :3], (transform(moved, own.point) - own.point) / self.length
            match own.type:
                case JointType.SPHERICAL:
                    step[places] = convert_rotations_to_vectors(R)
                case JointType.FREE:
                    step[places] = pin.log6(pin.SE3(R, shift)).vector
                case JointType.REVOLUTE | JointType.UNIVERSAL:
                    step[places] = decompose_rotation(np.array(own.axes), R)
                case JointType.PRISMATIC | JointType.CYLINDRICAL | JointType.PLANAR:
                    slides = [
                        axis
                        for kind, axis in split_elementary(own.type, own.axes, choose_slide_direction)
                        if kind is JointType.PRISMATIC
                    ]
                    turn = decompose_rotation(own.axis[None], R)[: len(places) - len(slides)]
                    step[places] = [*(axis @ shift for axis in slides), *turn]
        return self.integrate(self.q0, self._turn_coupled(step))

    def _turn_coupled(self, step: Array) -> Array:
        """Add whole turns to coupled rotations, as few as their couplings allow."""
        couplings = self.mechanism.couplings
        driven = {gear.driven for gear in couplings}
        for root in dict.fromkeys(gear.driver for gear in couplings if gear.driver not in driven):
            if self.mechanism.joints[root].type is JointType.REVOLUTE:
                turns = sorted(range(-GEAR_RATIO_MAX, GEAR_RATIO_MAX), key=abs)
                step = min(
                    (self._turn_along(root, count, step) for count in turns),
                    key=lambda tried: np.sum(np.abs(self._gears @ tried) > CLOSURE_RESIDUAL_TOL),
                )
        return step

    def _turn_along(self, root: str, turns: int, step: Array) -> Array:
        """Add whole turns to a rotation, and those that are nearest to closing to all that it drives."""
        step, moved = step.copy(), [root]
        step[self.coordinates[root]] += 2 * np.pi * turns
        for name in moved:
            for gear, row in zip(self.mechanism.couplings, self._gears, strict=True):
                is_rotation = self.mechanism.joints[gear.driven].type is JointType.REVOLUTE
                if gear.driver == name and is_rotation and gear.driven not in moved:
                    place = self.coordinates[gear.driven][0]
                    step[place] -= 2 * np.pi * np.round(row @ step / row[place] / (2 * np.pi))
                    moved.append(gear.driven)
        return step

    def integrate(self, q: Array, step: Array) -> Array:
        """The configuration that ``step`` (nv) leads to from ``q``."""
        return pin.integrate(self.model, q, step)

    def remove_turns(self, q: Array) -> Array:
        """Return the configuration of the same link poses whose rotations are within half a turn of zero; coupled
        joints stay."""
        step, turns = self.difference(self.q0, q), np.zeros(self.nv)
        for joint, _, _ in self._parts:
            if joint.axes and joint.type is not JointType.PRISMATIC and joint.name not in self.mechanism.coupled_joints:
                places = list(self.coordinates[joint.name])[-len(joint.axes) :]  # its rotations
                turns[places] = np.round(step[places] / (2 * np.pi))
        return self.integrate(q, -2 * np.pi * turns)

    def is_normalized(self, q: Array) -> bool:
        """Return True if all rotations in ``q`` are unit quaternions."""
        return bool(pin.isNormalized(self.model, q, GEOMETRY_DIFFERENCE_TOL))

    def difference(self, q: Array, other: Array) -> Array:
        """The step (nv) that leads from ``q`` to ``other``."""
        return pin.difference(self.model, q, other)

    def actuated_indices(self) -> list[int]:
        """Velocity indices of the actuated joints' coordinates."""
        return [
            i for joint in self.mechanism.joints.values() if joint.is_actuated for i in self.coordinates[joint.name]
        ]


def choose_slide_direction(axis: Array) -> Array:
    """The first direction in which a planar joint with this normal slides."""
    return np.asarray(np.linalg.svd(axis[None, :])[2][1])
