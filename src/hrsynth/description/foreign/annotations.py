"""What our writers add to foreign files, and reading takes back: platform, camera, observed directions, the base."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING
from urllib.parse import quote, unquote

import numpy as np

from ...geometry.vectors import frozen, inverse
from ...mechanism.model import JointType, Motor
from ...mechanism.observation import Direction
from .. import numerals, xml
from ..draft import Edge, End
from .graph import Graph

if TYPE_CHECKING:
    from .sdf import Reader

NAMESPACE = "urn:hrsynth"
PREFIX = "hrsynth"


def world_dropped(graph: Graph) -> Graph:
    """The graph, based on the one link that a fixed joint holds in the world where nothing else hangs on the world, or
    only free joints do, which then hang on that link."""
    at_world = [edge for edge in graph.edges.values() if graph.base in edge.links]
    welds = [edge for edge in at_world if edge.type is JointType.FIXED]
    floating = [edge for edge in at_world if edge.type is JointType.FREE]
    if graph.base is None or len(welds) != 1 or len(at_world) != 1 + len(floating) or len(graph.links) <= 2:
        return graph
    weld, world = welds[0], graph.base
    del graph.edges[weld.name], graph.links[world]
    here = weld.links.index(world)
    graph.base = weld.links[1 - here]
    X_BW = weld.ends[1 - here].X @ inverse(weld.ends[here].X)
    for edge in floating:
        ends = [End(graph.base, frozen(X_BW @ end.X), end.line) if end.link == world else end for end in edge.ends]
        graph.edges[edge.name] = replace(edge, ends=(ends[0], ends[1]))
    return graph


def apply(graph: Graph, key: str, text: str) -> str | None:
    """Take back one saying; what is wrong with it, or None."""
    words = [unquote(word) for word in text.split()]
    if key in ("platform", "camera") and len(words) == 1:
        if words[0] not in graph.links:
            return f"{key}: unknown link"
        setattr(graph, key, words[0])
    elif key == "motor" and len(words) == 2:
        edge = graph.edges.get(words[1])
        if edge is None:
            return "motor of an unknown joint"
        graph.edges[words[1]] = Edge(edge.name, edge.type, edge.ends, edge.axes, edge.limits, edge.xml, edge.line,
                                     Motor(words[0]), edge.in_tree)
    elif key == "observe" and len(words) == 5:
        if words[1] not in graph.links:
            return "observe: unknown link"
        try:
            direction = numerals.parsed(" ".join(words[2:]), 3)
        except ValueError as error:
            return str(error)
        if not np.linalg.norm(direction) > 1e-9:
            return "observe: a zero direction"
        graph.observations.append(Direction(words[0], words[1], direction))
    else:
        return "unknown saying"
    return None


def read_sdf(reader: Reader, model: xml.Element, graph: Graph) -> None:
    """The ``hrsynth:…`` elements of a model."""
    for element in xml.children(model):
        if isinstance(element.tag, str) and element.tag.startswith(f"{{{NAMESPACE}}}"):
            wrong = apply(graph, element.tag.split("}")[1], element.text or "")
            if wrong is not None:
                reader.defect(xml.line(element), wrong, element.text)


def sayings(platform: str, camera: str | None, observations: tuple[tuple[str, str, str], ...],
            motors: tuple[tuple[str, str], ...] = ()) -> list[tuple[str, str]]:
    """Key and text of all that is added, in order."""
    found = [("platform", quote(platform))] + ([] if camera is None else [("camera", quote(camera))])
    found += [("motor", f"{quote(motor)} {quote(joint)}") for motor, joint in motors]
    return found + [("observe", f"{quote(leg)} {quote(link)} {axis}") for leg, link, axis in observations]
