"""Joint graph from a URDF file and the YAML file next to it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ....errors import BadRobotFile, Defect
from ....geometry.vectors import Array
from ....mechanism.model import JointType, Motor, Note
from ... import xml
from ...chains import CUT, END, WELD
from ...file_format import RobotFile
from ...jointgraph import FrameSpec, JointGraph
from ...vocabulary import find_misspelt
from ..urdf.read import read as read_urdf
from .settings import KEYS, collect_frame_names, find_settings, find_urdf, read_settings

TYPES = {
    "SPHERICAL": JointType.SPHERICAL,
    "FIXED": JointType.FIXED,
    "UJOINT": JointType.UNIVERSAL,
    "UNIVERSAL": JointType.UNIVERSAL,
    "REVOLUTE": JointType.REVOLUTE,
    "PRISMATIC": JointType.PRISMATIC,
    "CYLINDRICAL": JointType.CYLINDRICAL,
    "FREEFLYER": JointType.FREE,
}

GEPETTO_NAME_CHARACTERS_MAX = 200


def read(file: RobotFile) -> JointGraph:
    """Return the joint graph of either of the two files."""
    found = find_settings(file)
    beside, settings = (file.path, read_settings(file.path)) if found is None else found
    path = find_urdf(file.path, collect_frame_names(settings or {})) if found is None else file.path
    if settings is None:
        raise xml.make_file_error(beside, "none of the keys of the Gepetto format", ", ".join(KEYS))
    if not file.as_spelt:
        _require_spelling(beside, settings)
    notes: list[Note] = []
    root = xml.parse_document(xml.read_bytes(path), str(path), notes) if file.root is None else file.root
    graph = read_urdf(replace(file, path=path, root=root), frames=not settings.get("closed_loop"))
    graph.dialect = "Gepetto"
    graph.notes[:0] = notes
    if beside.stem != path.stem:
        graph.note(
            "assumption", f"closures and motors are from {beside.name}, next to {path.name}: it names its frames"
        )
    return _Settings(graph, beside, settings).apply()


def _require_spelling(path: Path, said: dict[str, Any]) -> None:
    """Raise ``BadRobotFile`` for keys that are misspellings of missing ones."""
    lines = xml.read_bytes(path).decode("utf-8").splitlines()
    wrong = []
    for key in (str(key) for key in said if key not in KEYS):
        if meant := find_misspelt(key, set(KEYS) - set(said)):
            line = next((number for number, text in enumerate(lines, 1) if text.strip("'\"").startswith(key)), None)
            wrong.append(Defect(str(path), line, "unknown key", key, " or ".join(meant)))
    if wrong:
        raise BadRobotFile(wrong)


class _Settings:
    """Lists of names of the YAML file, each checked where it is used."""

    def __init__(self, graph: JointGraph, path: Path, said: dict[str, Any]) -> None:
        self.graph, self.path, self.said = graph, path, said

    def apply(self) -> JointGraph:
        """Return the graph with other joint types, closures and motors."""
        self._types()
        self._closures()
        self._motors()
        return self.graph

    def _list(self, key: str) -> list[Any]:
        value = self.said.get(key)
        if value is None:
            return []
        if not isinstance(value, list):
            raise xml.make_file_error(self.path, f"{key}: not a list", "a list")
        return value

    def _name(self, key: str, value: object) -> str:
        if not isinstance(value, str) or len(value) > GEPETTO_NAME_CHARACTERS_MAX:
            raise xml.make_file_error(self.path, f"{key}: {str(value)[:60]!r} is not a name", "names")
        return value

    def _types(self) -> None:
        names, kinds = self._list("joint_name"), self._list("joint_type")
        if len(names) != len(kinds):
            raise xml.make_file_error(self.path, "joint_name and joint_type differ in length", None)
        for raw, kind in zip(names, kinds, strict=True):
            name = self._name("joint_name", raw)
            joint = self.graph.joints.get(name)
            found = _parse_joint_type(self._name("joint_type", kind))
            if joint is None or found is None:
                raise xml.make_file_error(
                    self.path,
                    f"joint_name {name!r} with joint_type {str(kind)[:40]!r}",
                    "a joint of the URDF; SPHERICAL, FIXED, UJOINT_XY, REVOLUTE_X, PRISMATIC_X …",
                )
            self.graph.joints[name] = replace(joint, type=found[0], axes=found[1], limits=None)

    def _closures(self) -> None:
        pairs, kinds = self._list("closed_loop"), self._list("type")
        if pairs and all(isinstance(each, str) for each in pairs):
            if len(pairs) % 2:
                raise xml.make_file_error(self.path, "closed_loop: not pairs of frames", "[[frame, frame], …]")
            pairs = [pairs[i : i + 2] for i in range(0, len(pairs), 2)]
        words = self._kinds(kinds, len(pairs))
        for number, pair in enumerate(pairs):
            if not isinstance(pair, list) or len(pair) != 2:
                raise xml.make_file_error(self.path, "closed_loop: not pairs of frames", "[[frame, frame], …]")
            links = [self._link(self._name("closed_loop", name)) for name in pair]
            if links[0] == links[1]:
                raise xml.make_file_error(
                    self.path, f"closed_loop: {pair[0]!r} and {pair[1]!r} are on the same link", "two links"
                )
            point = words[number] == "3d"
            stems = [str(frame).removesuffix(suffix) for frame, suffix in zip(pair, (CUT, END), strict=True)]
            name = self.graph.fresh(
                f"loop_{number + 1}"
                if stems[0] != stems[1]
                else stems[0]
                if point or stems[0] not in self.graph.joints
                else stems[0] + WELD
            )
            kind = JointType.SPHERICAL if point else JointType.FIXED
            self.graph.close(name, kind, (FrameSpec(links[0]), FrameSpec(links[1])))
            if words[number] not in ("3d", "6d"):
                given = "without a type" if words[number] is None else f"of type {words[number]!r}"
                self.graph.note("assumption", f"closure {name!r} {given} is read as rigid (6d; a point is 3d)")

    def _kinds(self, kinds: list[Any], count: int) -> list[str | None]:
        """Return the closures' types in small letters, None if absent: this format reads all but ``3d`` as 6d."""
        if len(kinds) > count:
            raise xml.make_file_error(self.path, f"type: {len(kinds)} types for {count} closures", "at most one each")
        words = [self._name("type", kind).lower() for kind in kinds]
        if wrong := [word for word in words if not any(map(str.isalpha, word))]:
            raise xml.make_file_error(self.path, f"type: unknown type {wrong[0]!r}", "3d, 6d")
        return [*words, *[None] * (count - len(words))]

    def _link(self, frame: str) -> str:
        """Return the link of a frame: the link of that name, or the child of the joint of that name."""
        if frame in self.graph.links:
            return frame
        if frame in self.graph.joints:
            return self.graph.joints[frame].links[1]
        raise xml.make_file_error(self.path, f"closed_loop: unknown frame {frame!r}", "links and joints of the URDF")

    def _motors(self) -> None:
        joints = self.graph.joints
        wanted = [self._name("name_mot", name) for name in self._list("name_mot")]
        if "name_mot" not in self.said:
            wanted = [name for name, joint in joints.items() if "mot" in name and joint.type is not JointType.FIXED]
            if wanted:
                self.graph.note(
                    "assumption",
                    "the motors are " + ", ".join(wanted) + ": their names contain 'mot', the "
                    "convention of this format (--motors changes them)",
                )
        for name in wanted:
            if name not in joints or joints[name].type is JointType.FIXED:
                raise xml.make_file_error(self.path, f"name_mot: no movable joint {name!r}", "joints of the URDF")
            joints[name] = replace(joints[name], motor=joints[name].motor or Motor(name))


def _parse_joint_type(name: str) -> tuple[JointType, tuple[Array, ...]] | None:
    """Return the joint type of a name of this format, with its axes."""
    stem, _, letters = name.upper().partition("_")
    axes = tuple(np.eye(3)["XYZ".index(letter)] for letter in letters if letter in "XYZ")
    kind = TYPES.get(stem)
    if kind is None or len(axes) != len(letters) or (kind is JointType.UNIVERSAL and len(set(letters)) != 2):
        return None
    return (kind, axes[: kind.axes]) if len(axes) >= kind.axes else None
