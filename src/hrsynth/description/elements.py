"""Elements of robot files, read one by one; their defects are collected with their lines."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field

import numpy as np

from ..errors import BadRobotFile, Defect
from ..geometry.so3 import convert_from_quaternion
from ..geometry.vectors import Array, normalise_vector
from ..mechanism.model import JointType, Limits
from ..tolerances import VECTOR_LENGTH_MIN
from . import numerals, xml
from .jointgraph import ORIGIN, Z

FILE_DEFECTS_MAX = 100
"""Number of defects after which a file is not read further."""

LIMITS = ("lower", "upper", "velocity", "effort")
TURNS: dict[str, bool | None] = {"true": True, "false": False}
"""Values of a platform's ``turns``."""


@dataclass
class FileReader:
    """File and its defects; base of the readers of all texts."""

    file: str
    defects: list[Defect] = field(default_factory=list, kw_only=True)
    digits: numerals.Digits = field(default_factory=numerals.Digits, kw_only=True)

    def defect(self, line: int | None, what: str, value: str | None = None, allowed: str | None = None) -> None:
        """Record a defect in a line of the file (or of an included one). Raises ``BadRobotFile`` at the limit of
        defects."""
        if value is not None and len(value) > 80:
            value = value[:77] + "..."
        file = line.file if isinstance(line, xml.SourceLine) else self.file
        self.defects.append(Defect(file, line, what, value, allowed))
        if len(self.defects) >= FILE_DEFECTS_MAX:
            self.require_sound()

    def require_sound(self) -> None:
        """Raise :class:`BadRobotFile` with all defects found so far, if any."""
        if self.defects:
            raise BadRobotFile(self.defects)

    def values(self, text: str | None, default: Iterable[float], line: int | None, what: str) -> Array:
        """Return the numbers of a text, as many as the default has; the default if the text is absent or wrong."""
        fallback = np.array(list(default), dtype=float)
        if text is None:
            return fallback
        try:
            found = numerals.parse(text, len(fallback))
            self.digits.read(text)
            return found
        except ValueError as error:
            self.defect(line, what, text, str(error))
            return fallback

    def unit(self, values: Array, line: int | None, what: str, given: str | None = None, default: Array = Z) -> Array:
        """Return the unit vector along ``values``; a zero vector is a defect."""
        if (size := float(np.linalg.norm(values))) > VECTOR_LENGTH_MIN:
            self.digits.length(size)
            return normalise_vector(values)
        self.defect(line, what, given, "a non-zero vector")
        return default


@dataclass
class XmlReader(FileReader):
    """Document and its defects; base of the readers of all XML formats."""

    root: xml.Element

    def require_some(self, found: Collection[object], what: str, element: xml.Element) -> None:
        """Record that a file holds no links."""
        if not found:
            self.defect(
                xml.get_line(element),
                f"no {what}",
                None,
                f"{what} and joints; for a file of parts or macros, the file that includes it",
            )

    def attribute(self, element: xml.Element, name: str) -> str | None:
        """Return a required, non-empty attribute."""
        value = element.get(name)
        if value is None or not value.strip():
            self.defect(xml.get_line(element), f"<{element.tag}> without {name}")
            return None
        return value

    def numbers(self, element: xml.Element, name: str, default: Iterable[float]) -> Array:
        """Return the numbers of an attribute."""
        return self.values(element.get(name), default, xml.get_line(element), f"{name} of <{element.tag}>")

    def only(self, element: xml.Element, tag: str) -> xml.Element | None:
        """Return the child element of that name; a second one is a defect."""
        found = element.findall(tag)
        for extra in found[1:]:
            self.defect(xml.get_line(extra), f"second <{tag}> in <{element.tag}>", element.get("name"))
        return found[0] if found else None

    def pose(self, element: xml.Element | None) -> Array:
        """Return the pose (4, 4) of the attributes ``xyz`` and ``rpy``."""
        if element is None:
            return ORIGIN
        angles = self.numbers(element, "rpy", (0, 0, 0))
        self.digits.angles(angles)
        return numerals.compute_origin_pose(self.numbers(element, "xyz", (0, 0, 0)), angles)

    def origin(self, element: xml.Element) -> Array:
        """Return the pose of the ``<origin>`` of an element."""
        return self.pose(self.only(element, "origin"))

    def direction(self, element: xml.Element, name: str, default: Iterable[float]) -> Array:
        """Return the unit vector of an attribute."""
        return self.unit(
            self.numbers(element, name, default),
            xml.get_line(element),
            f"{name} of <{element.tag}>",
            element.get(name),
            np.array([1.0, 0.0, 0.0]),
        )

    def rotation(self, element: xml.Element, quaternion: Array) -> Array:
        """Return the rotation (3, 3) of a quaternion w x y z of any length but zero."""
        size = float(np.linalg.norm(quaternion))
        if not size > VECTOR_LENGTH_MIN:
            self.defect(xml.get_line(element), "a quaternion of length zero")
            return np.eye(3)
        self.digits.length(size)
        return convert_from_quaternion(quaternion / size)

    def axes(self, element: xml.Element, type_: JointType | None) -> tuple[Array, ...]:
        """Return the axes that the type needs, as unit vectors."""
        axes = []
        for tag in ("axis", "axis2")[: 0 if type_ is None else type_.axes]:
            axis = self.only(element, tag)
            if axis is None and tag == "axis2":
                self.defect(xml.get_line(element), "universal loop without <axis2>", element.get("name"))
            axes.append(np.array([1.0, 0.0, 0.0]) if axis is None else self.direction(axis, "xyz", (1, 0, 0)))
        return tuple(axes)


def read_sound_limits(text_of: Callable[[str], str | None], *, bounded: bool = True) -> Limits | None:
    """Return the limits if they are numbers in order, else no limits. ``bounded``: bounds are allowed."""
    values: dict[str, float] = {}
    for key in LIMITS:
        try:
            value = float(numerals.parse(text_of(key) or "", 1)[0])
        except ValueError:
            continue
        if key in ("lower", "upper") or value >= 0:
            values[key] = value
    if not bounded or ("lower" in values and "upper" in values and not values["lower"] < values["upper"]):
        values = {key: value for key, value in values.items() if key not in ("lower", "upper")}
    return Limits(**values) if values else None
