"""A robot as strokes between the centres of its joints."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..geometry.vectors import Array, invert_pose
from ..kinematics.configuration import ClosedConfiguration
from ..mechanism import Mechanism
from ..tolerances import POINT_DISTANCE_TOL


def trace_link_outline(mechanism: Mechanism, link: str, X: Array) -> Array:
    """The closed polygon (n, 3) through the centres of a link's joints, the link at the pose X (4, 4)."""
    moved = X @ invert_pose(mechanism.links[link].pose)
    centres = _drop_repeated(
        [joint.point for joint in mechanism.joints_of(link)], POINT_DISTANCE_TOL * mechanism.length
    )
    ring = _sort_by_angle(np.array(centres))
    return np.asarray(np.vstack([ring, ring[:1]]) @ moved[:3, :3].T + moved[:3, 3])


def trace_leg_outlines(at: ClosedConfiguration, platform: tuple[str, ...]) -> tuple[Array, ...]:
    """All links but the base and ``platform`` as polygons or segments, and the way that each slider has gone."""
    mechanism = at.model.mechanism
    moved = {link: at.pose(link) for link in mechanism.links}
    links = [
        trace_link_outline(mechanism, link, X) for link, X in moved.items() if link not in (mechanism.base, *platform)
    ]
    return tuple(stroke for stroke in (*links, *_trace_slider(mechanism, moved)) if len(stroke) > 2)


def _trace_slider(mechanism: Mechanism, moved: dict[str, Array]) -> Iterator[Array]:
    """From a sliding joint's centre on one link to that on the other, there and back."""
    for joint in mechanism.joints.values():
        if joint.type.has_translation:
            one, other = (
                moved[link] @ invert_pose(mechanism.links[link].pose) @ np.append(joint.point, 1.0)
                for link in joint.links
            )
            yield np.array([one[:3], other[:3], one[:3]])


def _drop_repeated(points: list[Array], tolerance: float) -> list[Array]:
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
