"""``<loop_joint name type>`` of Isaac Sim: two ends with ``xyz`` and ``rpy`` (real files write two ``<link1>``)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .. import numerals, xml
from ..draft import Edge, End
from ..urdf import LOOP_TYPES
from .graph import Graph

if TYPE_CHECKING:
    from .urdf import Reader


def read(reader: Reader, graph: Graph) -> None:
    """Add all ``<loop_joint>`` elements to the graph."""
    for element in reader.root.findall("loop_joint"):
        name = reader.attribute(element, "name")
        kind = LOOP_TYPES.get(element.get("type", "spherical"))
        if kind is None or kind.axes > 1:
            reader.defect(xml.line(element), "unknown loop_joint type", element.get("type"),
                          ", ".join(key for key in LOOP_TYPES if key != "universal"))
            continue
        found = [child for child in xml.children(element) if child.tag in ("link1", "link2", "link")]
        if len(found) != 2:
            reader.defect(xml.line(element), "loop_joint: number of links", str(len(found)), "2")
            continue
        ends = []
        for child in found:
            X = numerals.from_origin(reader.numbers(child, "xyz", (0, 0, 0)), reader.numbers(child, "rpy", (0, 0, 0)))
            ends.append(End(reader.attribute(child, "link"), X, xml.line(child)))
        if name is None or not all(reader.known(end.link, end.line, "loop_joint: unknown link") for end in ends):
            continue
        if ends[0].link == ends[1].link:
            reader.defect(xml.line(element), "loop_joint joins a link to itself", ends[0].link)
            continue
        axis = element.find("axis")
        z = np.array([0.0, 0.0, 1.0]) if axis is None else reader.direction(axis, "xyz", (0, 0, 1))
        title = graph.fresh(name)
        graph.edges[title] = Edge(title, kind, (ends[0], ends[1]), (z,) * kind.axes, None, (), xml.line(element),
                                  reader.motors.get(name), False)
