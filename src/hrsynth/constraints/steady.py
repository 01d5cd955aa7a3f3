"""Whether what a held leg leaves its end is of one kind at all poses, or grows where a U joint before the watched link
turns about the watched direction.

Turns about axes a₁ … a_m before a link keep its direction u if Σ θ̇ᵢ aᵢ ∥ u. With a ball among them, or all axes
parallel, these rates have one dimension at all poses. Let the last two axes else meet in a point C: where u lies in
their plane they can turn the link about the line through C along u, and the other axes leave C no more than elsewhere.
Such a turn leaves a tip at rest that stays on this line: the leg's end may then turn about u besides. An end that only
translates feels it where the joints beyond the link turn back.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ..geometry.vectors import Array, cross
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.locked import joint_at
from ..mechanism import Joint, JointType, Mechanism, Observation
from ..mechanism.graphs import adjacency, component, shortest_path
from ..mechanism.legs import Leg
from ..mechanism.observations.direction import Direction
from ..tolerances import SURELY_SOMETHING
from .named_vectors import BodyVector, poses_at, vanishes


def grows(leg: Leg, locks: Sequence[Observation], reference: str, tips: Array, samples: Sequence[ClosedConfiguration],
          translating: bool) -> str:
    """What a held leg, a chain of joints, may leave its end (tips (n, 3), characteristic lengths) at special poses
    alone: nothing more (empty), a ``turn`` about the watched direction through the tip, or motions of the ``tip``.
    Of an end that is ``translating``, motions in which it does not turn."""
    mechanism = samples[0].twin.mechanism
    found = {_grows(mechanism, leg, lock, reference, tips, samples, translating) for lock in locks
             if isinstance(lock, Direction)}
    # several directions: none grows where one does not
    return "" if not found or "" in found else "tip" if "tip" in found else "turn"


def _grows(mechanism: Mechanism, leg: Leg, lock: Direction, reference: str, tips: Array,
           samples: Sequence[ClosedConfiguration], translating: bool) -> str:
    way = _way(mechanism, leg, lock.seen_from or reference, lock.link)
    if way is None or any(joint.type is JointType.SPHERICAL for joint in way):
        return ""
    lines = [(np.array(centres), np.array(axes)) for joint in way if joint.type is not JointType.PRISMATIC
             for centres, axes in _lines(joint, samples)]
    if all(vanishes(cross(axes, lines[0][1])) for _, axes in lines[1:]):
        return ""
    watched = BodyVector("u", "", lock.link, lock.direction)
    u = watched.value(poses_at(samples, [lock.link]))
    if translating and _cannot_turn_back(mechanism, leg, lock, u, samples):
        return ""
    (A, a), (B, b) = lines[-2:]
    across = cross(a, b)
    if vanishes(across) or not vanishes(np.sum((B - A) * across, axis=1)):
        return "tip"
    # the point of a next to b
    size = np.sum(across**2, axis=1, keepdims=True)
    C = A + a * (np.sum(cross(B - A, b) * across, axis=1, keepdims=True) / size)
    return "turn" if vanishes(cross(tips - C, u)) else "tip"


def _cannot_turn_back(mechanism: Mechanism, leg: Leg, lock: Direction, u: Array, samples: Sequence[ClosedConfiguration]
                      ) -> bool:
    """Whether the joints from the watched link to the leg's end make no turn about u: they have one direction, which
    lies in that link as u does, and is not along u."""
    beyond = _way(mechanism, leg, lock.link, leg.attach)
    if beyond is None or any(joint.type is JointType.SPHERICAL for joint in beyond):
        return False
    axes = [np.array(each) for joint in beyond if joint.type is not JointType.PRISMATIC
            for _, each in _lines(joint, samples)]
    return not axes or (all(vanishes(cross(each, axes[0])) for each in axes[1:])
                        and float(np.min(np.linalg.norm(cross(axes[0], u), axis=1))) > SURELY_SOMETHING)


def _way(mechanism: Mechanism, leg: Leg, one: str, other: str) -> list[Joint] | None:
    """The joints between two links of a leg; None where it is no chain."""
    if leg.has_loops:
        return None
    bonds = {frozenset(mechanism.joints[name].links): mechanism.joints[name] for name in leg.joints}
    graph = adjacency((), bonds)
    if one not in graph or other not in component(graph, one):
        return None
    return [bonds[frozenset(pair)] for pair in pairwise(shortest_path(graph, one, other))]


def _lines(joint: Joint, samples: Sequence[ClosedConfiguration]) -> list[tuple[list[Array], list[Array]]]:
    """Centres and directions (n, 3) of each axis of a joint, in the order from its predecessor."""
    found = [joint_at(at, joint) for at in samples]
    return [([centre for centre, _ in found], [axes[k] for _, axes in found]) for k in range(len(joint.axes))]
