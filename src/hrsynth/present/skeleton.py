"""A robot as strokes between the centres of its joints."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..geometry.vectors import Array, inverse
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism import Mechanism
from ..tolerances import SAME_POINT


def outline(mechanism: Mechanism, link: str, X: Array) -> Array:
    """The closed polygon (n, 3) through the centres of a link's joints, the link at the pose X (4, 4)."""
    moved = X @ inverse(mechanism.links[link].pose)
    centres = _apart([joint.point for joint in mechanism.joints_of(link)], SAME_POINT * mechanism.length)
    ring = _sort_by_angle(np.array(centres))
    return np.asarray(np.vstack([ring, ring[:1]]) @ moved[:3, :3].T + moved[:3, 3])


def legs_of(at: ClosedConfiguration, platform: tuple[str, ...]) -> tuple[Array, ...]:
    """All links but the base and ``platform`` as polygons or segments, and the way that each slider has gone."""
    mechanism = at.model.mechanism
    moved = {link: at.pose(link) for link in mechanism.links}
    links = [outline(mechanism, link, X) for link, X in moved.items() if link not in (mechanism.base, *platform)]
    return tuple(stroke for stroke in (*links, *_slid(mechanism, moved)) if len(stroke) > 2)


def _slid(mechanism: Mechanism, moved: dict[str, Array]) -> Iterator[Array]:
    """From a sliding joint's centre on one link to that on the other, there and back."""
    for joint in mechanism.joints.values():
        if joint.type.slides:
            one, other = (
                moved[link] @ inverse(mechanism.links[link].pose) @ np.append(joint.point, 1.0) for link in joint.links
            )
            yield np.array([one[:3], other[:3], one[:3]])


def _apart(points: list[Array], tolerance: float) -> list[Array]:
    """The points without repetitions."""
    found: list[Array] = []
    for point in points:
        if all(np.linalg.norm(point - other) > tolerance for other in found):
            found.append(point)
    return found


def _sort_by_angle(points: Array) -> Array:
    """Points in the order of their angles about their middle, in the plane that fits them best."""
    v = points - points.mean(axis=0)
    axes = np.linalg.svd(v)[2]
    return np.asarray(points[np.argsort(np.arctan2(v @ axes[1], v @ axes[0]))])
