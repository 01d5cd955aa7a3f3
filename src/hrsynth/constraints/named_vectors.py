"""Named vectors of a robot: observed directions, axes, tangents, tips; each a function of poses.

Values are in base axes; points in characteristic lengths. ``poses`` maps a link to its X_BL, shape (..., 4, 4), with
positions in characteristic lengths.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.vectors import Array, freeze_array, invert_pose
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism import Joint, Mechanism
from ..mechanism.observations.edge import compute_edge_tangent
from ..results import Value
from ..tolerances import RELATION_ANGLE_TOL

Poses = Mapping[str, Array]


@dataclass(frozen=True, eq=False, repr=False)
class NamedVector(Value):
    """A vector with the symbol it has in expressions and what it means, in words."""

    symbol: str
    meaning: str

    @property
    def links(self) -> tuple[str, ...]:
        """The links whose poses it depends on."""
        raise NotImplementedError

    def value(self, poses: Poses) -> Array:
        """The vector at one or many configurations, shape (..., 3)."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False, repr=False)
class BodyVector(NamedVector):
    """A unit vector fixed in a link, given in the link's frame."""

    link: str
    direction: Array

    @property
    def links(self) -> tuple[str, ...]:
        return (self.link,)

    def value(self, poses: Poses) -> Array:
        return np.einsum("...ij,j->...i", poses[self.link][..., :3, :3], self.direction)


@dataclass(frozen=True, eq=False, repr=False)
class BodyPoint(NamedVector):
    """A point fixed in a link, given in the link's frame (characteristic lengths)."""

    link: str
    place: Array

    @property
    def links(self) -> tuple[str, ...]:
        return (self.link,)

    def value(self, poses: Poses) -> Array:
        X = poses[self.link]
        turned: Array = np.einsum("...ij,j->...i", X[..., :3, :3], self.place)
        return turned + X[..., :3, 3]


@dataclass(frozen=True, eq=False, repr=False)
class Tangent(NamedVector):
    """The unit tangent a × (Q − P) of the path of Q when the link that carries it turns about the axis (P, a)."""

    axis: BodyVector
    start: BodyPoint
    end: BodyPoint

    @property
    def links(self) -> tuple[str, ...]:
        return (*self.axis.links, *self.start.links, *self.end.links)

    def value(self, poses: Poses) -> Array:
        return normalise_rows(np.cross(self.axis.value(poses), self.end.value(poses) - self.start.value(poses)))


@dataclass(frozen=True, eq=False, repr=False)
class Segment(NamedVector):
    """The unit vector from a point to another."""

    start: BodyPoint
    end: BodyPoint

    @property
    def links(self) -> tuple[str, ...]:
        return (*self.start.links, *self.end.links)

    def value(self, poses: Poses) -> Array:
        return normalise_rows(self.end.value(poses) - self.start.value(poses))


@dataclass(frozen=True, eq=False, repr=False)
class Ray(Segment):
    """Vector from a camera centre; of no length, nothing is visible."""


@dataclass(frozen=True, eq=False, repr=False)
class CrossProduct(NamedVector):
    """The unit vector along the cross product of two, one of them a ray, or in the plane of one: where it vanishes
    nothing is seen."""

    one: NamedVector
    other: NamedVector

    @property
    def links(self) -> tuple[str, ...]:
        return (*self.one.links, *self.other.links)

    def value(self, poses: Poses) -> Array:
        return normalise_rows(np.cross(self.one.value(poses), self.other.value(poses)))


@dataclass(frozen=True, eq=False, repr=False)
class TangentNormal(NamedVector):
    """Normal of the plane through a point that touches a cylinder. The sign of the radius (characteristic lengths)
    selects one of the two planes."""

    start: BodyPoint
    on_axis: BodyPoint
    axis: BodyVector
    radius: float

    @property
    def links(self) -> tuple[str, ...]:
        return (*self.start.links, *self.on_axis.links, *self.axis.links)

    def value(self, poses: Poses) -> Array:
        out = self.on_axis.value(poses) - self.start.value(poses)
        return compute_edge_tangent(out, self.axis.value(poses), np.array([self.radius]))


def normalise_rows(vectors: Array) -> Array:
    """Vectors (..., 3) divided by their lengths; a zero vector stays zero."""
    size = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(size > 0, size, 1.0))


def make_axis(mechanism: Mechanism, joint: Joint, symbol: str, which: int = 0) -> BodyVector:
    """The (first or second) axis of a joint, as fixed in the link that carries it."""
    link = joint.links[which]
    direction = mechanism.links[link].pose[:3, :3].T @ joint.axes[which]
    words = f"axis of {joint.name}" if len(joint.axes) == 1 else f"{('first', 'second')[which]} axis of {joint.name}"
    return BodyVector(symbol, words, link, freeze_array(direction))


def make_centre(mechanism: Mechanism, joint: Joint, link: str, symbol: str, length: float) -> BodyPoint:
    """The centre of a joint, as fixed in one of its links."""
    place = invert_pose(mechanism.links[link].pose) @ np.append(joint.point, 1.0)
    return BodyPoint(symbol, f"centre of {joint.name}", link, freeze_array(place[:3] / length))


def collect_poses(configurations: Sequence[ClosedConfiguration], links: Sequence[str]) -> dict[str, Array]:
    """Poses (n, 4, 4) of links at several configurations, positions in characteristic lengths."""
    names = tuple(dict.fromkeys(links))
    X = np.array([at.model.poses(at.q, names) for at in configurations])
    X[..., :3, 3] /= configurations[0].model.length
    return {name: X[:, i] for i, name in enumerate(names)}


def is_zero_everywhere(block: Array) -> bool:
    """Return True if vectors, of any shape, are zero at all configurations."""
    return bool(np.max(np.abs(block), initial=0.0) < RELATION_ANGLE_TOL)
