"""Shared attributes of a model: includes, default classes, the conventions of ``<compiler>``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from ....budgets import INCLUDED_FILES_MAX, ROBOT_FILE_MAX_BYTES
from ....errors import BadRobotFile
from ....geometry.vectors import Array, build_pose, rotate_about_axis
from ... import xml
from ...elements import XmlReader
from ...jointgraph import join_names

Layer: TypeAlias = dict[str, dict[str, str]]
"""Attributes that a class adds, by kind of element."""


class Defaults:
    """Attributes that each class gives to each kind of element; classes are nested and inherit."""

    def __init__(self, reader: XmlReader) -> None:
        self.reader = reader
        self.classes: dict[str, tuple[Layer, ...]] = {"main": ()}
        self._own: dict[str, Layer] = {}
        self._given: dict[tuple[str, str], dict[str, str]] = {}
        for element in reader.root.findall("default"):
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

    @classmethod
    def of(cls, reader: XmlReader) -> Compiler:
        """Return the conventions of a document; the last one of each counts."""
        found = cls(reader)
        for element in reader.root.findall("compiler"):
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


def expand_includes(root: xml.Element, file: str) -> xml.Element:
    """Return the document with every ``<include>`` replaced by the content of its file; only files in the folder of the
    main one and below it are read, none twice. Raises ``BadRobotFile``."""
    folder = Path(file).resolve().parent
    read = {Path(file).resolve()}
    size = 0
    while (element := next(root.iter("include"), None)) is not None:
        name = element.get("file") or ""

        def refuse(what: str, allowed: str, at: xml.Element = element, value: str = name) -> BadRobotFile:
            return xml.make_file_error(at.base or file, what, allowed, value=value, line=xml.get_line(at))

        try:
            path = (folder / name).resolve()
        except (OSError, ValueError):
            raise refuse("<include>: not a file", "a file in the model's folder") from None
        if not name or not path.is_relative_to(folder):
            raise refuse("<include>: outside of the model's folder", "a file in the model's folder")
        if path in read or len(read) > INCLUDED_FILES_MAX:
            raise refuse("<include>: repeated file, or too many files", f"each once, up to {INCLUDED_FILES_MAX}")
        read.add(path)
        try:
            content = xml.read_bytes(path)
        except BadRobotFile as error:
            raise refuse(f"<include>: {error.defects[0].problem}", "a file in the model's folder") from None
        size += len(content)
        if size > ROBOT_FILE_MAX_BYTES:
            raise refuse("<include>: files too large", f"up to {ROBOT_FILE_MAX_BYTES} bytes together")
        parent, included = element.getparent(), xml.parse_document(content, str(path))
        if parent is None:
            raise refuse("<include> in place of the model", "<mujoco>")
        place = parent.index(element)
        parent.remove(element)
        for child in reversed(xml.list_children(included)):
            child.base = str(path)
            parent.insert(place, child)
    return root
