"""Poses that a path runs through, and its segments: straight ones and changes of working mode.

Lengths in characteristic lengths, base axes. A *pose* is (p, R): the position of the point and the platform's rotation
(the identity where the rotation does not count). A leg changes its working mode on a path out to where its rod and its
crank or rail are at their limit, and back to the same pose; there the leg leads and the platform follows without
rotating.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...closed_forms.legs import ClosedFormLeg
from ...closed_forms.platform_points import PlatformPoint
from ...geometry.balls import Field, widen
from ...geometry.so3 import convert_rotations_to_vectors, convert_vectors_to_rotations
from ...geometry.vectors import Array, cross, hat, invert_pose
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.platform_motion import PlatformMotion
from ...kinematics.velocity_relation import ObservationModel, compute_relation
from ...mechanism.legs import LegDecomposition
from ...results import Value
from ...tolerances import HIDDEN_ROBOT_RESIDUAL_TOL

Place = tuple[Array, Array]
"""Pose: the point (3,) and the platform's rotation (3, 3)."""


@dataclass(frozen=True, eq=False, repr=False)
class PathCoordinates(Value):
    """Coordinates of the platform's pose that change: the position of a point, along ``motion.translations``, and its
    rotation, by ``motion.rotations``, where ``turning``; together as many as the platform dof."""

    motion: PlatformMotion
    turning: bool
    length: float

    def of(self, configurations: Sequence[ClosedConfiguration]) -> tuple[Array, Array]:
        """Return the poses (n, 3) and (n, 3, 3) at configurations."""
        frames = np.array([at.pose(self.motion.link) for at in configurations])
        p = frames[:, :3, :3] @ self.motion.point + frames[:, :3, 3]
        R = frames[:, :3, :3] if self.turning else np.broadcast_to(np.eye(3), (len(p), 3, 3))
        return p / self.length, R

    def frame(self, p: Array, R: Array) -> Array:
        """X_BP (4, 4), metres, of a pose whose turn counts."""
        X = np.eye(4)
        X[:3, :3], X[:3, 3] = R, self.length * p - R @ self.motion.point
        return X


def list_path_coordinates(
    decomposition: LegDecomposition,
    observation_model: ObservationModel,
    dof: int,
    configurations: Sequence[ClosedConfiguration],
) -> Iterator[PathCoordinates]:
    """Yield the whole pose of the platform if its parts are independent, then the positions of joint centres on it that
    have the full platform dof."""
    mechanism = decomposition.mechanism
    X_PB = invert_pose(mechanism.links[mechanism.platform].pose)
    centres = [(X_PB @ np.append(joint.point, 1.0))[:3] for joint in mechanism.joints_of(mechanism.platform)]
    for point in (observation_model.point, *centres):
        asked = replace(observation_model, point=point, observations=())
        if any(compute_relation(at, asked).dof.value != dof for at in configurations):
            continue
        motion = PlatformMotion.of(configurations, asked)
        shifts, spins = motion.translations.shape[1], motion.rotations.shape[1]
        if motion.twists.shape[1] == shifts + spins == dof and spins in (0, 1, 3):
            yield PathCoordinates(motion, motion.body, configurations[0].model.length)


@dataclass(frozen=True, eq=False, repr=False)
class StraightSegment(Value):
    """Straight segment between two poses: the point on a line, the platform about one axis; λ from 0 to 1."""

    p: Array
    R: Array
    shift: Array
    turn: Array

    @classmethod
    def between(cls, one: tuple[Array, Array], two: tuple[Array, Array]) -> StraightSegment:
        """Return the segment from a pose (3,), (3, 3) to another."""
        return cls(*one, two[0] - one[0], convert_rotations_to_vectors(two[1] @ one[1].T))

    def at(self, fractions: Field) -> tuple[Field, Field]:
        """Return poses (n, 3), (n, 3, 3) at fractions (n,); of balls, with all poses nearer than
        ``HIDDEN_ROBOT_RESIDUAL_TOL``."""
        p = self.p + fractions[:, None] * self.shift
        angle = float(np.linalg.norm(self.turn))
        R: Field = np.broadcast_to(self.R, (len(fractions), 3, 3))
        if angle > 0:
            K = hat(self.turn / angle)
            sines, cosines = np.sin(fractions * angle), np.cos(fractions * angle)
            R = self.R + sines[:, None, None] * (K @ self.R) + (1 - cosines)[:, None, None] * (K @ K @ self.R)
        if p.dtype == object:
            R = R.astype(object)
        return widen(p, HIDDEN_ROBOT_RESIDUAL_TOL), widen(R, HIDDEN_ROBOT_RESIDUAL_TOL)

    @property
    def end(self) -> tuple[Array, Array]:
        """Pose at λ = 1."""
        return self.p + self.shift, convert_vectors_to_rotations(self.turn) @ self.R


def interpolate_poses(p: Array, R: Array, q: Array, S: Array, fractions: Array) -> tuple[Array, Array, Array]:
    """Return poses (n, k, 3), (n, k, 3, 3) on the segments from poses (p, R) to (q, S), (n, 3) and (n, 3, 3), at
    fractions (k,); and the segments' lengths (n,) (characteristic lengths, radians)."""
    turns = convert_rotations_to_vectors(S @ R.transpose(0, 2, 1))
    places = p[:, None] + fractions[:, None] * (q - p)[:, None]
    turned = convert_vectors_to_rotations(fractions[:, None] * turns[:, None]) @ R[:, None]
    return places, turned, np.hypot(np.linalg.norm(q - p, axis=1), np.linalg.norm(turns, axis=1))


@dataclass(frozen=True, eq=False, repr=False)
class TurningVector(Value):
    """Vector that rotates about a unit ``axis`` from ``first`` by ``angle``."""

    first: Array
    axis: Array
    angle: float

    @classmethod
    def between(cls, one: Array, two: Array, axis: Array) -> TurningVector:
        """Return the rotation from a vector to another with the same part along the axis."""
        flat = one - axis * float(axis @ one)
        return cls(one, axis, float(np.arctan2(axis @ np.cross(flat, two), flat @ two - (axis @ two) * (axis @ flat))))

    def at(self, fractions: Field) -> Field:
        """Return the vectors (n, 3) at fractions (n,) of the rotation."""
        along = self.axis * float(self.axis @ self.first)
        flat = self.first - along
        angles = fractions * self.angle
        aside = cross(self.axis, flat)
        return np.asarray(along + np.cos(angles)[:, None] * flat + np.sin(angles)[:, None] * aside)


@dataclass(frozen=True, eq=False, repr=False)
class WorkingModeChange(Value):
    """Change of a subchain's working mode at one pose, through its limit: the proximal end of its rod rotates about
    ``centre`` or moves straight from its place in one working mode to that in the other, its rod rotates, the platform
    keeps its rotation ``R``; λ from 0 to 1."""

    place: Place
    limb: int
    leg: str
    tip: PlatformPoint
    rod: TurningVector
    foot: TurningVector | tuple[Array, Array]
    centre: Array

    @property
    def p(self) -> Array:
        """Position of the point at both ends."""
        return self.place[0]

    @property
    def R(self) -> Array:
        """Rotation of the platform all along."""
        return self.place[1]

    @property
    def end(self) -> Place:
        """Pose at λ = 1, the same as at λ = 0."""
        return self.place

    def at(self, fractions: Field) -> tuple[Field, Field, tuple[int, Field]]:
        """Return poses (n, 3), (n, 3, 3) at fractions (n,), and the leading subchain with the vector that it
        carries."""
        if isinstance(self.foot, TurningVector):
            carried = self.centre + self.foot.at(fractions)
        else:
            carried = self.foot[0] + fractions[:, None] * (self.foot[1] - self.foot[0])
        carried = widen(carried, HIDDEN_ROBOT_RESIDUAL_TOL)
        p = carried + self.rod.at(fractions) - (self.tip.constant + self.R @ self.tip.turned)
        R: Field = np.broadcast_to(self.R, (len(fractions), 3, 3))
        return (
            widen(p, HIDDEN_ROBOT_RESIDUAL_TOL),
            widen(R.astype(p.dtype), HIDDEN_ROBOT_RESIDUAL_TOL),
            (self.limb, carried),
        )


def build_mode_change(
    coordinates: PathCoordinates, limb: ClosedFormLeg, number: int, place: Place
) -> WorkingModeChange | None:
    """Return the segment of subchain ``number`` to its other working mode at a pose; None if the platform's motion has
    none.

    Where the platform's point moves in a plane only, the crank and the rod rotate in that plane.
    """
    if not (limb.rod and limb.tip.follows and coordinates.turning):
        return None
    tip = limb.tip.value(place[0][None], place[1][None])
    ends = [limb.solve(tip, sign * limb.mode)[1][0] for sign in (1.0, -1.0)]
    rods = [tip[0] - end for end in ends]
    axis = np.asarray(limb.axis if limb.radius else np.cross(*rods))
    axis = axis / max(float(np.linalg.norm(axis)), HIDDEN_ROBOT_RESIDUAL_TOL)
    shifts = coordinates.motion.translations
    if shifts.shape[1] < 2 or (shifts.shape[1] == 2 and np.linalg.norm(axis @ shifts) > HIDDEN_ROBOT_RESIDUAL_TOL):
        return None
    rod = TurningVector.between(rods[0], rods[1], axis)
    if not limb.radius:
        return WorkingModeChange(place, number, limb.label, limb.tip, rod, (ends[0], ends[1]), np.zeros(3))
    spokes = [end - limb.centre for end in ends]
    crank = TurningVector.between(spokes[0], spokes[1], axis)
    return WorkingModeChange(place, number, limb.label, limb.tip, rod, crank, limb.centre)
