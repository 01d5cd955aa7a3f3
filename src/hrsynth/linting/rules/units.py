"""Numbers in a wrong unit: degrees, millimetres, axes whose length is not one."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from ...description import numerals, xml
from ...description.numerals import ROUNDED_UNIT_VECTOR_TOL
from ...geometry.vectors import Array
from ...tolerances import CHARACTERISTIC_LENGTH_MAX_M
from ..elements import NumberAt, list_inertials, list_joint_elements, list_limits
from ..findings import Fix, LintRule, RuleHit
from ..linted_file import LintedFile

DEGREE_MULTIPLE_MIN = 5.0
"""Angles in a file that are whole multiples of it (degrees) and larger than a turn in radians are taken for degrees."""
AXIS_LENGTH_TOL = 1e-3
"""Deviation of an axis length from one in a file that is reported."""
FULL_TURN_RAD = 6.3
"""Radians above which an angle in a file is more than a turn."""
CHARACTERISTIC_LENGTH_MIN_M = 1e-3
"""Characteristic length (m) below which lint doubts that a file is in metres."""
INERTIA_BODY_WIDTH_MAX = 20.0
"""Characteristic lengths that the body of an inertia may be wide."""


def is_in_degrees(value: float | None) -> bool:
    """Return True if an angle that should be in radians looks like one in degrees."""
    return value is not None and FULL_TURN_RAD < abs(value) <= 360 and value % DEGREE_MULTIPLE_MIN == 0


def _is_in_radians(value: float | None) -> bool:
    """Return True if an angle looks like a rounded simple fraction of a full rotation in radians."""
    steps = round((value or 0.0) / numerals.SIMPLE_ANGLE)
    return (
        value is not None
        and steps != 0
        and not is_in_degrees(value)
        and abs(value - steps * numerals.SIMPLE_ANGLE) < ROUNDED_UNIT_VECTOR_TOL
    )


def _convert(numbers: list[NumberAt]) -> Fix | None:
    """Return the fix that writes all in radians; None if some already are, as the units are then unknown."""
    if any(_is_in_radians(each.value) for each in numbers):
        return None

    def mend() -> None:
        for each in numbers:
            each.put(numerals.format_exact(float(np.radians(each.value or 0.0))))

    return mend


def _find_degree_limits(file: LintedFile) -> Iterator[RuleHit]:
    if file.dialect == "mjcf":  # degrees are its default
        return
    every = [
        (each, [end for end in (each.lower, each.upper) if end is not None])
        for each in list_limits(file)
        if each.is_angle
    ]
    numbers = [end.value or 0.0 for _, ends in every for end in ends]
    whole = any(map(is_in_degrees, numbers)) and all(value % DEGREE_MULTIPLE_MIN == 0 for value in numbers)
    for each, ends in every:
        sure = any(is_in_degrees(end.value) for end in ends)
        if sure or (whole and any(end.value for end in ends)):
            values = " to ".join(str(end.text) for end in ends)
            beside = "" if sure else ", among others that look like degrees"
            yield RuleHit(
                xml.get_line(each.element), f"joint {each.joint!r}: limits {values} rad{beside}", _convert(ends)
            )


def _find_degree_angles(file: LintedFile) -> Iterator[RuleHit]:
    for what, element, ends in _list_rotations(file):
        sure = any(is_in_degrees(end.value) for end in ends)
        if sure or any(FULL_TURN_RAD < abs(end.value or 0.0) <= 360 for end in ends):
            yield RuleHit(
                xml.get_line(element),
                f"rpy {' '.join(str(end.text) for end in ends)}, of {what}",
                _convert(ends) if sure else None,
            )


def _list_rotations(file: LintedFile) -> Iterator[tuple[str, xml.Element, list[NumberAt]]]:
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


def _find_length_units(file: LintedFile) -> Iterator[RuleHit]:
    robot = file.mechanism
    if robot is None:
        return
    if robot.length > CHARACTERISTIC_LENGTH_MAX_M:
        yield RuleHit(
            None, f"the joints are {robot.length:.3g} m from their centroid on average, perhaps in millimetres"
        )
    elif robot.length < CHARACTERISTIC_LENGTH_MIN_M:
        yield RuleHit(None, f"the joints are {robot.length:.3g} m from their centroid on average")


def _find_axis_lengths(file: LintedFile) -> Iterator[RuleHit]:
    for joint in list_joint_elements(file):
        for axis in joint.iterfind("axis") if file.dialect == "urdf" else ():
            vector = _parse_vector(axis.get("xyz"))
            size = 1.0 if vector is None else float(np.linalg.norm(vector))
            if vector is not None and size > 0 and abs(size - 1) > AXIS_LENGTH_TOL:
                yield RuleHit(
                    xml.get_line(axis),
                    f"joint {joint.get('name')!r}: an axis of length {size:.6g}",
                    partial(axis.set, "xyz", numerals.format_axis(vector)),
                )


def _parse_vector(text: str | None) -> Array | None:
    try:
        return None if text is None else numerals.parse(text, 3)
    except ValueError:
        return None


def _find_inertia_units(file: LintedFile) -> Iterator[RuleHit]:
    robot = file.mechanism
    for each in list_inertials(file):
        mass = None if each.mass is None else each.mass.value
        if robot is None or each.inertia is None or mass is None or mass <= 0:
            continue
        gyration = float(np.sqrt(max(float(np.max(np.linalg.eigvalsh(each.inertia))), 0.0) / mass))
        if gyration > INERTIA_BODY_WIDTH_MAX * robot.length:
            yield RuleHit(
                xml.get_line(each.element),
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
        _find_degree_limits,
        fixable=True,
    ),
    LintRule(
        "unit-angles",
        "warning",
        "roll, pitch, yaw that look like degrees",
        "URDF and SDFormat use radians: 90 rad is 14.3 rotations, so the frame is rotated by 116 degrees.",
        "convert them to radians",
        _find_degree_angles,
        fixable=True,
    ),
    LintRule(
        "unit-length",
        "warning",
        "an implausible size of the robot",
        "Modelling tools export millimetres, readers expect metres.",
        "scale it, or use --unit mm with every command",
        _find_length_units,
    ),
    LintRule(
        "unit-inertia",
        "warning",
        "an inertia in another unit than the mass",
        "Tools export kg mm² or g mm². An inertia is at most its mass times the square of the body's extent.",
        "convert the inertia to kg m²",
        _find_inertia_units,
    ),
    LintRule(
        "axis-length",
        "note",
        "an axis whose length is not one",
        "hrsynth and most programs use only its direction; some scale the joint's speed by its length.",
        "divide it by its length",
        _find_axis_lengths,
        fixable=True,
    ),
)
