"""Test whether the motions that a locked leg allows its end are of one kind at all poses.

They may gain a dimension where a U joint before the observed link rotates about the observed direction. Rotations
about axes a₁ … a_m before a link preserve its direction u if Σ θ̇ᵢ aᵢ ∥ u. With an S among them, or all axes parallel,
these rates have one dimension at all poses. Otherwise let the last two axes meet in a point C: where u lies in their
plane they can rotate the link about the line through C along u, and the other axes move C no more than elsewhere.
Such a rotation fixes a tip that stays on this line: the leg's end may then also rotate about u. An end that only
translates is affected where the joints beyond the link rotate back.

A parallelogram or equal parallel rods, none of them flat, guide the next link as one rod does that ends in the tip: an
observed rod rotates as that one; a parallelogram on the path rotates nothing. In any other loop the joint rates
depend on each other, and at a dead point the observed link is fixed while others move.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from ..geometry.vectors import Array, cross
from ..kinematics.configuration import ClosedConfiguration
from ..kinematics.locked_twists import locate_joint
from ..mechanism import Joint, JointType, Mechanism, Observation
from ..mechanism.composites import WordEdge, WordGraph
from ..mechanism.graphs import build_adjacency, find_component, find_shortest_path, is_bridge
from ..mechanism.legs import Leg
from ..mechanism.observations.direction import Direction, SeenAxis
from ..mechanism.observations.encoder import Encoder
from ..tolerances import NONZERO_SINGULAR_VALUE_MIN
from .named_vectors import BodyVector, collect_poses, is_zero_everywhere


def may_gain_motion(
    leg: Leg,
    locks: Sequence[Observation],
    reference: str,
    tips: Array,
    samples: Sequence[ClosedConfiguration],
    translating: bool,
) -> str:
    """Motions that a locked leg may allow its end (tips (n, 3), characteristic lengths) at special poses alone: none
    (empty), a ``turn`` through the tip, or motions of the ``tip``. For an end that is ``translating``, motions without
    rotation."""
    held = _Held(samples[0].model.mechanism, leg, reference, tips, samples, translating)
    found: dict[Observation, str] = {}
    while True:
        known = len(held.joints)
        for lock in locks:
            found[lock] = held.grows(lock)
        if len(held.joints) == known:
            break
    return max(found.values(), key=("", "turn", "tip").index, default="")


@dataclass
class _Held:
    """A leg of which observations hold some joints at all poses (names)."""

    mechanism: Mechanism
    leg: Leg
    reference: str
    tips: Array
    samples: Sequence[ClosedConfiguration]
    translating: bool
    joints: set[str] = field(default_factory=set)

    def grows(self, lock: Observation) -> str:
        """Motions that an observation, with these joints fixed, may allow in addition at special poses; joints that it
        fixes at all poses are added."""
        if isinstance(lock, Encoder):
            return self._code_of(self.mechanism.joints[lock.joint])
        near, far = lock.seen_from or self.reference, lock.link
        if near in self.leg.links and far not in self.leg.links:
            near, far = far, near
        way = _find_way(self.mechanism, self.leg, near, far)
        if way is None:
            return ""
        if not way.free:
            return "tip"
        left = way.without(self.joints)
        if not isinstance(lock, SeenAxis):
            return "" if all(joint.type is JointType.PRISMATIC for joint, _ in left.joints) else "tip"
        found = _explain_gain(self, left, lock)
        turning = [joint for joint, _ in left.joints if joint.type is not JointType.PRISMATIC]
        if not found and len(turning) == 1 and turning[0].type is JointType.REVOLUTE:
            self.joints |= {turning[0].name, *left.together}
        return found

    def _code_of(self, joint: Joint) -> str:
        names: tuple[str, ...] = (joint.name,)
        if self.leg.has_loops and joint.name in self.leg.joints:
            words = _contract_leg(self.mechanism, self.leg)
            edge = next(edge for edge in words.edges() if joint.name in edge.joints)
            if not _is_bridge(words, edge):
                return "tip"
            names = edge.joints
        if len(joint.axes) == 1:
            self.joints |= set(names)
        return ""


def _explain_gain(held: _Held, way: _Way, lock: SeenAxis) -> str:
    mechanism, samples, tips = held.mechanism, held.samples, held.tips
    if any(joint.type is JointType.SPHERICAL for joint, _ in way.joints):
        return ""
    lines = [
        (np.array(centres), np.array(axes))
        for joint, link in way.joints
        if joint.type is not JointType.PRISMATIC
        for centres, axes in _compute_lines(joint, link, samples)
    ]
    if all(is_zero_everywhere(cross(axes, lines[0][1])) for _, axes in lines[1:]):
        return ""
    watched = BodyVector("u", "", lock.link, lock.direction)
    u = watched.value(collect_poses(samples, [lock.link]))
    if (
        held.translating
        and isinstance(lock, Direction)
        and _is_locked_in_rotation(mechanism, held.leg, lock, u, samples)
    ):
        return ""
    (A, a), (B, b) = lines[-2:]
    if way.far is not None:  # the rod that ends in the tip in place of the parallel ones
        near = np.array([locate_joint(at, way.joints[-1][0])[0] for at in samples])
        B = tips + near - np.array([locate_joint(at, way.far)[0] for at in samples])
    across = cross(a, b)
    if is_zero_everywhere(across) or not is_zero_everywhere(np.sum((B - A) * across, axis=1)):
        return "tip"
    # the point of a next to b
    size = np.sum(across**2, axis=1, keepdims=True)
    C = A + a * (np.sum(cross(B - A, b) * across, axis=1, keepdims=True) / size)
    return "turn" if is_zero_everywhere(cross(tips - C, u)) else "tip"


def _is_locked_in_rotation(
    mechanism: Mechanism, leg: Leg, lock: Direction, u: Array, samples: Sequence[ClosedConfiguration]
) -> bool:
    """Return True if the joints from the observed link to the leg's end do not rotate about u: they have one direction,
    which lies in that link as u does, and is not along u."""
    beyond = _find_way(mechanism, leg, lock.link, leg.platform_link)
    if leg.has_loops or beyond is None or any(joint.type is JointType.SPHERICAL for joint, _ in beyond.joints):
        return False
    axes = [
        np.array(each)
        for joint, link in beyond.joints
        if joint.type is not JointType.PRISMATIC
        for _, each in _compute_lines(joint, link, samples)
    ]
    return not axes or (
        all(is_zero_everywhere(cross(each, axes[0])) for each in axes[1:])
        and float(np.min(np.linalg.norm(cross(axes[0], u), axis=1))) > NONZERO_SINGULAR_VALUE_MIN
    )


@dataclass(frozen=True)
class _Way:
    """The joints that turn one link of a leg against another, each with the link from which it is come to."""

    joints: tuple[tuple[Joint, str], ...]
    far: Joint | None = None
    """The other end of the last link, where that is one of several equal parallel rods."""
    free: bool = True
    """Return True if the joint rates do not depend on each other."""
    together: tuple[str, ...] = ()
    """All joints of such rods."""

    def without(self, still: Collection[str]) -> _Way:
        """The way where these joints do not move."""
        left = tuple(each for each in self.joints if each[0].name not in still)
        ends = left[-1:] == self.joints[-1:]
        return _Way(left, self.far if ends else None, together=self.together if ends else ())


def _find_way(mechanism: Mechanism, leg: Leg, one: str, other: str) -> _Way | None:
    """The way between two links; None where the leg does not hold both."""
    bonds = {frozenset(mechanism.joints[name].links): mechanism.joints[name] for name in leg.joints}
    graph = build_adjacency((), bonds)
    if one not in graph or other not in find_component(graph, one):
        return None
    if leg.has_loops:
        return _contract(mechanism, leg, one, other)
    return _Way(tuple((bonds[frozenset(pair)], pair[0]) for pair in pairwise(find_shortest_path(graph, one, other))))


def _contract(mechanism: Mechanism, leg: Leg, one: str, other: str) -> _Way:
    """Classify a leg with loops, not ``free`` if it passes a loop other than a parallelogram or parallel rods."""
    tied = _Way((), free=False)
    words = _contract_leg(mechanism, leg)
    holder = next((edge for edge in words.edges() if other in edge.inside), None)
    graph = words.adjacency()
    if one not in graph or (holder is None and other not in graph):
        return tied
    path = find_shortest_path(graph, one, other if holder is None else holder.tail)
    edges = [edge for pair in pairwise(path) for _, edge in words.between(*pair)]
    if holder is not None and holder not in edges:
        edges.append(holder)
    if any(not _is_bridge(words, edge) for edge in edges):
        return tied
    joints, at = [], one
    for edge in edges:
        if edge is holder:
            break
        if len(edge.joints) == 1:
            joints.append((mechanism.joints[edge.joints[0]], at))
        elif any(mechanism.joints[name].type is not JointType.REVOLUTE for name in edge.joints):
            return tied
        at = edge.other(at)
    if holder is None:
        return _Way(tuple(joints))
    ends = [mechanism.joints[name] for name in holder.joints if other in mechanism.joints[name].links]
    near, far = sorted(ends, key=lambda joint: at not in joint.links)
    return _Way((*joints, (near, at)), far, together=holder.joints)


def _contract_leg(mechanism: Mechanism, leg: Leg) -> WordGraph:
    """A leg's joint graph, with parallelograms and equal parallel rods as edges."""
    links = {link for name in leg.joints for link in mechanism.joints[name].links}
    words = WordGraph(mechanism, {mechanism.base, leg.platform_link} & links, links)
    words.keep(leg.joints)
    return words.recognise()


def _is_bridge(words: WordGraph, edge: WordEdge) -> bool:
    """Return True if only this edge joins its two sides."""
    edges = list(words.edges())
    place = next(k for k, each in enumerate(edges) if each is edge)
    return is_bridge([(each.tail, each.head) for each in edges], place)


def _compute_lines(
    joint: Joint, start: str, samples: Sequence[ClosedConfiguration]
) -> list[tuple[list[Array], list[Array]]]:
    """Centres and directions (n, 3) of each axis of a joint, in the order from one of its links."""
    found = [locate_joint(at, joint) for at in samples]
    order = range(len(joint.axes)) if start == joint.predecessor else reversed(range(len(joint.axes)))
    return [([centre for centre, _ in found], [axes[k] for _, axes in found]) for k in order]
