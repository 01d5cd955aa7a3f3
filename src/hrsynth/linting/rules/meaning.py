"""What a file says to no effect: elements and attributes that no reader of URDF knows, legs that are none."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator

from ...description import xml
from ...errors import BadRobotFile, HrsynthError
from ...mechanism.legs import decompose
from ...mechanism.normal import normal_form
from ...tolerances import LIKE_A_WORD
from ..findings import LintRule, Spot
from ..subject import LintedFile, defects_of

_ENDS = ("parent", "child", "predecessor", "successor")
ROBOT = {"link", "joint", "loop", "coupling", "transmission", "hrsynth", "material", "gazebo", "sensor", "ros2_control",
         "mujoco", "constraint", "loop_joint", "frame", "group", "group_state", "end_effector", "disable_collisions"}
"""What stands in ``<robot>``, of any dialect that is written in URDF."""
WITHIN = {
    "link": {"inertial", "visual", "collision", "contact", "sensor", "self_collision_checking", "collision_checking",
             "kinematic", "gravity", "surface", "self_filter", "origin"},
    "joint": {"origin", "parent", "child", "axis", "limit", "dynamics", "mimic", "calibration", "safety_controller",
              "axis2"},
    "loop": {"predecessor", "successor", "axis", "axis2", "limit", "dynamics"},
    "coupling": {"predecessor", "successor", "ratio"},
    "hrsynth": {"platform", "camera", "observe"},
}
"""What stands in the elements that say what the robot is."""
ATTRIBUTES = {
    "origin": {"xyz", "rpy"}, "axis": {"xyz"}, "axis2": {"xyz"}, "ratio": {"value"}, **{tag: {"link"} for tag in _ENDS},
    "platform": {"link", "turns"}, "camera": {"link", "name"},
    "observe": {"leg", "link", "joint", "axis", "kind", "camera", "at", "radius"},
    "limit": {"lower", "upper", "effort", "velocity", "acceleration", "deceleration", "jerk", "free"},
}
"""The attributes of their elements."""


def _unknown(file: LintedFile) -> Iterator[Spot]:
    if file.root is None or file.dialect != "urdf":
        return
    for element in xml.children(file.root):
        if (spot := _spot(element, ROBOT, "robot")) is not None:
            yield spot
            continue
        tag = str(element.tag)
        for child in xml.children(element) if tag in WITHIN else ():
            if (spot := _spot(child, WITHIN[tag], _name_of(element))) is not None:
                yield spot
            yield from _attributes(child, element)
            for origin in child.findall("origin") if child.tag in _ENDS else ():
                yield from _attributes(origin, element)


def _spot(element: xml.Element, known: Iterable[str], where: str) -> Spot | None:
    """What is said of an element that is none of the ``known`` ones; those with a prefix are another program's."""
    tag = str(element.tag)
    if tag in known or "}" in tag or ":" in tag:
        return None
    near = _near(tag, known)
    return Spot(xml.line(element), f"<{tag}> in {where}{f', nearly <{near}>' if near else ''}",
                advice=f"write <{near}>" if near else None, severity="warning" if near else None)


def _attributes(element: xml.Element, owner: xml.Element) -> Iterator[Spot]:
    known = ATTRIBUTES.get(str(element.tag))
    for name in () if known is None else map(str, element.attrib):
        if known is not None and name not in known and "}" not in name and ":" not in name:
            near = _near(name, known)
            yield Spot(xml.line(element), f"attribute {name!r} of <{element.tag}> in {_name_of(owner)}"
                       f"{f', nearly {near!r}' if near else ''}", advice=f"write {near}" if near else None,
                       severity="warning" if near else None)


def _near(name: str, known: Iterable[str]) -> str | None:
    """The known name that was perhaps meant."""
    whole = {each.casefold(): each for each in known}
    found = difflib.get_close_matches(name.casefold(), whole, n=1, cutoff=LIKE_A_WORD)
    return whole[found[0]] if found else None


def _name_of(element: xml.Element) -> str:
    return str(element.tag) if element.get("name") is None else f"{element.tag} {element.get('name')!r}"


def _legs(file: LintedFile) -> Iterator[Spot]:
    robot = file.mechanism
    if file.refusal is not None or robot is None or not robot.observations:
        return
    try:
        decompose(normal_form(robot).mechanism)
    except BadRobotFile as error:
        for line, text in defects_of(error):
            yield Spot(line, text)
    except HrsynthError:  # told by other rules, or by the questions that need legs
        return


RULES = (
    LintRule("element-unknown", "note", "an element or attribute that URDF does not know",
             "Readers ignore it silently, and use the default instead of what it was meant to say: an axis along x, no "
             "motor, no limit.",
             "nothing, if another program reads it", _unknown),
    LintRule("observe-legs", "error", "observed directions that contradict the robot's legs",
             "A link that is in no leg, one label for two legs, two labels for one: the file is read, but commands "
             "that watch legs refuse it.",
             "correct the link or label named in the message", _legs),
)
