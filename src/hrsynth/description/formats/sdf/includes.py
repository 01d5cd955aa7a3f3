"""Models that an SDFormat file includes: read where they lie in the file's folder or below it."""

from __future__ import annotations

from pathlib import Path

from ....errors import BadRobotFile
from ....mechanism.model import Note
from ... import xml

INCLUDED_MODELS_MAX = 100
"""Included models above which an SDFormat file is refused: an include may lead to itself."""
_SCHEMES = ("model://", "file://", "package://")
_REPLACED = ("pose", "static", "placement_frame")
"""Elements of an ``<include>`` that replace those of the model."""


def include_models(root: xml.Element, file: str) -> list[Note]:
    """Replace every ``<include>`` by the model that it names, with the include's own name and pose, and return notes of
    objects of the world that are not found. Raises ``BadRobotFile`` for parts of models, with the searched folder."""
    folder = Path(file).resolve().parent
    missing: list[BadRobotFile] = []
    size = 0
    for _ in range(INCLUDED_MODELS_MAX):
        element = next(root.iter("include"), None)
        parent = None if element is None else element.getparent()
        if element is None or parent is None:
            break
        model = _read_model(element, folder, file)
        if isinstance(model, BadRobotFile):
            missing.append(model)
            parent.remove(element)
            if parent.tag == "model":
                raise model
        else:
            parent.replace(element, model)
            size += sum(1 for _ in model.iter())
        if size > xml.XML_ELEMENTS_MAX:
            raise xml.make_file_error(file, "too many elements with its includes", f"up to {xml.XML_ELEMENTS_MAX}")
    else:
        raise xml.make_file_error(file, "too many <include>", f"up to {INCLUDED_MODELS_MAX}")
    if missing and root.find(".//model") is None:
        raise missing[0]
    return [Note("ignored", error.defects[0].text) for error in missing]


def _read_model(element: xml.Element, folder: Path, file: str) -> xml.Element | BadRobotFile:
    """Return the model of an ``<include>``, or the reason why it is not read."""
    uri, source = (element.findtext("uri") or "").strip(), element.base or file
    scheme = next((start for start in _SCHEMES if uri.startswith(start)), "")
    what, expected = "other files are not fetched", "a model in the file's folder"
    if element.get("merge") in ("true", "1"):
        what, expected = "a model is merged", "its links and joints in this file"
    elif scheme or "://" not in uri:
        path = _find_model(uri.removeprefix(scheme), folder, Path(source).resolve().parent)
        models = [] if path is None else xml.parse_document(xml.read_bytes(path), str(path), []).findall("model")
        what, expected = "model not found", f"a file with one model in {folder}, where it was looked for"
        if len(models) == 1:
            return _rename_model(models[0], element, str(path))
    return xml.make_file_error(source, f"<include>: {what}", expected, value=uri, line=xml.get_line(element))


def _find_model(name: str, folder: Path, near: Path) -> Path | None:
    """Return the file of a model, or of the folder with that name, if it lies in ``folder`` or below it."""
    for place in (near, folder):
        try:
            path = (place / name).resolve()
            files = sorted(path.glob("*.sdf")) if name and path.is_dir() else [path] if path.is_file() else []
        except (OSError, ValueError):
            continue
        named = [file for file in files if file.name == "model.sdf"] or files
        if named and named[0].resolve().is_relative_to(folder):
            return named[0].resolve()
    return None


def _rename_model(model: xml.Element, element: xml.Element, file: str) -> xml.Element:
    """Return a model of another ``file`` with the name and pose of the ``<include>``."""
    model.base = file
    if name := (element.findtext("name") or "").strip():
        model.set("name", name)
    for child in [part for part in xml.list_children(element) if part.tag in _REPLACED]:
        for old in model.findall(str(child.tag)):
            model.remove(old)
        model.append(child)
    return model
