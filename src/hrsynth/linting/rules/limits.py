"""Limits of joints: invalid ones, limits that exclude the zero configuration, missing ones."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from lxml import etree

from ...description import numerals, xml
from ...description.formats.native.write import NO_LIMIT
from ...mechanism.model import JointType
from ..elements import LimitElement, list_joint_elements, list_limits, parse_number
from ..findings import LintRule, RuleHit
from ..linted_file import LintedFile


def _order(file: LintedFile) -> Iterator[RuleHit]:
    for each in list_limits(file):
        if each.bounds is not None and each.bounds[0] > each.bounds[1]:
            lower, upper = each.bounds
            yield RuleHit(
                xml.get_line(each.element),
                f"joint {each.joint!r}: lower limit {lower:g} above the upper one {upper:g}",
                partial(_exchange, each),
            )


def _exchange(limit: LimitElement) -> None:
    assert limit.lower is not None
    assert limit.upper is not None
    lower, upper = limit.lower.text or "", limit.upper.text or ""
    limit.lower.put(upper)
    limit.upper.put(lower)


def _find_empty(file: LintedFile) -> Iterator[RuleHit]:
    for each in list_limits(file):
        if each.bounds is not None and each.bounds[0] == each.bounds[1]:
            yield RuleHit(xml.get_line(each.element), f"joint {each.joint!r}: both limits are {each.bounds[0]:g}")


def _find_zero(file: LintedFile) -> Iterator[RuleHit]:
    for each in list_limits(file):
        home = (parse_number(each.owner.get("ref")) or 0.0) if file.dialect == "mjcf" else 0.0
        if (
            each.bounds is not None
            and each.bounds[0] < each.bounds[1]
            and not (each.bounds[0] <= home <= each.bounds[1])
        ):
            yield RuleHit(
                xml.get_line(each.element),
                f"joint {each.joint!r}: its limits {each.bounds[0]:g} to {each.bounds[1]:g} exclude its zero",
            )


def _find_missing(file: LintedFile) -> Iterator[RuleHit]:
    if file.dialect != "urdf":
        return
    for joint in list_joint_elements(file):
        kind = joint.get("type")
        if joint.tag == "joint" and kind in ("revolute", "prismatic") and joint.find("limit") is None:
            yield RuleHit(
                xml.get_line(joint),
                f"joint {joint.get('name')!r} of type {kind} has no <limit>",
                partial(_remove_range, joint, kind),
            )


def _remove_range(joint: xml.Element, kind: str) -> None:
    if kind == "revolute":
        joint.set("type", "continuous")
    else:
        values = {key: numerals.format_exact(value) for key, value in NO_LIMIT.items()}
        etree.SubElement(joint, "limit", {**values, "free": " ".join(NO_LIMIT)})


def _find_unlimited(file: LintedFile) -> Iterator[RuleHit]:
    graph = file.said
    for joint in () if graph is None else graph.joints.values():
        open_ended = joint.limits is None or None in (joint.limits.lower, joint.limits.upper)
        if joint.motor is not None and joint.type in (JointType.REVOLUTE, JointType.PRISMATIC) and open_ended:
            yield RuleHit(joint.line, f"the actuated joint {joint.name!r} has no range")


RULES = (
    LintRule(
        "limits-order",
        "error",
        "lower limit above upper limit",
        "No value of the coordinate satisfies both. Some readers refuse the file, others ignore the limits.",
        "exchange the two numbers",
        _order,
        fixable=True,
    ),
    LintRule(
        "limits-empty",
        "warning",
        "both limits are the same number",
        "Exporters write 0 and 0 for an unknown range. Simulators then lock the joint; hrsynth reads it as free.",
        "write the true range; a revolute joint without one is of type continuous",
        _find_empty,
    ),
    LintRule(
        "limits-zero",
        "warning",
        "limits exclude the zero of the joint",
        "Loops are closed, mechanisms compared and most controllers started at the zero configuration. If limits "
        "exclude it, simulators start with a jump.",
        "count the coordinate from another configuration, or widen the limits",
        _find_zero,
    ),
    LintRule(
        "limits-demanded",
        "warning",
        "URDF requires limits for this joint",
        "urdfdom, and with it most of ROS, refuses a revolute or prismatic joint without <limit>.",
        "make a revolute joint continuous; give a prismatic one its range",
        _find_missing,
        fixable=True,
    ),
    LintRule(
        "motor-unlimited",
        "note",
        "an actuated joint without a range",
        "Paths, grids and the selection of legs respect limits only if the file gives them.",
        "write the motor's range",
        _find_unlimited,
    ),
)
