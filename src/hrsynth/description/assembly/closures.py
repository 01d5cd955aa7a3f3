"""Closures replaced by equivalent joints: points on one axis, points in a plane, chains that a writer cut."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Set
from dataclasses import replace

import numpy as np

from ...geometry import lines
from ...geometry.vectors import Array, build_pose, find_perpendicular, freeze_array, invert_pose, normalise_vector
from ...mechanism import graphs
from ...mechanism.model import Joint, JointType, Link, Mechanism, Note
from ...tolerances import INCIDENCE_TOL
from ..chains import CUT, END, SECOND, name_chain_joint, recognise_chain
from ..conversion import convert_to_joint
from ..jointgraph import FrameSpec, JointGraph, JointSpec, Z, compute_zero_poses


def merge_points(graph: JointGraph) -> None:
    """Merge point closures of the same two links: two are a revolute joint through both; three are rigid."""
    noise = graph.digits.deviation() * graph.unit
    table: dict[frozenset[str], list[JointSpec]] = defaultdict(list)
    for joint in graph.joints.values():
        if joint.type is JointType.SPHERICAL and not joint.in_tree:
            table[frozenset(joint.links)].append(joint)
    for joints in table.values():
        merged = _joint_through(joints, noise) if len(joints) > 1 else None
        if merged is None:
            continue
        for joint in joints:
            del graph.joints[joint.name]
        graph.joints[merged.name] = merged
        if joints[1].name == merged.name + SECOND:
            continue
        what = "revolute joint" if merged.type is JointType.REVOLUTE else "rigid joint"
        graph.note(
            "merged",
            f"the points {', '.join(repr(joint.name) for joint in joints)} connect the same two links "
            f"and are read as one {what}",
        )


def _joint_through(joints: list[JointSpec], noise: float) -> JointSpec | None:
    """Return the joint that equals several point closures; ``noise`` (m) is the rounding error of the file's
    decimals."""
    first = joints[0]
    points = np.array([[joint.ends[joint.links.index(link)].X[:3, 3] for joint in joints] for link in first.links])
    arms = points[:, 1:] - points[:, :1]
    sizes = np.linalg.norm(arms, axis=2)
    size = float(np.max(sizes))
    if size <= 0 or np.max(np.abs(sizes[0] - sizes[1])) > INCIDENCE_TOL * size + noise:
        return None
    k = int(np.argmax(sizes[0]))
    far = [np.linalg.norm(np.cross(arm, arm[k]), axis=1) for arm in arms]
    m = None if max(each.max() for each in far) <= (INCIDENCE_TOL * size + noise) * size else int(np.argmax(far[0]))
    kind = JointType.REVOLUTE if m is None else JointType.FIXED
    one, two = (
        FrameSpec(end.link, build_pose(point[0], _frame(arm[k], None if m is None else arm[m])), end.line)
        for end, point, arm in zip(first.ends, points, arms, strict=True)
    )
    return replace(first, type=kind, ends=(one, two), axes=(Z,) * kind.axes)


def _frame(z: Array, near: Array | None) -> Array:
    x = find_perpendicular(z, near)
    return np.column_stack((x, np.cross(normalise_vector(z), x), normalise_vector(z)))


def points_as_hinges(mechanism: Mechanism, within: float) -> Mechanism:
    """Replace point closures of planar and spherical loops by revolute joints: normal to the plane, or through the
    common centre; both to ``within`` (characteristic lengths, radians)."""
    joints, notes = dict(mechanism.joints), list(mechanism.notes)
    for joint in [j for j in joints.values() if j.type is JointType.SPHERICAL and not j.in_tree]:
        axis, what = _plane_of(joint, list(joints.values()), within), "planar"
        if axis is None:
            axis, what = _spoke_of(joint, list(joints.values()), within * mechanism.length), "spherical"
        if axis is not None:
            joints[joint.name] = replace(joint, type=JointType.REVOLUTE, axes=(axis,))
            notes.append(Note("merged", f"the point {joint.name!r} closes a {what} loop: read as a revolute joint"))
    return replace(mechanism, joints=joints, notes=tuple(notes))


def _plane_of(joint: Joint, joints: list[Joint], within: float) -> Array | None:
    """Return the normal of the plane in which the joint's two links move relative to each other, or None."""
    for candidate in _hinges_on(joint, joints):
        normal = candidate.axis
        flat = graphs.build_adjacency(
            joint.links, (j.links for j in joints if j.name != joint.name and _has_parallel_axis(j, normal, within))
        )
        if joint.links[1] in graphs.find_component(flat, joint.links[0]):
            return normal
    return None


def _spoke_of(joint: Joint, joints: list[Joint], tolerance: float) -> Array | None:
    """Return the direction to the joint from the centre about which its two links rotate relative to each other, or
    None; ``tolerance`` (m) is the largest distance of axes there."""
    others = [j for j in joints if j.name != joint.name]
    for candidate in _hinges_on(joint, others):
        for other in others:
            if other.type is not JointType.REVOLUTE or lines.is_parallel(other.axis, candidate.axis):
                continue
            centre = lines.find_meeting_point([(candidate.point, candidate.axis), (other.point, other.axis)], tolerance)
            if centre is None or np.linalg.norm(joint.point - centre) <= tolerance:
                continue
            still = graphs.build_adjacency(
                joint.links, (j.links for j in others if _is_rotation_about(j, centre, tolerance))
            )
            if joint.links[1] in graphs.find_component(still, joint.links[0]):
                return normalise_vector(joint.point - centre)
    return None


def _hinges_on(joint: Joint, joints: list[Joint]) -> list[Joint]:
    """Return the revolute joints on the two bodies that a joint connects."""
    bonds = graphs.build_adjacency(joint.links, (j.links for j in joints if j.type is JointType.FIXED))
    bodies = {link for end in joint.links for link in graphs.find_component(bonds, end)}
    return [j for j in joints if j.type is JointType.REVOLUTE and bodies & set(j.links)]


def _is_rotation_about(joint: Joint, centre: Array, tolerance: float) -> bool:
    """Return True if a joint lets its two links only rotate about a centre."""
    match joint.type:
        case JointType.REVOLUTE:
            return lines.measure_line_distance(centre, joint.point, joint.axis) <= tolerance
        case JointType.UNIVERSAL | JointType.SPHERICAL:
            return bool(np.linalg.norm(joint.point - centre) <= tolerance)
    return joint.type is JointType.FIXED


def _has_parallel_axis(joint: Joint, normal: Array, within: float) -> bool:
    match joint.type:
        case JointType.REVOLUTE | JointType.PLANAR:
            return bool(np.linalg.norm(np.cross(joint.axis, normal)) <= within)
        case JointType.PRISMATIC:
            return abs(float(joint.axis @ normal)) <= within
    return joint.type is JointType.FIXED


def join_halves(graph: JointGraph, given: tuple[Set[str | None], Set[str]] = (frozenset(), frozenset())) -> None:
    """Undo the cuts of our writers: frames of closures are removed, and the joint before a rigid closure closes the
    loop itself. Joints that only have such names stay: the result must be equivalent, and neither named elsewhere in
    the file nor among the ``given`` links and joints."""
    links, joints = graph.named[0] | given[0], graph.named[1] | given[1]

    def bare(name: str) -> bool:
        return not graph.links[name].xml and name not in links

    for name in [link for link in graph.links if link.endswith((CUT, END)) and bare(link)]:
        own = [joint for joint in graph.joints.values() if name in joint.links]
        if len(own) == 2 and sum(not joint.in_tree for joint in own) == 1:
            carrier, closure = sorted(own, key=lambda joint: not joint.in_tree)
            if carrier.type is JointType.FIXED and carrier.links[1] == name and carrier.name not in joints:
                del graph.joints[carrier.name], graph.links[name]
                here = closure.links.index(name)
                X = carrier.ends[0].X @ invert_pose(carrier.ends[1].X) @ closure.ends[here].X
                graph.joints[closure.name] = _with_end(closure, here, carrier.links[0], X, closure.line)
    for name in [link for link in graph.links if link.endswith(CUT) and bare(link)]:
        _join(graph, name, bare, joints)


def _join(graph: JointGraph, name: str, bare: Callable[[str], bool], busy: Set[str]) -> None:
    """Replace the rigid closure by the joint that carries a cut half."""
    own = [joint for joint in graph.joints.values() if name in joint.links]
    stem = name.removesuffix(CUT)
    counted = [name_chain_joint(stem, k) for k in (1, 2, 3)]
    carriers, welds = ([joint for joint in own if joint.in_tree is in_tree] for in_tree in (True, False))
    if len(carriers) != 1 or len(welds) != 1 or welds[0].type is not JointType.FIXED or carriers[0].links[1] != name:
        return
    (last,), (weld,) = carriers, welds
    names = [stem] if last.name == stem else counted[: counted.index(last.name) + 1] if last.name in counted[1:] else []
    chain = [graph.joints[each] for each in names if each in graph.joints]
    between = [joint.links[1] for joint in chain[:-1]]
    taken = stem in graph.joints and graph.joints[stem] not in (last, weld)
    if (
        not chain
        or len(chain) < len(names)
        or taken
        or not busy.isdisjoint((*names, weld.name))
        or not all(bare(link) and sum(link in joint.links for joint in graph.joints.values()) == 2 for link in between)
    ):
        return
    whole = _whole(stem, chain, graph.digits.deviation())
    if whole is None:
        return
    here = weld.links.index(name)
    X = weld.ends[1 - here].X @ invert_pose(weld.ends[here].X) @ last.ends[1].X
    for joint in (*chain, weld):
        del graph.joints[joint.name]
    for link in (name, *between):
        del graph.links[link]
    graph.joints[stem] = replace(_with_end(whole, 1, weld.links[1 - here], X, weld.line), in_tree=False)


def _whole(name: str, chain: list[JointSpec], noise: float) -> JointSpec | None:
    """Return the joint that equals a chain of joints at one point, to the file's decimals; None if its links, geometry,
    motors or limits do not fit."""
    first, last = chain[0], chain[-1]
    if last is first:
        return first
    base, X = first.links[0], first.ends[0].X
    poses = compute_zero_poses(base, [(joint, *joint.links) for joint in chain])
    joints = [convert_to_joint(joint, poses, in_tree=True, is_closed=True) for joint in chain]
    between = [Link(joint.successor, poses[joint.successor]) for joint in joints[:-1]]
    whole = recognise_chain(name, joints, between, INCIDENCE_TOL + noise, INCIDENCE_TOL + noise)
    if whole is None:
        return None
    axes = tuple(X[:3, :3].T @ axis for axis in whole.axes)
    if whole.type is JointType.UNIVERSAL:
        axes = axes[0], last.axes[0]
    return replace(first, name=name, type=whole.type, axes=axes, motor=whole.motor)


def _with_end(joint: JointSpec, place: int, link: str, X: Array, line: int | None) -> JointSpec:
    end = FrameSpec(link, freeze_array(X), line)
    return replace(joint, ends=(end, joint.ends[1]) if place == 0 else (joint.ends[0], end))
