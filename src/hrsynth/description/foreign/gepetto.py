"""Gepetto's extended URDF: ``robot.urdf`` for the tree, ``robot.yaml`` for closures, motors and joint types."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...budgets import LARGEST_YAML
from ...errors import BadRobotFile, Defect
from ...geometry.vectors import Array
from ...mechanism.model import JointType, Motor
from .. import xml
from ..draft import ORIGIN, Edge, End
from . import urdf
from .closures import CUT, END, WELD
from .graph import Graph

KEYS = ("closed_loop", "type", "name_mot", "joint_name", "joint_type")
_AXES = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}


def sayings(path: Path) -> dict[str, Any] | None:
    """What a YAML file says, None where it is no such file as this dialect has; raises ``BadRobotFile``."""
    import yaml

    data = xml.content(path)
    try:
        if len(data) > LARGEST_YAML:
            raise _refused(path, "YAML file too large", f"up to {LARGEST_YAML} bytes")
        depth = 0
        for count, event in enumerate(yaml.parse(data.decode("utf-8"), Loader=yaml.SafeLoader)):
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if isinstance(event, yaml.AliasEvent) or depth > 6 or count > 20_000:
                raise _refused(path, "YAML with aliases, too deep or too long", "lists of names")
        found = yaml.safe_load(data.decode("utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError, ValueError) as error:
        raise _refused(path, f"not YAML: {' '.join(str(error).split())[:120]}", None) from None
    if not isinstance(found, dict) or not set(KEYS) & set(found):
        return None
    return found


def read(description: Path, settings: Path) -> Graph:
    """The joint graph of a URDF file and the YAML file beside it."""
    said = sayings(settings)
    if said is None:
        raise _refused(settings, "none of the keys of this dialect", ", ".join(KEYS))
    root = xml.document(xml.content(description), str(description))
    graph = urdf.read(root, str(description), frames=not said.get("closed_loop"))
    graph.dialect = "Gepetto"
    return _Sayings(graph, settings, said).applied()


class _Sayings:
    def __init__(self, graph: Graph, path: Path, said: dict[str, Any]) -> None:
        self.graph, self.path, self.said = graph, path, said

    def applied(self) -> Graph:
        """The graph with other joint types, closures and motors."""
        self._types()
        self._closures()
        self._motors()
        return self.graph

    def _list(self, key: str) -> list[Any]:
        value = self.said.get(key)
        if value is None:
            return []
        if not isinstance(value, list):
            raise _refused(self.path, f"{key}: not a list", "a list")
        return value

    def _name(self, key: str, value: object) -> str:
        if not isinstance(value, str):
            raise _refused(self.path, f"{key}: {str(value)[:60]!r} is no name", "names")
        return value

    def _types(self) -> None:
        names, kinds = self._list("joint_name"), self._list("joint_type")
        if len(names) != len(kinds):
            raise _refused(self.path, "joint_name and joint_type are not equally long", None)
        for raw, kind in zip(names, kinds, strict=True):
            name = self._name("joint_name", raw)
            edge = self.graph.edges.get(name)
            found = _type(self._name("joint_type", kind))
            if edge is None or found is None:
                raise _refused(self.path, f"joint_name {name!r} with joint_type {str(kind)[:40]!r}",
                               "a joint of the URDF; SPHERICAL, FIXED, UJOINT_XY, REVOLUTE_X, PRISMATIC_X …")
            self.graph.edges[name] = replace(edge, type=found[0], axes=found[1], limits=None)

    def _closures(self) -> None:
        pairs, kinds = self._list("closed_loop"), self._list("type")
        if pairs and all(isinstance(each, str) for each in pairs):
            if len(pairs) % 2:
                raise _refused(self.path, "closed_loop: not pairs of frames", "[[frame, frame], …]")
            pairs = [pairs[i : i + 2] for i in range(0, len(pairs), 2)]
        words = self._kinds(kinds, len(pairs))
        for number, pair in enumerate(pairs):
            if not isinstance(pair, list) or len(pair) != 2:
                raise _refused(self.path, "closed_loop: not pairs of frames", "[[frame, frame], …]")
            links = [self._link(self._name("closed_loop", name)) for name in pair]
            if links[0] == links[1]:
                raise _refused(self.path, f"closed_loop: {pair[0]!r} and {pair[1]!r} are one link", "two links")
            point = words[number] == "3d"
            stems = [str(frame).removesuffix(suffix) for frame, suffix in zip(pair, (CUT, END), strict=True)]
            name = self.graph.fresh(f"loop_{number + 1}" if stems[0] != stems[1] else stems[0] if point or
                                    stems[0] not in self.graph.edges else stems[0] + WELD)
            kind = JointType.SPHERICAL if point else JointType.FIXED
            self.graph.edges[name] = Edge(name, kind, (End(links[0], ORIGIN), End(links[1], ORIGIN)), in_tree=False)
            if words[number] not in ("3d", "6d"):
                given = "without a type" if words[number] is None else f"of type {words[number]!r}"
                self.graph.note("guess", f"closure {name!r} {given} is read as rigid (6d; a point is 3d)")

    def _kinds(self, kinds: list[Any], count: int) -> list[str | None]:
        """The closures' types in small letters, None where there is none: this dialect takes all but ``3d`` for 6d."""
        if len(kinds) > count:
            raise _refused(self.path, f"type: {len(kinds)} types of {count} closures", "one each")
        words = [self._name("type", kind).lower() for kind in kinds]
        return [*words, *[None] * (count - len(words))]

    def _link(self, frame: str) -> str:
        """A frame is a link's, or that of a joint, which moves with the joint's child."""
        if frame in self.graph.links:
            return frame
        if frame in self.graph.edges:
            return self.graph.edges[frame].links[1]
        raise _refused(self.path, f"closed_loop: no frame {frame!r}", "links and joints of the URDF")

    def _motors(self) -> None:
        edges = self.graph.edges
        wanted = [self._name("name_mot", name) for name in self._list("name_mot")]
        if "name_mot" not in self.said:
            wanted = [name for name, edge in edges.items() if "mot" in name and edge.type is not JointType.FIXED]
            if wanted:
                self.graph.note("guess", "the motors are " + ", ".join(wanted) + ": their names hold 'mot', as this "
                                         "dialect has it (--motors to change them)")
        for name in wanted:
            if name not in edges or edges[name].type is JointType.FIXED:
                raise _refused(self.path, f"name_mot: no joint {name!r} that moves", "joints of the URDF")
            edges[name] = replace(edges[name], motor=edges[name].motor or Motor(name))


def _type(name: str) -> tuple[JointType, tuple[Array, ...]] | None:
    """The joint type that the dialect's name means, with its axes."""
    stem, _, letters = name.upper().partition("_")
    axes = tuple(np.array(_AXES[letter]) for letter in letters if letter in _AXES)
    kinds = {"SPHERICAL": JointType.SPHERICAL, "FIXED": JointType.FIXED, "UJOINT": JointType.UNIVERSAL,
             "UNIVERSAL": JointType.UNIVERSAL, "REVOLUTE": JointType.REVOLUTE, "PRISMATIC": JointType.PRISMATIC,
             "CYLINDRICAL": JointType.CYLINDRICAL, "FREEFLYER": JointType.FREE}
    kind = kinds.get(stem)
    if kind is None or len(axes) != len(letters) or (kind is JointType.UNIVERSAL and len(set(letters)) != 2):
        return None
    return (kind, axes[: kind.axes]) if len(axes) >= kind.axes else None


def _refused(path: Path, what: str, allowed: str | None) -> BadRobotFile:
    return BadRobotFile([Defect(str(path), None, what, None, allowed)])
