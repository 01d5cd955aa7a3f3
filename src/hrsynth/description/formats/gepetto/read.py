"""Joint graph from a URDF file and the YAML file next to it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ....geometry.vectors import Array
from ....mechanism.model import JointType, Motor, Note
from ... import xml
from ...chains import CUT, END, WELD
from ...file_format import RobotFile
from ...jointgraph import FrameSpec, JointGraph
from ...vocabulary import find_misspelt
from ...yaml_file import YamlReader, get_line
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


def read(file: RobotFile) -> JointGraph:
    """Return the joint graph of either of the two files."""
    found = find_settings(file)
    beside, settings = (file.path, read_settings(file.path)) if found is None else found
    path = find_urdf(file.path, collect_frame_names(settings or {})) if found is None else file.path
    if settings is None:
        raise xml.make_file_error(beside, "none of the keys of the Gepetto format", ", ".join(KEYS))
    notes: list[Note] = []
    root = xml.parse_document(xml.read_bytes(path), str(path), notes) if file.root is None else file.root
    graph = read_urdf(replace(file, path=path, root=root), frames=not settings.get("closed_loop"))
    graph.dialect = "Gepetto"
    graph.notes[:0] = notes
    if beside.stem != path.stem:
        graph.note(
            "assumption", f"closures and motors are from {beside.name}, next to {path.name}: it names its frames"
        )
    reader = _SettingsReader(str(beside), graph, settings)
    if not file.as_spelt:
        reader.require_spelling()
    return reader.apply()


@dataclass
class _SettingsReader(YamlReader):
    """Lists of names of the YAML file, each checked where it is used."""

    graph: JointGraph
    said: dict[str, Any]

    def apply(self) -> JointGraph:
        """Return the graph with other joint types, closures and motors. Raises ``BadRobotFile``."""
        self._types()
        self._closures()
        self._motors()
        self.require_sound()
        return self.graph

    def require_spelling(self) -> None:
        """Raise ``BadRobotFile`` for keys that are misspellings of missing ones."""
        for key in self.said:
            if key not in KEYS and (meant := find_misspelt(str(key), set(KEYS) - set(self.said))):
                self.defect(get_line(key), "unknown key", key, " or ".join(meant))
        self.require_sound()

    def _list(self, key: str) -> list[Any]:
        return self.sequence(self.said.get(key), key)

    def _types(self) -> None:
        names, kinds = self._list("joint_name"), self._list("joint_type")
        if len(names) != len(kinds):
            self.defect(get_line(names), "joint_name and joint_type differ in length")
        for raw, kind in zip(names, kinds, strict=False):
            name, word = self.name(raw, "joint_name"), self.name(kind, "joint_type")
            joint, parsed = self.graph.joints.get(name or ""), _parse_joint_type(word or "")
            if joint is not None and parsed is not None:
                self.graph.joints[joint.name] = replace(joint, type=parsed[0], axes=parsed[1], limits=None)
            elif name is not None and word is not None:
                self.defect(
                    get_line(raw),
                    f"joint_name {name!r} with joint_type {word[:40]!r}",
                    None,
                    "a joint of the URDF; SPHERICAL, FIXED, UJOINT_XY, REVOLUTE_X, PRISMATIC_X …",
                )

    def _closures(self) -> None:
        pairs, kinds = self._list("closed_loop"), self._list("type")
        if pairs and all(isinstance(each, str) for each in pairs):
            pairs = [pairs[i : i + 2] for i in range(0, len(pairs), 2)]
        words = self._kinds(kinds, pairs)
        for number, pair in enumerate(pairs):
            if not isinstance(pair, list) or len(pair) != 2:
                self.defect(get_line(pair), "closed_loop: not pairs of frames", None, "[[frame, frame], …]")
                continue
            links = [self._link(frame) for frame in pair]
            if None in links:
                continue
            if links[0] == links[1]:
                what = f"closed_loop: {pair[0]!r} and {pair[1]!r} are on the same link"
                self.defect(get_line(pair), what, None, "two links")
                continue
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

    def _kinds(self, kinds: list[Any], pairs: list[Any]) -> list[str | None]:
        """Return the closures' types in small letters, None if absent: this format reads all but ``3d`` as 6d."""
        if len(kinds) > len(pairs):
            what = f"type: {len(kinds)} types for {len(pairs)} closures"
            self.defect(get_line(kinds), what, None, "at most one each")
        words = [(self.name(kind, "type") or "6d").lower() for kind in kinds[: len(pairs)]]
        for kind, word in zip(kinds, words, strict=False):
            if not any(map(str.isalpha, word)):
                self.defect(get_line(kind), f"type: unknown type {word!r}", None, "3d, 6d")
        return [*words, *[None] * (len(pairs) - len(words))]

    def _link(self, value: Any) -> str | None:
        """Return the link of a frame: the link of that name, or the child of the joint of that name."""
        frame = self.name(value, "closed_loop")
        if frame is None or frame in self.graph.links:
            return frame
        if frame in self.graph.joints:
            return self.graph.joints[frame].links[1]
        self.defect(get_line(value), f"closed_loop: unknown frame {frame!r}", None, "links and joints of the URDF")
        return None

    def _motors(self) -> None:
        joints = self.graph.joints
        wanted: list[Any] = self._list("name_mot")
        if "name_mot" not in self.said:
            wanted = [name for name, joint in joints.items() if "mot" in name and joint.type is not JointType.FIXED]
            if wanted:
                self.graph.note(
                    "assumption",
                    "the motors are " + ", ".join(wanted) + ": their names contain 'mot', the "
                    "convention of this format (--motors changes them)",
                )
        for value in wanted:
            if (name := self.name(value, "name_mot")) is None:
                continue
            if name not in joints or joints[name].type is JointType.FIXED:
                self.defect(get_line(value), f"name_mot: no movable joint {name!r}", None, "joints of the URDF")
                continue
            joints[name] = replace(joints[name], motor=joints[name].motor or Motor(name))


def _parse_joint_type(name: str) -> tuple[JointType, tuple[Array, ...]] | None:
    """Return the joint type of a name of this format, with its axes."""
    stem, _, letters = name.upper().partition("_")
    axes = tuple(np.eye(3)["XYZ".index(letter)] for letter in letters if letter in "XYZ")
    kind = TYPES.get(stem)
    if kind is None or len(axes) != len(letters) or (kind is JointType.UNIVERSAL and len(set(letters)) != 2):
        return None
    return (kind, axes[: kind.axes]) if len(axes) >= kind.axes else None
