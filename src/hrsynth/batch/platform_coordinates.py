"""Poses of the links of a platform as functions of its position and rotation alone.

Poses are given as the platform's reference point p and its rotation R. A point of a link that turns with the platform
is p + R b; one of a link that only translates (a half of an articulated platform) is p + R b + c: the law is fitted to
closed configurations and holds at all of them, or the link has no such pose. A link that slides on the platform has one
more number, its displacement: it moves with the platform displaced so far.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..closed_forms.platform_points import PlatformPoint
from ..geometry.vectors import Array, invert_pose
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.platform_motion import PlatformMotion
from ..mechanism import JointType, Mechanism
from ..results import Value
from ..tolerances import GEOMETRY_DIFFERENCE_TOL

Frames = Mapping[str, Array]
"""Poses X_BL (m, 4, 4) of links at m closed configurations, metres."""


@dataclass(frozen=True, eq=False, repr=False)
class PlatformLink(Value):
    """A link that goes with the platform: its origin is p + R b + c, its rotation R Q (``turns``) or Q."""

    turns: bool
    Q: Array
    b: Array
    c: Array

    def point(self, place: Array) -> PlatformPoint:
        """A point that the link's frame has at ``place`` (3,)."""
        moved = self.Q @ place
        b, c = (self.b + moved, self.c) if self.turns else (self.b, self.c + moved)
        return PlatformPoint(True, b, c)

    def poses(self, p: Array, R: Array) -> Array:
        """Return the link's poses (n, 4, 4) at poses (n, 3), (n, 3, 3) of the platform."""
        X = np.tile(np.eye(4), (len(p), 1, 1))
        X[:, :3, 3] = p + R @ self.b + self.c
        X[:, :3, :3] = R @ self.Q if self.turns else self.Q
        return X


@dataclass(frozen=True, eq=False, repr=False)
class SlidingLink(Value):
    """Link that a P joint of this name carries on the platform: at the pose that ``body`` has at p + s R ``along``, s
    the joint's coordinate (m; zero at the zero configuration)."""

    joint: str
    along: Array
    body: PlatformLink

    def moved(self, X: Array, s: Array) -> Array:
        """Return the platform's poses X (n, 4, 4), displaced by the link's displacement (n,)."""
        return _extend_shifts(X, s[:, None] * (X[:, :3, :3] @ self.along))


@dataclass(frozen=True, eq=False, repr=False)
class PlatformCoordinates(Value):
    """The platform: its reference point, a basis of its twists, the links that go with it.

    ``translations`` (3, k) and ``rotations`` (3, m) are orthonormal: the twist with coordinates (x, y) is the velocity
    ``translations`` x of the point and the angular velocity ``rotations`` y. If not every one of these twists is one
    of the platform's (``constant`` is false), the legs determine at each pose which are.
    """

    link: str
    point: Array
    translations: Array
    rotations: Array
    links: Mapping[str, PlatformLink]
    dof: int

    @property
    def has_constant_twists(self) -> bool:
        """Return True if the platform has the same twists at every pose."""
        return int(self.translations.shape[1] + self.rotations.shape[1]) == self.dof

    @property
    def twists(self) -> Array:
        """The basis (6, d), along the base frame's axes where these span it: linear rows are the velocity of the
        point."""
        shifts, spins, zero = self.translations, self.rotations, np.zeros((3, 3))
        return np.block([[shifts, zero[:, : spins.shape[1]]], [zero[:, : shifts.shape[1]], spins]])

    def place(self, X: Array) -> tuple[Array, Array]:
        """p (n, 3) and R (n, 3, 3) of platform poses (n, 4, 4)."""
        R = X[:, :3, :3]
        return X[:, :3, 3] + R @ self.point if self.point.any() else X[:, :3, 3], R

    @classmethod
    def of(cls, motion: PlatformMotion, frames: Frames, names: Sequence[str], length: float) -> PlatformCoordinates:
        """Determine the coordinates of a platform, and of the links ``names`` that move with it."""
        X = frames[motion.link]
        p = X[:, :3, 3] + X[:, :3, :3] @ motion.point
        found = {
            name: body
            for name in names
            if motion.body and (body := _recognise_link_law(p, X[:, :3, :3], frames[name], length)) is not None
        }
        return cls(motion.link, motion.point, motion.translations, motion.rotations, found, motion.dof)


def find_sliding_links(
    coordinates: PlatformCoordinates, frames: Frames, names: Sequence[str], mechanism: Mechanism
) -> dict[str, tuple[SlidingLink, Array]]:
    """The links that slide on one that goes with the platform, and how far they slid in all ``frames`` (m,)."""
    found: dict[str, tuple[SlidingLink, Array]] = {}
    X = frames[mechanism.platform]
    for joint in mechanism.joints.values():
        link, other = joint.links if joint.predecessor not in coordinates.links else joint.links[::-1]
        if (
            joint.type is not JointType.PRISMATIC
            or link in coordinates.links
            or other not in coordinates.links
            or (link not in names)
        ):
            continue
        D, base = (frames[each] @ invert_pose(mechanism.links[each].pose) for each in (link, other))
        axes = (1.0 if link == joint.successor else -1.0) * base[:, :3, :3] @ joint.axis
        s = np.einsum("ni,ni->n", axes, (D - base)[:, :3] @ np.append(joint.point, 1.0))
        along = X[0, :3, :3].T @ axes[0]
        body = _recognise_link_law(
            *coordinates.place(_extend_shifts(X, s[:, None] * axes)), frames[link], mechanism.length
        )
        if body is not None and np.max(np.abs(X[:, :3, :3] @ along - axes)) <= GEOMETRY_DIFFERENCE_TOL:
            found[link] = SlidingLink(joint.name, along, body), s
    return found


def _extend_shifts(X: Array, shifts: Array) -> Array:
    X = X.copy()
    X[:, :3, 3] += shifts
    return X


def _recognise_link_law(p: Array, R: Array, X: Array, length: float) -> PlatformLink | None:
    """The law that a link's frames (m, 4, 4) obey, or None."""
    eye = np.broadcast_to(np.eye(3), R.shape)
    for turns, Q in ((True, R[0].T @ X[0, :3, :3]), (False, X[0, :3, :3])):
        if np.max(np.abs((R @ Q if turns else Q) - X[:, :3, :3])) > GEOMETRY_DIFFERENCE_TOL:
            continue
        rows = np.concatenate([R, eye], axis=2).reshape(-1, 6)
        away = (X[:, :3, 3] - p).ravel()
        b, c = np.linalg.lstsq(rows, away, rcond=GEOMETRY_DIFFERENCE_TOL)[0].reshape(2, 3)
        if np.max(np.abs(rows @ np.concatenate([b, c]) - away)) <= GEOMETRY_DIFFERENCE_TOL * length:
            return PlatformLink(turns, Q, b, c)
    return None


def collect_frames(configurations: Sequence[ClosedConfiguration]) -> dict[str, Array]:
    """Poses (m, 4, 4) of all links at closed configurations."""
    names = tuple(configurations[0].model.mechanism.links)
    X = np.array([at.model.poses(at.q, names) for at in configurations])
    return {name: X[:, i] for i, name in enumerate(names)}
