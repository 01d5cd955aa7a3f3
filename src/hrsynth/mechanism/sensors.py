"""What else could be measured of a mechanism: an encoder on a joint, the position of a line whose direction is seen."""

from __future__ import annotations

from ..geometry.vectors import Array, frozen, perpendicular
from .legs import LegDecomposition
from .model import Joint, JointType, Mechanism
from .normal import centre_pair
from .observation import AngleEncoder, Direction, Encoder, LinePosition, SlideEncoder

TURNING = (JointType.REVOLUTE, JointType.CYLINDRICAL)


def encoders(mechanism: Mechanism, joint: Joint, leg: str = "") -> tuple[Encoder, ...]:
    """An encoder for each coordinate of an R, P, C (slide, turn) or U (first, second axis); none for other types."""
    if joint.type is JointType.UNIVERSAL:
        return tuple(_angle(mechanism, each, leg, each.axes[1]) for each in (joint, joint.turned()))
    found: list[Encoder] = []
    if joint.type.slides:
        found.append(_slide(mechanism, joint, leg))
    if joint.type in TURNING:
        found.append(_angle(mechanism, joint, leg, perpendicular(joint.axis)))
    return tuple(found)


def _angle(mechanism: Mechanism, joint: Joint, leg: str, mark: Array) -> AngleEncoder:
    """The turn about the first axis, fixed in the predecessor, of a direction ``mark`` fixed in the successor."""
    before, after = (mechanism.links[link].pose[:3, :3].T for link in joint.links)
    return AngleEncoder(leg, joint.successor, joint.name, frozen(before @ joint.axis), frozen(after @ mark),
                 frozen(before @ mark), seen_from=joint.predecessor)


def _slide(mechanism: Mechanism, joint: Joint, leg: str) -> SlideEncoder:
    before, after = (mechanism.links[link].pose for link in joint.links)
    return SlideEncoder(leg, joint.successor, joint.name, frozen(before[:3, :3].T @ joint.axis),
                 frozen(after[:3, :3].T @ (joint.point - after[:3, 3])),
                 frozen(before[:3, :3].T @ (joint.point - before[:3, 3])), seen_from=joint.predecessor)


def line_position(anatomy: LegDecomposition, seen: Direction) -> LinePosition:
    """The position of the line whose direction is ``seen``: the line through the segment's first centre (that of a
    joint that does not slide, where there is one; docs/pages/theory.md, section 2)."""
    mechanism = anatomy.mechanism
    link = mechanism.links[seen.link]
    joints = sorted(mechanism.joints_of(seen.link), key=lambda joint: joint.type.slides)
    centre = centre_pair(*joints)[0] if len(joints) == 2 else joints[0].point
    return LinePosition(seen.leg, seen.link, seen.direction, link.pose[:3, :3].T @ (centre - link.pose[:3, 3]),
                        seen_from=seen.seen_from)
