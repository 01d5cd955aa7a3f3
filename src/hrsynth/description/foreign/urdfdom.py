"""``<constraint name type>`` as proposed for urdfdom: parent and child, each with an origin and an axis of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...geometry.vectors import Array, frozen, perpendicular, pose
from ...mechanism.model import JointType
from .. import numerals, xml
from ..draft import Edge, End
from ..urdf import LOOP_TYPES
from .graph import Graph

if TYPE_CHECKING:
    from .urdf import Reader

TYPES = {**LOOP_TYPES, "ball": JointType.SPHERICAL, "weld": JointType.FIXED, "point": JointType.SPHERICAL}

_Z = np.array([0.0, 0.0, 1.0])
_SIDES = ("parent", "child")


def read(reader: Reader, graph: Graph) -> None:
    """Add all ``<constraint>`` elements to the graph."""
    for element in reader.root.findall("constraint"):
        name, kind = reader.attribute(element, "name"), TYPES.get(element.get("type", ""))
        if kind is None:
            reader.defect(xml.line(element), "unknown constraint type", element.get("type"), ", ".join(TYPES))
            continue
        ends = [_end(reader, element, side, kind) for side in _SIDES]
        if None in (ends[0].link, ends[1].link):
            reader.defect(xml.line(element), "constraint without two links", name)
            continue
        if name is None or not all(reader.known(end.link, end.line, "constraint: unknown link") for end in ends):
            continue
        if ends[0].link == ends[1].link:
            reader.defect(xml.line(element), "constraint joins a link to itself", ends[0].link)
            continue
        title = graph.fresh(name)
        axes = (_Z,) * kind.axes if kind.axes < 2 else tuple(_axis(reader, element, side) for side in _SIDES)
        graph.edges[title] = Edge(title, kind, (ends[0], ends[1]), axes, None, (), xml.line(element),
                                  reader.motors.get(name), False)


def _end(reader: Reader, element: xml.Element, side: str, kind: JointType) -> End:
    """The joint's frame on one link, its z axis along the axis that the element gives for it."""
    link = element.find(side)
    name = element.get(side) if link is None else link.get("link", link.text)
    X = _origin(reader, element, link, side)
    if kind.axes == 1:
        z = _axis(reader, element, side)
        x = perpendicular(z)
        X = X @ pose(rotation=np.column_stack((x, np.cross(z, x), z)))
    return End(None if name is None else name.strip(), frozen(X), xml.line(element))


def _axis(reader: Reader, element: xml.Element, side: str) -> Array:
    """The axis in the frame of one side: its own, else the common one, else x."""
    own = element.find(f"{side}_axis")
    axis = element.find("axis") if own is None else own
    return np.array([1.0, 0.0, 0.0]) if axis is None else reader.direction(axis, "xyz", (1, 0, 0))


def _origin(reader: Reader, element: xml.Element, link: xml.Element | None, side: str) -> Array:
    origin = element.find(f"{side}_origin")
    if origin is None and link is not None:
        origin = link.find("origin")
    if origin is None:
        return np.eye(4)
    return numerals.from_origin(reader.numbers(origin, "xyz", (0, 0, 0)), reader.numbers(origin, "rpy", (0, 0, 0)))
