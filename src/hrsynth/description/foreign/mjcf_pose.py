"""Poses in MJCF: quaternions, axis and angle, axes, Euler angles, in the units and the sequence of ``<compiler>``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.vectors import Array, pose, rotation_about, unit
from .. import xml
from ..elements import Elements
from .sdf_joint import rotation_of


@dataclass(frozen=True)
class Compiler:
    """What ``<compiler>`` says of angles."""

    degrees: bool = True
    sequence: str = "xyz"

    @classmethod
    def of(cls, reader: Elements, root: xml.Element) -> Compiler:
        """The settings of a document; the last one of each counts."""
        found = cls()
        for element in root.findall("compiler"):
            unit_, sequence = element.get("angle"), element.get("eulerseq", found.sequence)
            if unit_ not in (None, "degree", "radian"):
                reader.defect(xml.line(element), "angle of <compiler>", unit_, "degree or radian")
            if len(sequence) != 3 or set(sequence.lower()) - set("xyz"):
                reader.defect(xml.line(element), "eulerseq of <compiler>", sequence, "three of x, y, z, X, Y, Z")
                sequence = "xyz"
            if element.get("coordinate", "local") != "local":
                reader.defect(xml.line(element), "coordinate of <compiler>", element.get("coordinate"), "local")
            found = cls(found.degrees if unit_ is None else unit_ == "degree", sequence)
        return found

    def angle(self, value: float) -> float:
        """An angle in radians."""
        return float(np.radians(value)) if self.degrees else float(value)

    def pose(self, reader: Elements, element: xml.Element) -> Array:
        """The pose (4, 4) of an element with ``pos`` and one of the ways to give an orientation."""
        return pose(reader.numbers(element, "pos", (0, 0, 0)), self._orientation(reader, element))

    def rotation(self, reader: Elements, element: xml.Element, quaternion: Array) -> Array:
        """The rotation of a quaternion w x y z."""
        return rotation_of(reader, element, quaternion)

    def _orientation(self, reader: Elements, element: xml.Element) -> Array | None:
        if element.get("quat") is not None:
            return rotation_of(reader, element, reader.numbers(element, "quat", (1, 0, 0, 0)))
        if element.get("axisangle") is not None:
            values = reader.numbers(element, "axisangle", (0, 0, 1, 0))
            return rotation_about(self._direction(reader, element, values[:3]), self.angle(values[3]))
        if element.get("xyaxes") is not None:
            values = reader.numbers(element, "xyaxes", (1, 0, 0, 0, 1, 0))
            x = self._direction(reader, element, values[:3])
            y = self._direction(reader, element, values[3:] - x * float(x @ values[3:]))
            return np.column_stack((x, y, np.cross(x, y)))
        if element.get("zaxis") is not None:
            z = self._direction(reader, element, reader.numbers(element, "zaxis", (0, 0, 1)))
            return _least_turn(z)
        if element.get("euler") is not None:
            return self._euler([self.angle(v) for v in reader.numbers(element, "euler", (0, 0, 0))])
        return None

    @staticmethod
    def _direction(reader: Elements, element: xml.Element, values: Array) -> Array:
        if np.linalg.norm(values) > 1e-9:
            return unit(values)
        reader.defect(xml.line(element), "a direction of length zero", None, "a non-zero vector")
        return np.array([0.0, 0.0, 1.0])

    def _euler(self, angles: list[float]) -> Array:
        """Lower case turns about the axes as they have become, upper case about the fixed ones."""
        R = np.eye(3)
        for letter, angle in zip(self.sequence, angles, strict=True):
            turn = rotation_about(np.eye(3)["xyz".index(letter.lower())], angle)
            R = R @ turn if letter.islower() else turn @ R
        return R


def _least_turn(z: Array) -> Array:
    """The smallest rotation that takes the z axis to ``z``."""
    axis = np.cross([0.0, 0.0, 1.0], z)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.eye(3) if z[2] > 0 else rotation_about((1, 0, 0), np.pi)
    return rotation_about(axis, float(np.arctan2(sine, z[2])))
