"""Elements of robot files read one by one: what is wrong with them is collected, with its line."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from ..errors import Defect
from ..geometry.vectors import Array, unit
from ..mechanism.model import JointType, Limits
from . import numerals, xml
from .draft import ORIGIN

_LIMITS = ("lower", "upper", "velocity", "effort")


@dataclass
class Elements:
    """A document and its defects; every reader of an XML dialect is one."""

    file: str
    root: xml.Element
    defects: list[Defect] = field(default_factory=list)

    def defect(self, line: int | None, what: str, value: str | None = None, allowed: str | None = None) -> None:
        if value is not None and len(value) > 80:
            value = value[:77] + "..."
        file = line.file if isinstance(line, xml.Line) else self.file
        self.defects.append(Defect(file, line, what, value, allowed))

    def attribute(self, element: xml.Element, name: str) -> str | None:
        """An attribute that must be there and not be empty."""
        value = element.get(name)
        if value is None or not value.strip():
            self.defect(xml.line(element), f"<{element.tag}> without {name}")
            return None
        return value

    def numbers(self, element: xml.Element, name: str, default: Iterable[float]) -> Array:
        """The numbers of an attribute, the default where it is not there or not right."""
        fallback = np.array(list(default), dtype=float)
        text = element.get(name)
        if text is None:
            return fallback
        try:
            return numerals.parsed(text, len(fallback))
        except ValueError as error:
            self.defect(xml.line(element), f"{name} of <{element.tag}>", text, str(error))
            return fallback

    def only(self, element: xml.Element, tag: str) -> xml.Element | None:
        """The child element of that name; a second one is a defect."""
        found = element.findall(tag)
        for extra in found[1:]:
            self.defect(xml.line(extra), f"second <{tag}> in <{element.tag}>", element.get("name"))
        return found[0] if found else None

    def origin(self, element: xml.Element) -> Array:
        origin = self.only(element, "origin")
        if origin is None:
            return ORIGIN
        return numerals.from_origin(self.numbers(origin, "xyz", (0, 0, 0)), self.numbers(origin, "rpy", (0, 0, 0)))

    def axes(self, element: xml.Element, type_: JointType | None) -> tuple[Array, ...]:
        """The axes that the type needs, unit vectors; axes of types that need none are not looked at."""
        axes = []
        for tag in ("axis", "axis2")[:0 if type_ is None else type_.axes]:
            axis = self.only(element, tag)
            if axis is None and tag == "axis2":
                self.defect(xml.line(element), "universal loop without <axis2>", element.get("name"))
            axes.append(np.array([1.0, 0.0, 0.0]) if axis is None else self.direction(axis, "xyz", (1, 0, 0)))
        return tuple(axes)

    def direction(self, element: xml.Element, name: str, default: Iterable[float]) -> Array:
        """A unit vector; a zero vector is a defect."""
        values = self.numbers(element, name, default)
        if not np.linalg.norm(values) > 1e-9:
            self.defect(xml.line(element), f"{name} of <{element.tag}>", element.get(name), "a non-zero vector")
            return np.array([1.0, 0.0, 0.0])
        return unit(values)

    def limits(self, element: xml.Element, kind: str | None) -> Limits | None:
        limit = self.only(element, "limit")
        if limit is None:
            return None
        free = limit.get("free", "").split()
        values: dict[str, float] = {}
        for key in _LIMITS:
            if limit.get(key) is not None and key not in free:
                values[key] = float(self.numbers(limit, key, (0,))[0])
        for key in ("velocity", "effort"):
            if values.get(key, 0.0) < 0:
                self.defect(xml.line(limit), f"{key} of <limit>", limit.get(key), "no negative number")
        if kind == "continuous":
            values.pop("lower", None)
            values.pop("upper", None)
        elif element.tag == "joint" and kind in ("revolute", "prismatic") and {"lower", "upper"} & set(values):
            for key in ("lower", "upper"):
                if key not in free:
                    values.setdefault(key, 0.0)
        if values.get("lower", -np.inf) > values.get("upper", np.inf):
            self.defect(xml.line(limit), "lower limit", f"{values['lower']:g}", f"up to {values['upper']:g}")
        return Limits(**values) if values else None
