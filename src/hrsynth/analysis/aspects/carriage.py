"""The poses that a path runs through: which point of the platform, whether its turn counts, and what follows from them.

Lengths in characteristic lengths, base axes. A *pose* is (p, R): the position of the point and the platform's rotation
(the identity where the turn does not count).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...geometry.balls import Field, widened
from ...geometry.so3 import exponential, logarithm
from ...geometry.vectors import Array, hat, inverse
from ...kinematics.configuration import ClosedConfiguration
from ...kinematics.platform_motion import PlatformMotion
from ...kinematics.relation import Measurement, relation
from ...mechanism.legs import LegDecomposition
from ...tolerances import FOLLOWED, RANK_CUTOFF

Place = tuple[Array, Array]
"""A pose: the point (3,) and the platform's rotation (3, 3)."""


@dataclass(frozen=True, eq=False)
class Carriage:
    """The coordinates of a platform: the position of a point, along ``motion.translations``, and its turn, by
    ``motion.rotations``, where ``turning``; together as many as the robot has freedoms."""

    motion: PlatformMotion
    turning: bool
    length: float

    def of(self, configurations: Sequence[ClosedConfiguration]) -> tuple[Array, Array]:
        """The poses (n, 3) and (n, 3, 3) at configurations."""
        frames = np.array([at.pose(self.motion.link) for at in configurations])
        p = frames[:, :3, :3] @ self.motion.point + frames[:, :3, 3]
        R = frames[:, :3, :3] if self.turning else np.broadcast_to(np.eye(3), (len(p), 3, 3))
        return p / self.length, R

    def frame(self, p: Array, R: Array) -> Array:
        """X_BP (4, 4), metres, of a pose whose turn counts."""
        X = np.eye(4)
        X[:3, :3], X[:3, 3] = R, self.length * p - R @ self.motion.point
        return X


def carriages(anatomy: LegDecomposition, question: Measurement, dof: int, configurations: Sequence[ClosedConfiguration]
              ) -> Iterator[Carriage]:
    """The whole pose of the platform where its parts are independent, then the positions of joint centres on it that
    have all of the robot's freedoms."""
    mechanism = anatomy.mechanism
    X_PB = inverse(mechanism.links[mechanism.platform].pose)
    centres = [(X_PB @ np.append(joint.point, 1.0))[:3] for joint in mechanism.joints_of(mechanism.platform)]
    for point in (question.point, *centres):
        asked = replace(question, point=point, observations=())
        if any(relation(at, asked).dof.value != dof for at in configurations):
            continue
        motion = PlatformMotion.of(configurations, asked)
        shifts, spins = motion.translations.shape[1], motion.rotations.shape[1]
        if motion.twists.shape[1] == shifts + spins == dof and spins in (0, 1, 3):
            yield Carriage(motion, motion.body, configurations[0].twin.length)


@dataclass(frozen=True, eq=False)
class Stretch:
    """A way between two poses: the point on a straight line, the platform about one axis; λ from 0 to 1."""

    p: Array
    R: Array
    shift: Array
    turn: Array

    @classmethod
    def between(cls, one: tuple[Array, Array], two: tuple[Array, Array]) -> Stretch:
        """The way from a pose (3,), (3, 3) to another."""
        return cls(*one, two[0] - one[0], logarithm(two[1] @ one[1].T))

    def at(self, fractions: Field) -> tuple[Field, Field]:
        """Poses (n, 3), (n, 3, 3) at fractions (n,); of balls, with all poses nearer than ``FOLLOWED``."""
        p = self.p + fractions[:, None] * self.shift
        angle = float(np.linalg.norm(self.turn))
        R: Field = np.broadcast_to(self.R, (len(fractions), 3, 3))
        if angle > 0:
            K = hat(self.turn / angle)
            sines, cosines = np.sin(fractions * angle), np.cos(fractions * angle)
            R = self.R + sines[:, None, None] * (K @ self.R) + (1 - cosines)[:, None, None] * (K @ K @ self.R)
        if p.dtype == object:
            R = R.astype(object)
        return widened(p, FOLLOWED), widened(R, FOLLOWED)

    @property
    def end(self) -> tuple[Array, Array]:
        """The pose at λ = 1."""
        return self.p + self.shift, exponential(self.turn) @ self.R


def stretched(p: Array, R: Array, q: Array, S: Array, fractions: Array) -> tuple[Array, Array, Array]:
    """Poses (n, k, 3), (n, k, 3, 3) on the ways from poses (p, R) to (q, S), (n, 3) and (n, 3, 3), at fractions (k,);
    and the ways' lengths (n,) (characteristic lengths, radians)."""
    turns = logarithm(S @ R.transpose(0, 2, 1))
    places = p[:, None] + fractions[:, None] * (q - p)[:, None]
    turned = exponential(fractions[:, None] * turns[:, None]) @ R[:, None]
    return places, turned, np.hypot(np.linalg.norm(q - p, axis=1), np.linalg.norm(turns, axis=1))


@dataclass(frozen=True, eq=False)
class Rigid:
    """A vector that the pose alone decides: ``follows`` p + R ``turned`` + ``constant``; ``fitted`` to samples, else
    read from the file's joints."""

    follows: bool
    turned: Array
    constant: Array
    fitted: bool = False

    def value(self, p: Field, R: Field) -> Field:
        """The vectors (n, 3) at poses (n, 3), (n, 3, 3); of balls, with all that the rounded numbers stand for."""
        found = (p if self.follows else 0 * p) + self.constant
        return widened(np.asarray(found + R @ self.turned if np.any(self.turned) else found), FOLLOWED)


def rigid(values: Array, p: Array, R: Array) -> Rigid | None:
    """The rule that vectors (n, 3) follow at poses (n, 3), (n, 3, 3), by least squares; None where there is none."""
    if np.max(np.abs(values - values[0])) < FOLLOWED:
        return Rigid(False, np.zeros(3), values[0], True)
    rows = np.concatenate([R, np.broadcast_to(np.eye(3), R.shape)], axis=2).reshape(-1, 6)
    for follows in (False, True):
        wanted = (values - p if follows else values).reshape(-1)
        found = np.linalg.lstsq(rows, wanted, rcond=RANK_CUTOFF)[0]
        if np.max(np.abs(rows @ found - wanted)) < FOLLOWED:
            turned, constant = np.where(np.abs(found) < FOLLOWED, 0.0, found).reshape(2, 3)
            return Rigid(follows, turned, constant, True)
    return None
