"""Shared attributes of a model: includes, default classes, the conventions of ``<compiler>``."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from ....geometry.vectors import Array, build_pose, rotate_about_axis
from ... import xml
from ...elements import XmlReader
from ...jointgraph import join_names
from .expand import COPY

Layer: TypeAlias = dict[str, dict[str, str]]
"""Attributes that a class adds, by kind of element."""


class Defaults:
    """Attributes that each class gives to each kind of element; classes are nested and inherit."""

    def __init__(self, reader: XmlReader, root: xml.Element) -> None:
        self.reader = reader
        self.classes: dict[str, tuple[Layer, ...]] = {"main": ()}
        self._own: dict[str, Layer] = {}
        self._given: dict[tuple[str, str], dict[str, str]] = {}
        for element in root.findall("default"):
            self._read(element, (), "main")

    def _read(self, element: xml.Element, inherited: tuple[Layer, ...], name: str) -> None:
        own = self._own.setdefault(name, {})
        for child in xml.list_children(element):
            if child.tag != "default":
                own.setdefault(child.tag, {}).update(_collect_attributes(child))
        self.classes[name] = inherited if any(layer is own for layer in inherited) else (*inherited, own)
        for child in element.findall("default"):
            inner = child.get("class")
            if inner is None:
                self.reader.defect(xml.get_line(child), "<default> without class")
            else:
                self._read(child, self.classes[name], inner)

    def _of_class(self, name: str, tag: str) -> dict[str, str]:
        """Return the attributes that a class gives to a kind of element, inherited ones first."""
        if (name, tag) not in self._given:
            found = self._given[name, tag] = {}
            for layer in self.classes[name]:
                found.update(layer.get(tag, {}))
        return self._given[name, tag]

    def of(self, element: xml.Element, childclass: str | None, tag: str | None = None) -> dict[str, str]:
        """Return the attributes of an element with those of its class, its own first."""
        name = element.get("class") or childclass or "main"
        if name not in self.classes:
            self.reader.defect(
                xml.get_line(element), "unknown default class", name, join_names(self.classes, like=name)
            )
            name = "main"
        return {**self._of_class(name, tag or str(element.tag)), **_collect_attributes(element)}


def _collect_attributes(element: xml.Element) -> dict[str, str]:
    return {str(key): str(value) for key, value in element.attrib.items()}


@dataclass(frozen=True)
class Compiler:
    """Angle conventions of ``<compiler>``, and the poses of elements by them."""

    reader: XmlReader
    degrees: bool = True
    sequence: str = "xyz"
    copies: dict[tuple[str | None, ...], list[Array]] = field(default_factory=dict)
    """Positions of copies by their displacement."""

    @classmethod
    def of(cls, reader: XmlReader, root: xml.Element) -> Compiler:
        """Return the conventions of a document; the last one of each counts."""
        found = cls(reader)
        for element in root.findall("compiler"):
            unit, sequence = element.get("angle"), element.get("eulerseq", found.sequence)
            if unit not in (None, "degree", "radian"):
                reader.defect(xml.get_line(element), "angle of <compiler>", unit, "degree or radian")
            if len(sequence) != 3 or set(sequence.lower()) - set("xyz"):
                reader.defect(xml.get_line(element), "eulerseq of <compiler>", sequence, "three of x, y, z, X, Y, Z")
                sequence = "xyz"
            if element.get("coordinate", "local") != "local":
                reader.defect(xml.get_line(element), "coordinate of <compiler>", element.get("coordinate"), "local")
            found = cls(reader, found.degrees if unit is None else unit == "degree", sequence)
        return found

    def angle(self, value: float) -> float:
        """Return an angle in radians."""
        return float(np.radians(value)) if self.degrees else float(value)

    def pose(self, element: xml.Element) -> Array:
        """Return the pose (4, 4) of an element with ``pos`` and any form of orientation."""
        return build_pose(self.reader.numbers(element, "pos", (0, 0, 0)), self._orientation(element))

    def frame(self, element: xml.Element) -> Array:
        """Return the pose (4, 4) of a frame; that of a copy is turned as often, and displaced from the one before."""
        if (number := element.get(COPY)) is None:
            return self.pose(element)
        offset, euler = (self.reader.numbers(element, key, (0, 0, 0)) for key in ("pos", "euler"))
        angles = [self.angle(value) for value in euler]
        before = self.copies.setdefault((element.get("pos"), element.get("euler")), [np.zeros(3)])
        while len(before) <= int(number):
            before.append(before[-1] + self._euler([(len(before) - 1) * angle for angle in angles]) @ offset)
        return build_pose(before[int(number)], self._euler([int(number) * angle for angle in angles]))

    def _orientation(self, element: xml.Element) -> Array | None:
        reader = self.reader
        if element.get("quat") is not None:
            return reader.rotation(element, reader.numbers(element, "quat", (1, 0, 0, 0)))
        if element.get("axisangle") is not None:
            values = reader.numbers(element, "axisangle", (0, 0, 1, 0))
            return rotate_about_axis(self._direction(element, values[:3]), self.angle(values[3]))
        if element.get("xyaxes") is not None:
            values = reader.numbers(element, "xyaxes", (1, 0, 0, 0, 1, 0))
            x = self._direction(element, values[:3])
            y = self._direction(element, values[3:] - x * float(x @ values[3:]))
            return np.column_stack((x, y, np.cross(x, y)))
        if element.get("zaxis") is not None:
            return _find_least_rotation(self._direction(element, reader.numbers(element, "zaxis", (0, 0, 1))))
        if element.get("euler") is not None:
            return self._euler([self.angle(v) for v in reader.numbers(element, "euler", (0, 0, 0))])
        return None

    def _direction(self, element: xml.Element, values: Array) -> Array:
        return self.reader.unit(values, xml.get_line(element), "a direction of length zero")

    def _euler(self, angles: list[float]) -> Array:
        """Return a rotation: lower case about the rotated axes, upper case about the fixed ones."""
        R = np.eye(3)
        for letter, angle in zip(self.sequence, angles, strict=True):
            turn = rotate_about_axis(np.eye(3)["xyz".index(letter.lower())], angle)
            R = R @ turn if letter.islower() else turn @ R
        return R


def _find_least_rotation(z: Array) -> Array:
    """Return the smallest rotation that takes the z axis to ``z``."""
    axis = np.cross([0.0, 0.0, 1.0], z)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.eye(3) if z[2] > 0 else rotate_about_axis((1, 0, 0), np.pi)
    return rotate_about_axis(axis, float(np.arctan2(sine, z[2])))
