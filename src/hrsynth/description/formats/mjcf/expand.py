"""Elements that stand for others: ``<include>``, ``<attach>`` and ``<replicate>``, replaced by what they stand for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path

from ....errors import BadRobotFile
from ....tolerances import INCLUDED_FILES_MAX, ROBOT_FILE_MAX_BYTES
from ... import xml
from ...jointgraph import join_names

MODEL, COPY = "{urn:hrsynth}model", "{urn:hrsynth}copy"
"""Attributes of a ``<frame>`` that is made here: key of the model that its content is from, number of a copy."""
SECTIONS = "tendon", "equality", "actuator"
"""Sections whose elements refer to bodies, joints and sites; those of tendons first, to which the others refer too."""
EXPANDED_ELEMENTS_MAX = 20_000
"""Elements of a model with all copies above which it is refused."""

_REFERENCES = {name + end: name for name in ("joint", "body", "site", "tendon") for end in ("", "1", "2")} | {
    "jointinparent": "joint",
    "refsite": "site",
    "cranksite": "site",
    "slidersite": "site",
}
"""Kinds of elements that attributes name."""
_KINDS = {"freejoint": "joint", "fixed": "tendon", "spatial": "tendon"}


@dataclass
class ModelFiles:
    """Files of a model; only those in the folder of the main one and below it are read."""

    main: Path
    check: Callable[[xml.Element], object]
    """Called with a document once its includes are read."""
    models: dict[str, tuple[Path, xml.Element]] = field(default_factory=dict)
    """File and document of an attached model, by the key that its elements carry."""
    _size: int = 0
    _count: int = 0
    _made: int = 0

    def expand(self, root: xml.Element, path: Path, above: tuple[Path, ...] = ()) -> xml.Element:
        """Return a document with all such elements replaced. Raises ``BadRobotFile``."""
        self._include(root, path)
        self.check(root)
        known = dict[str, str]()
        for element in root.iterfind("asset/model"):
            file, model = self._open(element, path, {path.resolve(), *above})
            if model.tag != "mujoco":
                raise _refuse(element, path, "root element", str(model.tag), "mujoco")
            key = str(len(self.models))
            self.models[key] = file, model
            self.expand(model, file, (*above, path.resolve()))
            known[element.get("name") or model.get("model") or ""] = key
        for element in list(root.iter("attach")):
            self._attach(root, element, known, path)
        for element in reversed(list(root.iter("replicate"))):  # inner ones first
            self._replicate(root, element, path)
        return root

    def _open(self, at: xml.Element, path: Path, read: set[Path]) -> tuple[Path, xml.Element]:
        """Return path and document of the file that an element names; ``read`` are files that it cannot name."""
        name, allowed = at.get("file") or "", "a file in the model's folder"
        try:
            file = (path.resolve().parent / name).resolve()
        except (OSError, ValueError):
            raise _refuse(at, path, "not a file", name, allowed) from None
        if not name or not file.is_relative_to(self.main.resolve().parent):
            allowed = "a file beside the model or below it: open a copy that has its includes there"
            raise _refuse(at, path, "outside of the model's folder", name, allowed)
        self._count += 1
        if file in read or self._count > INCLUDED_FILES_MAX:
            raise _refuse(at, path, "repeated file, or too many files", name, f"each once, up to {INCLUDED_FILES_MAX}")
        try:
            content = xml.read_bytes(file)
        except BadRobotFile as error:
            raise _refuse(at, path, error.defects[0].problem, name, allowed) from None
        self._size += len(content)
        if self._size > ROBOT_FILE_MAX_BYTES:
            raise _refuse(at, path, "files too large", name, f"up to {ROBOT_FILE_MAX_BYTES} bytes together")
        root = xml.parse_document(content, str(file))
        for child in xml.list_children(root):
            child.base = str(file)
        return file, root

    def _include(self, root: xml.Element, path: Path) -> None:
        read = {path.resolve()}
        while (element := next(root.iter("include"), None)) is not None:
            file, included = self._open(element, path, read)
            read.add(file)
            if element.getparent() is None:
                raise xml.make_file_error(
                    path, "<include> in place of the model", "<mujoco>", line=xml.get_line(element)
                )
            for child in xml.list_children(included):
                element.addprevious(child)
            _get_parent(element).remove(element)

    def _attach(self, root: xml.Element, element: xml.Element, known: dict[str, str], path: Path) -> None:
        """Replace by a body or frame of another model, or by all its bodies, and by what connects these alone."""
        key, tag = known.get(element.get("model", "")), "frame" if "frame" in element.attrib else "body"
        if key is None:
            raise _refuse(element, path, "unknown model", element.get("model"), join_names(known) or "a <model> of it")
        model = self.models[key][1]
        parts = [child for world in model.findall("worldbody") for child in xml.list_children(world)]
        if (name := element.get(tag)) is not None:
            parts = [node for part in parts for node in part.iter(tag) if node.get("name") == name]
            if not parts:
                raise _refuse(element, path, f"unknown {tag} of model {element.get('model')!r}", name)
        frame = xml.create_element("frame")
        frame.set(MODEL, key)
        around = [node.get("childclass") for part in parts[:1] for node in part.iterancestors()]
        if classes := [node for node in around if node is not None]:
            frame.set("childclass", classes[0])
        self._made += sum(1 for _ in model.iter())
        self._fill(root, element, path, {element.get("prefix", "") + "{}": frame}, parts, _find_connected(parts, model))

    def _replicate(self, root: xml.Element, element: xml.Element, path: Path) -> None:
        """Replace by copies, each displaced from the one before, and by copies of what connects elements of one."""
        count, frames = element.get("count", ""), {}
        if not count.isdecimal() or not count.isascii() or len(count) > 4:
            raise _refuse(element, path, "count", count, "a whole number of up to 4 digits")
        for number in range(int(count)):
            place = {"pos": element.get("offset", "0 0 0"), "euler": element.get("euler", "0 0 0")}
            frame = frames[f"{{}}{element.get('sep', '')}{number:0{len(count)}}"] = xml.create_element("frame", **place)
            frame.set(COPY, str(number))
        parts = xml.list_children(element)
        connected = _find_connected(parts, root)
        self._fill(root, element, path, frames, parts, connected)
        for original in connected:
            _get_parent(original).remove(original)

    def _fill(
        self,
        root: xml.Element,
        element: xml.Element,
        path: Path,
        frames: Mapping[str, xml.Element],
        parts: Sequence[xml.Element],
        connected: Sequence[xml.Element],
    ) -> None:
        """Replace an element by frames with copies of ``parts``; add copies of what connects these. ``frames`` are
        given by the format of the new names."""
        old = [key for node in (*parts, *connected) for key in _list_names(node)]
        self._made += len(frames) * sum(1 for node in (*parts, *connected) for _ in node.iter())
        if self._made > EXPANDED_ELEMENTS_MAX:
            raise _refuse(element, path, "too many elements with all copies", None, f"up to {EXPANDED_ELEMENTS_MAX}")
        for form, frame in frames.items():
            names = {key: form.replace("{}", key[1]) for key in old}
            frame.extend(_copy_renamed(part, names) for part in parts)
            element.addprevious(frame)
            for original in connected:
                copy = _copy_renamed(original, names)
                before = _get_parent(original)
                section = xml.create_element(str(before.tag), copy)
                section.set(MODEL, frame.get(MODEL, before.get(MODEL, "")))
                root.append(section)
        _get_parent(element).remove(element)


def _find_connected(parts: Sequence[xml.Element], source: xml.Element) -> list[xml.Element]:
    """Return the elements of the sections of a document that refer to these parts alone."""
    known, connected = {key for part in parts for key in _list_names(part)}, []
    for element in (node for section in SECTIONS for node in source.iterfind(f"{section}/*")):
        pairs = ((_REFERENCES.get(str(key)), value) for node in element.iter("*") for key, value in node.attrib.items())
        used = {(kind, str(value)) for kind, value in pairs if kind is not None}
        if used and used <= known:
            known.update(_list_names(element))
            connected.append(element)
    return connected


def _get_parent(element: xml.Element) -> xml.Element:
    parent = element.getparent()
    assert parent is not None
    return parent


def _list_names(element: xml.Element) -> Iterator[tuple[str, str]]:
    """Yield kind and name of all elements in one that have a name."""
    for node in element.iter("*"):
        if (name := node.get("name")) is not None:
            yield _KINDS.get(str(node.tag), str(node.tag)), name


def _copy_renamed(element: xml.Element, names: Mapping[tuple[str, str], str]) -> xml.Element:
    """Return a copy with new names, by kind and old name, for the element and those in it, and for what they refer
    to."""
    copy = deepcopy(element)
    if element.base is not None:
        copy.base = element.base
    for node in copy.iter("*"):
        kind = _KINDS.get(str(node.tag), str(node.tag))
        for key, value in node.attrib.items():
            new = names.get((kind if key == "name" else _REFERENCES.get(str(key), ""), str(value)))
            if new is not None:
                node.set(key, new)
    return copy


def _refuse(at: xml.Element, path: Path, what: str, value: str | None, allowed: str | None = None) -> BadRobotFile:
    return xml.make_file_error(at.base or path, f"<{at.tag}>: {what}", allowed, value=value, line=xml.get_line(at))
