"""Default classes of MJCF: nested, each inheriting from the one around it; includes put in place."""

from __future__ import annotations

from pathlib import Path

from ...errors import BadRobotFile, Defect
from .. import xml
from ..elements import Elements

FILES = 50
"""Files that a model may include."""


class Defaults:
    """The attributes that each class gives to each kind of element."""

    def __init__(self, reader: Elements, root: xml.Element) -> None:
        self.reader = reader
        self.classes: dict[str, dict[str, dict[str, str]]] = {"main": {}}
        for element in root.findall("default"):
            self._read(element, {}, "main")

    def _read(self, element: xml.Element, inherited: dict[str, dict[str, str]], name: str) -> None:
        own = {tag: dict(values) for tag, values in inherited.items()}
        for tag, values in self.classes.get(name, {}).items():
            own.setdefault(tag, {}).update(values)
        for child in xml.children(element):
            if child.tag != "default":
                own.setdefault(child.tag, {}).update({str(key): str(value) for key, value in child.attrib.items()})
        self.classes[name] = own
        for child in element.findall("default"):
            inner = child.get("class")
            if inner is None:
                self.reader.defect(xml.line(child), "<default> without class")
            else:
                self._read(child, own, inner)

    def of(self, element: xml.Element, childclass: str | None, tag: str | None = None) -> dict[str, str]:
        """The attributes of an element with those of its class, its own first."""
        name = element.get("class") or childclass or "main"
        if name not in self.classes:
            self.reader.defect(xml.line(element), "unknown default class", name)
            name = "main"
        given = dict(self.classes[name].get(tag or str(element.tag), {}))
        given.update({str(key): str(value) for key, value in element.attrib.items()})
        return given


def with_includes(root: xml.Element, file: str) -> xml.Element:
    """The document with every ``<include>`` replaced by what the file holds; only files in the folder of the main one
    and below it are read, none twice. Raises ``BadRobotFile``."""
    folder = Path(file).resolve().parent
    seen = {Path(file).resolve()}
    size = 0
    while (element := next(root.iter("include"), None)) is not None:
        name = element.get("file") or ""

        def refuse(what: str, allowed: str, at: xml.Element = element, value: str = name) -> BadRobotFile:
            return BadRobotFile([Defect(at.base or file, xml.line(at), what, value, allowed)])

        try:
            path = (folder / name).resolve()
        except (OSError, ValueError):
            raise refuse("an include that is no file", "a file in the model's folder") from None
        if not name or not path.is_relative_to(folder):
            raise refuse("an include outside of the model's folder", "a file in the model's folder")
        if path in seen or len(seen) > FILES:
            raise refuse("a file that is included again, or too many of them", f"each once, up to {FILES}")
        seen.add(path)
        try:
            content = xml.content(path)
        except BadRobotFile as error:
            raise refuse(f"an include of what is {error.defects[0].what}", "a file in the model's folder") from None
        size += len(content)
        if size > xml.LARGEST_FILE:
            raise refuse("included files too large", f"up to {xml.LARGEST_FILE} bytes together")
        parent, included = element.getparent(), xml.document(content, str(path))
        if parent is None:
            raise refuse("an include in place of the model", "<mujoco>")
        place = parent.index(element)
        parent.remove(element)
        for child in reversed(xml.children(included)):
            child.base = str(path)
            parent.insert(place, child)
    return root
