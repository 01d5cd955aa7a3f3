"""Numbers in a wrong unit: degrees, millimetres, axes whose length is not one."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from ...budgets import LARGEST_ROBOT, SMALLEST_ROBOT, WIDEST_BODY
from ...description import numerals, xml
from ...geometry.vectors import Array
from ...tolerances import IN_DEGREES, NEARLY_ONE, TURN_IN_RADIANS, UNIT_AXIS
from ..elements import NumberAt, inertials, joints, limits
from ..findings import Fix, LintRule, RuleHit
from ..linted_file import LintedFile


def in_degrees(value: float | None) -> bool:
    """Return True if an angle that should be in radians looks like one in degrees."""
    return value is not None and TURN_IN_RADIANS < abs(value) <= 360 and value % IN_DEGREES == 0


def _in_radians(value: float | None) -> bool:
    """Return True if an angle looks like a rounded simple fraction of a full rotation in radians."""
    steps = round((value or 0.0) / numerals.SIMPLE_ANGLE)
    return (
        value is not None
        and steps != 0
        and not in_degrees(value)
        and abs(value - steps * numerals.SIMPLE_ANGLE) < NEARLY_ONE
    )


def _convert(numbers: list[NumberAt]) -> Fix | None:
    """Return the fix that writes all in radians; None if some already are, as the units are then unknown."""
    if any(_in_radians(each.value) for each in numbers):
        return None

    def mend() -> None:
        for each in numbers:
            each.put(numerals.exact(float(np.radians(each.value or 0.0))))

    return mend


def _limits(file: LintedFile) -> Iterator[RuleHit]:
    if file.dialect == "mjcf":  # degrees are its default
        return
    every = [
        (each, [end for end in (each.lower, each.upper) if end is not None]) for each in limits(file) if each.turns
    ]
    numbers = [end.value or 0.0 for _, ends in every for end in ends]
    whole = any(map(in_degrees, numbers)) and all(value % IN_DEGREES == 0 for value in numbers)
    for each, ends in every:
        sure = any(in_degrees(end.value) for end in ends)
        if sure or (whole and any(end.value for end in ends)):
            values = " to ".join(str(end.text) for end in ends)
            beside = "" if sure else ", among others that look like degrees"
            yield RuleHit(xml.line(each.element), f"joint {each.joint!r}: limits {values} rad{beside}", _convert(ends))


def _angles(file: LintedFile) -> Iterator[RuleHit]:
    for what, element, ends in _turns(file):
        sure = any(in_degrees(end.value) for end in ends)
        if sure or any(TURN_IN_RADIANS < abs(end.value or 0.0) <= 360 for end in ends):
            yield RuleHit(
                xml.line(element),
                f"rpy {' '.join(str(end.text) for end in ends)}, of {what}",
                _convert(ends) if sure else None,
            )


def _turns(file: LintedFile) -> Iterator[tuple[str, xml.Element, list[NumberAt]]]:
    """Yield all roll, pitch, yaw of a document in radians: owner, element, numbers."""
    for element in file.root.iter() if file.root is not None else ():
        if file.dialect == "urdf" and isinstance(element.tag, str):
            count = len((element.get("rpy") or "").split())
            yield f"<{element.tag}>", element, [NumberAt(element, "rpy", place) for place in range(count)]
        elif (
            file.dialect == "sdf"
            and element.tag == "pose"
            and len((element.text or "").split()) == 6
            and element.get("degrees") not in ("true", "1")
            and element.get("rotation_format") != "quat_xyzw"
        ):
            of = element.getparent()
            name = "" if of is None else f" of <{of.tag}> {of.get('name') or ''}".rstrip()
            yield (f"the pose{name}", element, [NumberAt(element, None, place) for place in (3, 4, 5)])


def _length(file: LintedFile) -> Iterator[RuleHit]:
    robot = file.mechanism
    if robot is None:
        return
    if robot.length > LARGEST_ROBOT:
        yield RuleHit(
            None, f"the joints are {robot.length:.3g} m from their centroid on average, perhaps in millimetres"
        )
    elif robot.length < SMALLEST_ROBOT:
        yield RuleHit(None, f"the joints are {robot.length:.3g} m from their centroid on average")


def _axis(file: LintedFile) -> Iterator[RuleHit]:
    for joint in joints(file):
        for axis in joint.iterfind("axis") if file.dialect == "urdf" else ():
            vector = _vector(axis.get("xyz"))
            size = 1.0 if vector is None else float(np.linalg.norm(vector))
            if vector is not None and size > 0 and abs(size - 1) > UNIT_AXIS:
                yield RuleHit(
                    xml.line(axis),
                    f"joint {joint.get('name')!r}: an axis of length {size:.6g}",
                    partial(axis.set, "xyz", numerals.axis(vector)),
                )


def _vector(text: str | None) -> Array | None:
    try:
        return None if text is None else numerals.parse(text, 3)
    except ValueError:
        return None


def _inertia(file: LintedFile) -> Iterator[RuleHit]:
    robot = file.mechanism
    for each in inertials(file):
        mass = None if each.mass is None else each.mass.value
        if robot is None or each.inertia is None or mass is None or mass <= 0:
            continue
        gyration = float(np.sqrt(max(float(np.max(np.linalg.eigvalsh(each.inertia))), 0.0) / mass))
        if gyration > WIDEST_BODY * robot.length:
            yield RuleHit(
                xml.line(each.element),
                f"link {each.link!r}: mass {mass:g} kg and the inertia of a body "
                f"{gyration:.3g} m wide, in a robot of {robot.length:.3g} m",
            )


RULES = (
    LintRule(
        "unit-limits",
        "warning",
        "limits that look like degrees",
        "URDF and SDFormat use radians: 90 rad is 14.3 rotations, so the limit has no effect.",
        "convert them to radians",
        _limits,
        fixable=True,
    ),
    LintRule(
        "unit-angles",
        "warning",
        "roll, pitch, yaw that look like degrees",
        "URDF and SDFormat use radians: 90 rad is 14.3 rotations, so the frame is rotated by 116 degrees.",
        "convert them to radians",
        _angles,
        fixable=True,
    ),
    LintRule(
        "unit-length",
        "warning",
        "an implausible size of the robot",
        "Modelling tools export millimetres, readers expect metres.",
        "scale it, or use --unit mm with every command",
        _length,
    ),
    LintRule(
        "unit-inertia",
        "warning",
        "an inertia in another unit than the mass",
        "Tools export kg mm² or g mm². An inertia is at most its mass times the square of the body's extent.",
        "convert the inertia to kg m²",
        _inertia,
    ),
    LintRule(
        "axis-length",
        "note",
        "an axis whose length is not one",
        "hrsynth and most programs use only its direction; some scale the joint's speed by its length.",
        "divide it by its length",
        _axis,
        fixable=True,
    ),
)
