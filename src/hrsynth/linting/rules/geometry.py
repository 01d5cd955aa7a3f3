"""Rounded geometry, and the fix that writes the repaired one."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial

from lxml import etree

from ...description import numerals, xml
from ...description.chains import TIP
from ...geometry.vectors import Array, build_pose, invert_pose
from ...mechanism.model import Joint, Mechanism
from ...mechanism.observations.direction import SeenAxis
from ..findings import Fix, LintRule, RuleHit
from ..linted_file import LintedFile

ROUNDED = re.compile(r"\d+ relations of joints|made to be |the loops are open by up to ")
"""Beginnings of the reader's notes on such relations."""


def _find_rounded(file: LintedFile) -> Iterator[RuleHit]:
    robot = file.mechanism
    for note in () if robot is None else robot.notes:
        if note.kind == "merged" and ROUNDED.match(note.text):
            yield RuleHit(None, note.text, None if robot is None else _repair_geometry(file, robot))


def _repair_geometry(file: LintedFile, robot: Mechanism) -> Fix | None:
    """Return the fix that writes every joint of a URDF where it is read, if each of its joints is one of the robot's
    (or the tip of one) and its zero configuration has not moved."""
    graph = file.said
    if file.dialect != "urdf" or graph is None or any(note.kind == "solved" for note in robot.notes):
        return None
    tips = {given.links[0]: given.links[1] for given in graph.joints.values() if given.name.endswith(TIP)}
    found = []
    for given in graph.joints.values():
        joint = robot.joints.get(given.name.removesuffix(TIP))
        element = file.element(given.line, "joint" if given.in_tree else "loop", name=given.name)
        if element is None or joint is None or joint.in_tree != given.in_tree:
            return None
        one, two = given.links
        if not given.name.endswith(TIP) and joint.links != (one, tips.get(two, two)):
            return None
        found.append((joint, given.links, element))
    seen = [
        (each.direction, element)
        for each in robot.observations
        if isinstance(each, SeenAxis) and (element := file.element(each.line, "observe")) is not None
    ]
    return partial(_write, found, seen, robot) if len(found) == len(robot.joints) + len(tips) else None


def _write(
    joints: list[tuple[Joint, tuple[str, str], xml.Element]], seen: list[tuple[Array, xml.Element]], robot: Mechanism
) -> None:
    for direction, element in seen:
        element.set("axis", numerals.format_exact_vector(direction))
    X = {name: link.pose for name, link in robot.links.items()}
    for joint, (_, two), element in joints:  # the frame of a URDF link is that of the joint that carries it
        if joint.in_tree and element.get("name") == joint.name:
            X[two] = build_pose(joint.point, robot.links[joint.successor].pose[:3, :3])
    for joint, (one, two), element in joints:
        if joint.in_tree:
            _place(element, invert_pose(X[one]) @ X[two])
            axes = [X[two][:3, :3].T @ axis for axis in joint.axes] if element.get("name") == joint.name else []
        else:
            at = build_pose(joint.point, X[one][:3, :3])
            for tag, link in (("predecessor", one), ("successor", two)):
                for child in element.findall(tag):
                    _place(child, invert_pose(X[link]) @ at)
            axes = [X[one][:3, :3].T @ axis for axis in joint.axes]
        for tag, axis in zip(("axis", "axis2"), axes, strict=False):
            for child in element.findall(tag) or [etree.SubElement(element, tag)]:
                child.set("xyz", numerals.format_exact_vector(axis))


def _place(element: xml.Element, X: Array) -> None:
    origin = element.find("origin")
    if origin is None:
        origin = etree.SubElement(element, "origin")
    origin.set("xyz", numerals.format_exact_vector(X[:3, 3]))
    origin.set("rpy", numerals.format_exact_vector(numerals.compute_rounded_rpy(X[:3, :3])))


RULES = (
    LintRule(
        "geometry-rounded",
        "warning",
        "relations that hold up to printed digits",
        "Axes parallel to six digits, rods of almost equal length: over-constrained loops lock or lose rank in "
        "programs that take the digits literally. hrsynth repairs such relations and reports it.",
        "write the numbers with all their digits (in other formats: hrsynth convert IN OUT)",
        _find_rounded,
        fixable=True,
    ),
)
