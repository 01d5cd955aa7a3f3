"""Generic motion of a platform, and pose tasks for it: parts of its pose, each with its error and Jacobian.

Lengths in characteristic lengths, so that positions and rotations mix; base axes throughout.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace

import numpy as np

from ..errors import BadRequest
from ..geometry.ranks import compute_range_basis, compute_space_basis
from ..geometry.screws import compute_point_velocity
from ..geometry.so3 import (
    convert_rotations_to_vectors,
    convert_vectors_to_rotations,
    find_smallest_rotations,
    turn_about,
    wrap_angle,
)
from ..geometry.vectors import Array, orient_axis, transform
from ..mechanism.pose import RADIANS, Pose, PoseForm, normalise_half_turn, write_parts
from ..results import Value
from ..tolerances import PRINTED_POSE_TOL, RANK_CUTOFF_FRACTION
from .configuration import ClosedConfiguration
from .pinocchio_model import PinocchioModel
from .velocity_relation import ObservationModel, compute_relation


@dataclass(frozen=True, eq=False, repr=False)
class PoseTask(Value):
    """Desired parts of the pose of ``link``: ``directions`` (k, 3) · position of ``point`` = ``values`` (k,) metres,
    the rotation ``phi`` about ``normal`` since the orientation ``zero``, the whole orientation ``rotation``, or
    (``axis``) no rotation but about that base direction. The point is given in the link's frame."""

    link: str
    point: Array
    zero: Array
    directions: Array
    values: Array
    normal: Array
    phi: float | None = None
    rotation: Array | None = None
    axis: Array | None = None

    def error_and_jacobian(self, model: PinocchioModel, q: Array) -> tuple[Array, Array]:
        """Return the error (reached − desired) and its Jacobian, (rows,) and (rows, nv)."""
        frames, velocities = model.frames(q, (self.link,))
        X, V = frames[0], velocities[0]
        R = X[:3, :3]
        errors = [(self.directions @ (R @ self.point + X[:3, 3]) - self.values) / model.length]
        blocks = [self.directions @ compute_point_velocity(V, X[:3, :3] @ self.point / model.length)]
        if self.phi is not None:
            angle, row = turn_about(self.normal, R @ self.zero.T)
            errors.append(np.array([wrap_angle(angle - self.phi)]))
            blocks.append(row[None] @ V[3:])
        if self.rotation is not None:
            errors.append(convert_rotations_to_vectors(R @ self.rotation.T))
            blocks.append(V[3:])
        if self.axis is not None:
            moved = R @ self.zero.T @ self.axis
            across = np.linalg.svd(self.axis[None])[2][1:]
            errors.append(across @ find_smallest_rotations(self.axis, moved))
            blocks.append(across @ V[3:])
        return np.concatenate(errors), np.vstack(blocks)

    def is_met(self, X: Array, tolerance: float) -> bool:
        """Return True if the pose X (4, 4) of the link is a desired one, to a difference of positions (m) and of
        rotation matrices: no error vanishes unnoticed at another pose."""
        R = X[:3, :3]
        apart = [self.directions @ (R @ self.point + X[:3, 3]) - self.values]
        if self.phi is not None:
            swing = convert_rotations_to_vectors(
                R @ self.zero.T @ convert_vectors_to_rotations(-self.phi * self.normal)
            )
            apart.append(np.array([self.normal @ swing if np.linalg.norm(swing) < np.pi - tolerance else np.inf]))
        if self.rotation is not None:
            apart.append((R - self.rotation).ravel())
        if self.axis is not None:
            apart.append(R @ self.zero.T @ self.axis - self.axis)
        return all(float(np.max(np.abs(each), initial=0.0)) <= tolerance for each in apart)

    @property
    def lengths(self) -> int:
        """Number of rows that are lengths; they come first."""
        return len(self.values)

    def towards(self, X: Array, fraction: float) -> PoseTask:
        """Return the task at ``fraction`` of the path from the pose X (4, 4) to this one."""
        if fraction >= 1:
            return self
        R, here = X[:3, :3], transform(X, self.point)
        start = self.directions @ here
        phi, rotation = self.phi, self.rotation
        if phi is not None:
            angle = turn_about(self.normal, R @ self.zero.T)[0]
            phi = angle + fraction * (phi - angle)
        if rotation is not None:
            way = convert_rotations_to_vectors(rotation @ R.T)
            rotation = convert_vectors_to_rotations(fraction * way) @ R
        return replace(self, values=start + fraction * (self.values - start), phi=phi, rotation=rotation)


@dataclass(frozen=True, eq=False, repr=False)
class PlatformMotion(Value):
    """Motion of a platform at generic configurations, relative to its pose ``home`` (4, 4) at the zero configuration.

    ``translations`` (3, k) spans the velocities of ``point`` (in the platform's frame), ``rotations`` (3, m) the
    angular velocities that count (none of a point body), ``twists`` (6, n) both together.
    """

    link: str
    point: Array
    body: bool
    """True if the platform's rotation counts: not that of a point body."""
    home: Array
    translations: Array
    rotations: Array
    twists: Array
    dof: int
    """Platform dof at a generic configuration; ``twists`` spans more where they change from pose to pose."""
    shifts: int
    """Dof of the point there: 1 on a curve, 2 on a surface; ``translations`` spans all."""
    form: PoseForm = RADIANS
    """Format of poses."""

    @classmethod
    def of(cls, configurations: Iterable[ClosedConfiguration], observation_model: ObservationModel) -> PlatformMotion:
        """Return the motion that generic configurations show."""
        asked = observation_model.of_platform
        point = np.zeros(3) if observation_model.point is None else observation_model.point
        columns = []
        for at in configurations:
            found = np.zeros((6, (basis := compute_relation(at, asked).twists).shape[1]))
            found[: len(basis)] = basis
            columns.append(found)
            model = at.model
        together = np.hstack(columns)
        translations, rotations, twists = (
            compute_space_basis(part, 1.0) for part in (together[:3], together[3:], together)
        )
        home, dof = model.pose(model.q0, observation_model.platform), max(column.shape[1] for column in columns)
        shifts = max(compute_range_basis(column[:3], 1.0)[1].value for column in columns)
        return cls(
            observation_model.platform,
            point,
            observation_model.point is None,
            home,
            translations,
            rotations,
            twists,
            dof,
            shifts,
        )

    @property
    def normal(self) -> Array:
        """The axis of phi: the one about which the platform rotates (its largest component positive), else z."""
        return orient_axis(self.rotations[:, 0]) if self.has_one_rotation else np.array([0.0, 0.0, 1.0])

    @property
    def is_planar(self) -> bool:
        """True if it moves freely in a plane: two translations and the rotation about their normal."""
        return (self.translations.shape[1], self.rotations.shape[1], self.dof) == (2, 1, 3)

    @property
    def has_one_rotation(self) -> bool:
        """True if its only rotation is phi."""
        return self.rotations.shape[1] == 1

    @property
    def parts(self) -> tuple[str, ...]:
        """Parts of a pose that the platform can change."""
        found = [
            name
            for name, row in zip("xyz", self.translations, strict=True)
            if np.linalg.norm(row) > RANK_CUTOFF_FRACTION
        ]
        if np.linalg.norm(self.normal @ self.rotations) > RANK_CUTOFF_FRACTION:
            found.append("phi")
        return (*found, "rpy") if self.rotations.shape[1] else tuple(found)

    def free(self, given: Collection[str]) -> tuple[str, ...]:
        """Return the parts of a pose that are not given, as text."""
        turned = self.rotations.shape[1] if "rpy" in given else int("phi" in given)
        if sum(name in "xyz" for name in given) + turned >= self.dof:
            return ()
        left = [name for name in self.parts if name in "xyz" and name not in given]
        if not self.rotations.shape[1] or "rpy" in given:
            return tuple(left)
        if "phi" not in given:
            return (*left, "phi" if self.rotations.shape[1] == 1 and "phi" in self.parts else "orientation")
        return tuple(left) if self.rotations.shape[1] == 1 else (*left, "orientation but phi")

    def position(self, X: Array) -> Array:
        """The position of the point at a platform pose X (4, 4), (3,)."""
        return transform(X, self.point)

    def pose(self, X: Array) -> Pose:
        """Return a platform pose X (4, 4) as a user writes it; of a point body the position alone, of one that rotates
        about one axis that rotation, as phi in degrees."""
        found = Pose.of(X, None if self.body else self.point)
        if found.rotation is None or (self.form == RADIANS and not self.has_one_rotation):
            return found
        parts, turn = found.given, X[:3, :3] @ self.home[:3, :3].T
        if (self.form.phi or self.has_one_rotation) and np.linalg.norm(
            turn @ self.normal - self.normal
        ) <= PRINTED_POSE_TOL:
            parts["phi"] = (normalise_half_turn(turn_about(self.normal, turn)[0]),)
            del parts["rpy"]
        return replace(found, shown=write_parts(parts, self.form.degrees or "phi" in parts))

    def goal(self, pose: Pose, robot: str = "the robot") -> PoseTask:
        """Return the task of a pose that a user gives; raises ``BadRequest`` for parts that the platform cannot
        change."""
        constant = [name for name in pose.given if name not in self.parts]
        for name in constant:
            if not self._is_zero_value(pose, name):
                raise BadRequest(f"{robot}: the platform cannot change {name}", str(pose), self.parts)
        pose = pose.without(constant)
        normal, phi, rotation = self.normal, pose.phi, pose.rotation
        if rotation is not None and self.has_one_rotation:
            turn = rotation @ self.home[:3, :3].T
            phi, rotation = turn_about(normal, turn)[0], None
            if np.linalg.norm(turn @ normal - normal) > PRINTED_POSE_TOL:
                axis = " ".join(f"{x:.4g}" for x in normal)
                raise BadRequest(
                    f"{pose}: the platform of {robot} rotates about one axis only",
                    remedy=f"Use phi, or a rotation about {axis}.",
                )
        placed = [i for i, name in enumerate("xyz") if name in pose.given]
        values = np.array([getattr(pose, "xyz"[i]) for i in placed], dtype=float)
        return PoseTask(self.link, self.point, self.home[:3, :3], np.eye(3)[placed], values, normal, phi, rotation)

    def pose_of(self, goal: PoseTask) -> Array:
        """Return the platform pose (4, 4) of a task, its free parts as near to ``home`` as they can be."""
        X, home = self.home.copy(), self.position(self.home)
        if goal.rotation is not None:
            X[:3, :3] = goal.rotation
        elif goal.phi is not None:
            X[:3, :3] = convert_vectors_to_rotations(goal.phi * goal.normal) @ self.home[:3, :3]
        along = goal.directions @ self.translations
        way = (
            self.translations
            @ np.linalg.lstsq(along, goal.values - goal.directions @ home, rcond=RANK_CUTOFF_FRACTION)[0]
        )
        X[:3, 3] = home + way - X[:3, :3] @ self.point
        return X

    def is_placed(self, goal: PoseTask) -> bool:
        """Return True if a task leaves the point no translation."""
        k = self.translations.shape[1]
        return not k or (
            len(goal.values) > 0
            and bool(np.linalg.matrix_rank(goal.directions @ self.translations, tol=RANK_CUTOFF_FRACTION) == k)
        )

    def turns_left(self, goal: PoseTask) -> int:
        """Return the number of the platform's rotations that a task leaves free."""
        return 0 if goal.rotation is not None else self.rotations.shape[1] - (goal.phi is not None)

    def _is_zero_value(self, pose: Pose, name: str) -> bool:
        """Return True if a part that never changes is given as it is at the zero configuration, to the digits
        printed."""
        if name in "xyz":
            here = self.position(self.home)["xyz".index(name)]
            return abs(float(getattr(pose, name)) - float(here)) <= PRINTED_POSE_TOL
        return (
            pose.rotation is not None and float(np.linalg.norm(pose.rotation - self.home[:3, :3])) <= PRINTED_POSE_TOL
        )

    def at_home(self) -> PoseTask:
        """Return the task of the whole pose at the zero configuration: free parts are nearest to it."""
        R = self.home[:3, :3]
        return PoseTask(
            self.link,
            self.point,
            R,
            np.eye(3),
            self.position(self.home),
            self.normal,
            rotation=R if self.body else None,
        )

    def whole(self, X: Array) -> PoseTask:
        """Return the task of the whole platform pose X (4, 4), as far as the platform's pose counts."""
        return replace(self.at_home(), values=self.position(X), rotation=X[:3, :3] if self.body else None)

    def manner(self) -> PoseTask:
        """Return the task of what the platform never changes: the position if its point does not move, rotations that
        it does not make (or makes about one axis only)."""
        k = self.translations.shape[1]
        fixed = np.linalg.svd(self.translations.T)[2][k:] if k else np.eye(3)
        R = self.home[:3, :3]
        goal = PoseTask(self.link, self.point, R, fixed, fixed @ self.position(self.home), self.normal)
        if not self.body or self.rotations.shape[1] > 1:
            return goal
        return replace(goal, axis=self.rotations[:, 0]) if self.rotations.shape[1] else replace(goal, rotation=R)
