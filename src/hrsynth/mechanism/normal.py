"""Normal form of a mechanism: joints that act as one are one.

* links connected by a fixed joint are one link;
* two coaxial R are one R, two parallel P one P;
* two perpendicular R that meet are a U; three independent R that meet (or a U and an R) are an S; an R through the
  centre of an S adds nothing. Rotations that the S then cannot make are kept as its ``tilt_limit``.

A link between two merged joints disappears; the base, the platform, the camera's link and observed links never do.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import BadMechanism
from ..geometry import lines
from ..geometry.vectors import Array, measure_angle
from ..results import Value, with_value
from ..tolerances import POINT_DISTANCE_TOL
from . import graphs
from .model import Joint, JointType, Limits, Mechanism
from .tilt_limit import Interval, TiltLimit, bound_arc_chain


@dataclass(frozen=True, eq=False, repr=False)
class NormalForm(Value):
    """Mechanism in normal form, and where its links went: ``into[old]`` is the link that took ``old`` in; how far axes
    and centres were moved in all to make one joint of several (m); the joints of each such one."""

    mechanism: Mechanism
    into: dict[str, str]
    moved: float = 0.0
    made_of: dict[str, tuple[str, ...]] = field(default_factory=dict)


@with_value
def reduce_to_normal_form(mechanism: Mechanism) -> NormalForm:
    """Merge until nothing merges; names, frames and order of the remaining parts are kept."""
    into = {name: name for name in mechanism.links}
    current = _merge_fixed(mechanism, into)
    moved, made_of = 0.0, dict[str, tuple[str, ...]]()
    while (merge := _find_next_merge(current)) is not None:
        between, gone, joint = merge
        moved += sum(_measure_axis_shift(each, joint, mechanism.length) for each in gone)
        made_of[_choose_first(current, gone)] = tuple(
            name for each in gone for name in made_of.pop(each.name, (each.name,))
        )
        current = _replace_joint(current, between, gone, joint)
    if current is not mechanism:
        current = replace(current, written=mechanism)
    return NormalForm(current, into, moved, made_of)


def _measure_axis_shift(old: Joint, new: Joint, length: float) -> float:
    """Return the distance of the axes of a joint from those of the joint that replaces it, within a length (m)."""
    found = 0.0
    for axis in old.axes:
        if old.type in (JointType.REVOLUTE, JointType.UNIVERSAL):
            found += lines.measure_line_distance(new.point, old.point, axis)
        if new.axes:
            found += length * min(float(np.linalg.norm(np.cross(axis, other))) for other in new.axes)
    return found


def _list_protected_names(mechanism: Mechanism) -> set[str]:
    return {mechanism.base, mechanism.platform, mechanism.reference, *_list_observing_links(mechanism)}


def _list_observing_links(mechanism: Mechanism) -> list[str]:
    """Return the links that are observed, or from which others are."""
    seen = [o.link for o in mechanism.observations]
    return seen + [o.seen_from for o in mechanism.observations if o.seen_from is not None]


def _merge_fixed(mechanism: Mechanism, into: dict[str, str]) -> Mechanism:
    """Merge every group of links connected by fixed joints into one: the base, the platform, the camera's link or an
    observed link if the group has one, else the first in the mechanism's order."""
    fixed = [j for j in mechanism.joints.values() if j.type is JointType.FIXED]
    if not fixed:
        return mechanism
    first = (mechanism.base, mechanism.platform, mechanism.reference, *_list_observing_links(mechanism))
    order = {name: i for i, name in enumerate(dict.fromkeys((*first, *mechanism.links)))}
    bonds = graphs.build_adjacency((), (j.links for j in fixed))
    gone: set[str] = set()
    kept_links = []
    for group in graphs.list_components(bonds):
        kept = min(group, key=order.__getitem__)
        if kept == mechanism.base and mechanism.platform in group:
            raise BadMechanism("the platform is fixed to the base", mechanism.platform, "a movable platform")
        members = [name for name in mechanism.links if name in group and name != kept]
        into.update({name: kept for name in members})
        gone.update(members)
        content = mechanism.links[kept].xml + tuple(x for name in members for x in mechanism.links[name].xml)
        kept_links.append(replace(mechanism.links[kept], xml=content))
    poses = {name: link.pose for name, link in mechanism.links.items()}
    observations = tuple(o.carried_by(into, poses) for o in mechanism.observations)
    cameras = tuple(camera.carried_by(into, poses) for camera in mechanism.cameras)
    joints = {}
    for joint in mechanism.joints.values():
        moved = replace(joint, predecessor=into[joint.predecessor], successor=into[joint.successor])
        if moved.predecessor != moved.successor:
            joints[joint.name] = moved
    links = {name: link for name, link in mechanism.links.items() if name not in gone}
    links.update({link.name: link for link in kept_links})
    return replace(
        mechanism,
        links=links,
        joints=joints,
        observations=observations,
        camera=None if mechanism.camera is None else into[mechanism.camera],
        cameras=cameras,
    )


def _find_next_merge(mechanism: Mechanism) -> tuple[list[str], list[Joint], Joint] | None:
    """Return the links between, the joints that go, and the joint that replaces them; a U of two R with distant centres
    only if nothing else merges, as axes of two spherical joints on one rod may meet as well."""
    far: tuple[list[str], list[Joint], Joint] | None = None
    held = _list_protected_names(mechanism) | mechanism.coupled_links
    free = [name for name in mechanism.links if name not in held and len(mechanism.joints_of(name)) == 2]
    for x in free:
        first, second = mechanism.joints_of(x)
        if first.other(x) == second.other(x) or first.is_actuated != second.is_actuated:
            continue
        a = first if first.successor == x else first.turned()
        b = second if second.predecessor == x else second.turned()
        merged = _pair(mechanism, a, b)
        if merged is not None:
            if (
                a.type is b.type is JointType.REVOLUTE
                and merged.type is JointType.UNIVERSAL
                and np.linalg.norm(b.point - a.point) > POINT_DISTANCE_TOL * mechanism.length
            ):
                far = far or ([x], [first, second], merged)
                continue
            return [x], [first, second], merged
    for chain in _list_chains_of_three(mechanism, set(free)):
        merged = _merge_triple(mechanism, *chain)
        if merged is not None:
            return [chain[0].successor, chain[1].successor], list(chain), merged
    return far


def _pair(mechanism: Mechanism, a: Joint, b: Joint) -> Joint | None:
    """Return the joint that acts as a then b (b after a), or None."""
    near = POINT_DISTANCE_TOL * mechanism.length
    kinds = a.type.value + b.type.value
    if kinds == "RR":
        if lines.is_parallel(a.axis, b.axis):
            is_coaxial = lines.measure_line_distance(b.point, a.point, a.axis) <= near
            return _join(a, b, a.type, a.point, a.axes) if is_coaxial else None
        centre = lines.find_meeting_point([(a.point, a.axis), (b.point, b.axis)], near)
        if centre is not None and lines.is_perpendicular(a.axis, b.axis):
            turns = () if a.limits is b.limits is None else ((a.name, a.limits), (b.name, b.limits))
            return _join(a, b, JointType.UNIVERSAL, centre, (a.axis, b.axis), turns=turns)
    elif kinds == "PP" and lines.is_parallel(a.axis, b.axis):
        return _join(a, b, a.type, a.point, a.axes)
    elif kinds in ("RU", "UR"):
        centre, arm = (a.point, b) if a.type is JointType.UNIVERSAL else (b.point, a)
        if lines.measure_line_distance(centre, arm.point, arm.axis) <= near:
            axes = np.array([*a.axes, *b.axes])
            if abs(np.linalg.det(axes)) > 1e-3:
                return _join(a, b, JointType.SPHERICAL, centre, wrist=_compute_tilt_limit(a, b))
            inner = a.axes[-1], b.axes[0]
            if lines.is_parallel(*inner):
                return _join(a, b, JointType.UNIVERSAL, centre, (a.axes[0], b.axes[-1]))
    elif kinds in ("RS", "SR"):
        ball, arm = (a, b) if a.type is JointType.SPHERICAL else (b, a)
        if lines.measure_line_distance(ball.point, arm.point, arm.axis) <= near:
            return _join(a, b, JointType.SPHERICAL, ball.point, wrist=_compute_tilt_limit(a, b))
    return None


def _join(
    a: Joint,
    b: Joint,
    type: JointType,
    point: Array,
    axes: tuple[Array, ...] = (),
    wrist: TiltLimit | None = None,
    turns: tuple[tuple[str, Limits | None], ...] = (),
) -> Joint:
    """Return one joint from a's predecessor to b's successor, without limits."""
    joint = replace(a, successor=b.successor, limits=None, offset=None)
    return replace(joint, type=type, point=point, axes=axes, wrist=wrist, turns=turns)


def _compute_tilt_limit(*joints: Joint) -> TiltLimit | None:
    """Return the tilt limit of several rotations about one centre in series."""
    ends: tuple[Array, Array] | None = None
    span: Interval = 0.0, 0.0
    count = 0
    for joint in joints:
        if joint.axes:
            angle = measure_angle(joint.axes[0], joint.axes[-1])
            first, last, own = joint.axes[0], joint.axes[-1], (angle, angle)
        elif joint.wrist is not None:
            first, last, own = joint.wrist.first, joint.wrist.last, (joint.wrist.low, joint.wrist.high)
            count += joint.wrist.count
        else:
            return None
        span = own if ends is None else bound_arc_chain(span, measure_angle(ends[1], first), own)
        ends = (first if ends is None else ends[0]), last
        count += len(joint.axes)
    return None if ends is None else TiltLimit.of(*ends, span, count)


def _merge_triple(mechanism: Mechanism, a: Joint, b: Joint, c: Joint) -> Joint | None:
    if {a.type, b.type, c.type} != {JointType.REVOLUTE} or len({a.is_actuated, b.is_actuated, c.is_actuated}) > 1:
        return None
    near = POINT_DISTANCE_TOL * mechanism.length
    centre = lines.find_meeting_point([(j.point, j.axis) for j in (a, b, c)], near)
    if centre is None or abs(np.linalg.det(np.array([a.axis, b.axis, c.axis]))) < 1e-3:
        return None
    return _join(a, c, JointType.SPHERICAL, centre, wrist=_compute_tilt_limit(a, b, c))


def _list_chains_of_three(mechanism: Mechanism, free: set[str]) -> Iterator[tuple[Joint, Joint, Joint]]:
    for x in mechanism.links:
        if x not in free:
            continue
        for before, middle in (mechanism.joints_of(x), mechanism.joints_of(x)[::-1]):
            y = middle.other(x)
            if y not in free:
                continue
            after = next((j for j in mechanism.joints_of(y) if j.name != middle.name), None)
            if after is None or before.other(x) == after.other(y):
                continue
            yield (
                before if before.successor == x else before.turned(),
                middle if middle.predecessor == x else middle.turned(),
                after if after.predecessor == y else after.turned(),
            )


def _choose_first(mechanism: Mechanism, joints: list[Joint]) -> str:
    return min((each.name for each in joints), key=list(mechanism.joints).index)


def _replace_joint(mechanism: Mechanism, between: list[str], gone: list[Joint], joint: Joint) -> Mechanism:
    """Put ``joint`` in the place (name and order) of the first of ``gone`` in the mechanism's order."""
    joint = replace(joint, name=_choose_first(mechanism, gone), xml=())
    order = list(mechanism.joints)
    changed = mechanism.changed(remove_links=between, remove_joints=[j.name for j in gone], joints=[joint])
    return replace(changed, joints={n: changed.joints[n] for n in sorted(changed.joints, key=order.index)})


def locate_centre_pair(a: Joint, b: Joint) -> tuple[Array, Array]:
    """Return the end points of the segment between two joints of one link: an R's centre is the point of its axis
    nearest to the other's centre (two R: the ends of their common perpendicular)."""
    a_line, b_line = a.type is JointType.REVOLUTE, b.type is JointType.REVOLUTE
    if a_line and b_line:
        return lines.find_common_perpendicular(a.point, a.axis, b.point, b.axis)
    if a_line:
        return lines.project_to_line(b.point, a.point, a.axis), b.point
    if b_line:
        return a.point, lines.project_to_line(a.point, b.point, b.axis)
    return a.point, b.point
