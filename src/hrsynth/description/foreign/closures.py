"""Closures read as the joints that they stand for: points on one axis, points in a plane, chains that a writer cut."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...geometry import lines
from ...geometry.vectors import Array, frozen, inverse, perpendicular, pose, unit
from ...mechanism import graphs
from ...mechanism.model import Joint, JointType, Mechanism, Motor, Note
from ...tolerances import NOISE
from ..draft import Edge, End
from .graph import Graph

CUT, WELD, END, SECOND = "__cut", "__weld", "__end", "__second"
"""Ends of the names of what our writers add for a loop N: the link that one half of the cut joint carries, the closure
in all six directions, the frame on the other link, the second point of a revolute joint."""


def points_together(graph: Graph) -> None:
    """Two points in which the same two links are held together are a revolute joint through both; three are rigid."""
    table: dict[frozenset[str], list[Edge]] = defaultdict(list)
    for edge in graph.edges.values():
        if edge.type is JointType.SPHERICAL and not edge.in_tree:
            table[frozenset(edge.links)].append(edge)
    for edges in table.values():
        merged = _merged(edges) if len(edges) > 1 else None
        if merged is None:
            continue
        for edge in edges:
            del graph.edges[edge.name]
        graph.edges[merged.name] = merged
        if edges[1].name == merged.name + SECOND:
            continue
        what = "revolute joint" if merged.type is JointType.REVOLUTE else "rigid joint"
        graph.note("merged", f"the points {', '.join(repr(edge.name) for edge in edges)} hold the same two links "
                             f"together and are read as one {what}")


def _merged(edges: list[Edge]) -> Edge | None:
    first = edges[0]
    places = np.array([[edge.ends[edge.links.index(link)].X[:3, 3] for edge in edges] for link in first.links])
    arms = places[:, 1:] - places[:, :1]
    sizes = np.linalg.norm(arms, axis=2)
    size = float(np.max(sizes))
    if size <= 0 or np.max(np.abs(sizes[0] - sizes[1])) > NOISE * size:
        return None
    k = int(np.argmax(sizes[0]))
    far = [np.linalg.norm(np.cross(arm, arm[k]), axis=1).max() / size**2 for arm in arms]
    if max(far) <= NOISE:
        frames = [_frame(arm[k]) for arm in arms]
        kind = JointType.REVOLUTE
    else:
        m = int(np.argmax(np.linalg.norm(np.cross(arms[0], arms[0][k]), axis=1)))
        frames = [_frame(arm[k], arm[m]) for arm in arms]
        kind = JointType.FIXED
    one, two = (End(end.link, pose(place[0], R), end.line)
                for end, place, R in zip(first.ends, places, frames, strict=True))
    return replace(first, type=kind, ends=(one, two), axes=(np.array([0.0, 0.0, 1.0]),) * kind.axes)


def _frame(z: Array, near: Array | None = None) -> Array:
    x = perpendicular(z, near)
    return np.column_stack((x, np.cross(unit(z), x), unit(z)))


def points_in_planes(mechanism: Mechanism) -> Mechanism:
    """A point closure between two links that can only move in a plane is a revolute joint normal to it."""
    joints, notes = dict(mechanism.joints), list(mechanism.notes)
    for joint in [j for j in joints.values() if j.type is JointType.SPHERICAL and not j.in_tree]:
        normal = _plane_of(joint, list(joints.values()))
        if normal is not None:
            joints[joint.name] = replace(joint, type=JointType.REVOLUTE, axes=(normal,))
            notes.append(Note("merged", f"the point {joint.name!r} closes a planar loop: read as a revolute joint"))
    return replace(mechanism, joints=joints, notes=tuple(notes))


def _plane_of(joint: Joint, joints: list[Joint]) -> Array | None:
    """The normal of the plane in which the joint's two links move relative to each other, or None."""
    bonds = graphs.adjacency(joint.links, (j.links for j in joints if j.type is JointType.FIXED))
    bodies = {link for end in joint.links for link in graphs.component(bonds, end)}
    for candidate in [j for j in joints if j.type is JointType.REVOLUTE and bodies & set(j.links)]:
        normal = candidate.axis
        flat = graphs.adjacency(joint.links, (j.links for j in joints if j.name != joint.name and _flat(j, normal)))
        if joint.links[1] in graphs.component(flat, joint.links[0]):
            return normal
    return None


def _flat(joint: Joint, normal: Array) -> bool:
    match joint.type:
        case JointType.REVOLUTE | JointType.PLANAR:
            return lines.parallel(joint.axis, normal)
        case JointType.PRISMATIC:
            return lines.perpendicular(joint.axis, normal)
    return joint.type is JointType.FIXED


def halves_joined(graph: Graph) -> None:
    """What our writers cut is whole again: frames of closures go, and the joint before a rigid closure closes the loop
    itself."""
    for name in [link for link in graph.links if link.endswith((CUT, END))]:
        own = [edge for edge in graph.edges.values() if name in edge.links]
        if len(own) == 2 and sum(not edge.in_tree for edge in own) == 1:
            carrier, closure = sorted(own, key=lambda edge: not edge.in_tree)
            if carrier.type is JointType.FIXED and carrier.links[1] == name:
                del graph.edges[carrier.name], graph.links[name]
                here = closure.links.index(name)
                X = carrier.ends[0].X @ inverse(carrier.ends[1].X) @ closure.ends[here].X
                graph.edges[closure.name] = _with_end(closure, here, End(carrier.links[0], frozen(X), closure.line))
    for name in [link for link in graph.links if link.endswith(CUT)]:
        _joined(graph, name)


def _joined(graph: Graph, name: str) -> None:
    """Let the joint that carries a cut half take the place of the rigid closure."""
    own = [edge for edge in graph.edges.values() if name in edge.links]
    welds = [edge for edge in own if edge.type is JointType.FIXED and not edge.in_tree]
    stem = name.removesuffix(CUT)
    chain = [graph.edges[key] for key in (stem, *(f"{stem}__{k}" for k in (1, 2, 3))) if key in graph.edges]
    chain = [edge for edge in chain if edge not in welds]
    if len(own) != 2 or len(welds) != 1 or not chain or chain[-1].links[1] != name:
        return
    whole = _whole(stem, chain)
    if whole is None:
        return
    weld = welds[0]
    here = weld.links.index(name)
    X = weld.ends[1 - here].X @ inverse(weld.ends[here].X) @ chain[-1].ends[1].X
    for edge in (*chain, weld):
        del graph.edges[edge.name]
    for link in (name, *(edge.links[1] for edge in chain[:-1])):
        del graph.links[link]
    end = End(weld.ends[1 - here].link, frozen(X), weld.line)
    graph.edges[stem] = replace(_with_end(whole, 1, end), in_tree=False)


def _whole(name: str, chain: list[Edge]) -> Edge | None:
    """The joint that a chain of joints at one place is."""
    if len(chain) == 1:
        return chain[0]
    word = "".join(str(edge.type) for edge in chain)
    kind = {"RR": JointType.UNIVERSAL, "RRR": JointType.SPHERICAL, "PR": JointType.CYLINDRICAL,
            "PPR": JointType.PLANAR}.get(word)
    if kind is None or any(a.links[1] != b.links[0] for a, b in pairwise(chain)):
        return None
    axes = tuple(edge.axes[0] for edge in chain)
    axes = axes if kind is JointType.UNIVERSAL else axes[-1:] if kind.axes else ()
    motor = chain[0].motor and Motor(chain[0].motor.name.removesuffix("__1"))
    return replace(chain[0], name=name, type=kind, axes=axes, motor=motor)


def _with_end(edge: Edge, place: int, end: End) -> Edge:
    ends = (end, edge.ends[1]) if place == 0 else (edge.ends[0], end)
    return replace(edge, ends=ends)
